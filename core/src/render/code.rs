//! A pixel's triangle and class in one word.

use crate::mesh::Surface;
use resurvey_schema::ClassId;

/// Index of a triangle and its class; triangles in the order of their indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Code(pub(super) u32);

const CLASS_BITS: u32 = 4;
/// Triangles that a scene can have: 268 million.
pub(super) const MOST_TRIANGLES: usize = (1 << (32 - CLASS_BITS)) - 1;

impl Code {
    /// Stands for a class that does not fit, and for the classes of a texture.
    pub(super) const LOOKED_UP: u8 = (1 << CLASS_BITS) - 1;

    /// Triangle `triangle`, made of `surface`.
    pub(super) fn of_triangle(triangle: usize, surface: &Surface) -> Self {
        match surface {
            Surface::Class(class) => Self::new(triangle, *class),
            Surface::Texture(_) => Self::new(triangle, ClassId::VOID),
        }
    }

    /// No triangle: sky.
    pub(super) fn sky(class: ClassId) -> Self {
        Self::new(MOST_TRIANGLES, class)
    }

    fn new(triangle: usize, class: ClassId) -> Self {
        Self((triangle as u32) << CLASS_BITS | u32::from(class.0.min(Self::LOOKED_UP)))
    }

    /// The triangle; `None` for sky.
    #[inline(always)]
    pub(super) fn triangle(self) -> Option<u32> {
        let triangle = self.0 >> CLASS_BITS;
        (triangle as usize != MOST_TRIANGLES).then_some(triangle)
    }

    /// The class, or that it is to be looked up.
    #[inline(always)]
    pub(super) fn class(self) -> u8 {
        (self.0 & u32::from(Self::LOOKED_UP)) as u8
    }
}
