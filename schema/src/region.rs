//! What a change detector finds and what a descriptor estimator makes of it.

use crate::class::ClassId;
use crate::descriptor::Descriptor;
use crate::position::GridPoint;

/// Half-open box of pixels: `left ≤ u < right`, `top ≤ v < bottom`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelBox {
    /// First column.
    pub left: u32,
    /// First row.
    pub top: u32,
    /// One past the last column.
    pub right: u32,
    /// One past the last row.
    pub bottom: u32,
}

impl PixelBox {
    /// Columns.
    pub fn width(&self) -> u32 {
        self.right - self.left
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.bottom - self.top
    }
}

/// One connected region in which photo and view disagree in the same way (Lee & Hsu, Eq. 8).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChangeRegion {
    /// Class in the view, that is, in the map.
    pub class_before: ClassId,
    /// Class in the photo.
    pub class_after: ClassId,
    /// Tight bounds.
    pub bounds: PixelBox,
    /// Row-major over `bounds`, 1 inside the region, 0 outside.
    pub mask: Vec<u8>,
    /// Number of ones in `mask`.
    pub pixels: u32,
}

/// A change that does not meet a requirement: a result with its evidence, not an error.
#[derive(Clone, Debug, PartialEq)]
pub struct Rejection {
    /// Class in the map.
    pub class_before: ClassId,
    /// Class in the photo.
    pub class_after: ClassId,
    /// Size of the region, pixels.
    pub pixels: u32,
    /// Short stable name of the requirement: `captured-entirely`, `within-range`, `coplanar`, `rectangle`, …
    pub requirement: String,
    /// What was measured.
    pub measured: f64,
    /// What it was measured against.
    pub limit: f64,
    /// Unit of both: `m`, `px`, `deg`, `ratio`, …
    pub unit: String,
}

/// What an estimator proposes for one region.
#[derive(Clone, Debug, PartialEq)]
pub enum Proposal {
    /// Put this descriptor on the map. Core turns it into an add, a modification, or nothing where it is there already.
    Place {
        /// Index of the region it comes from.
        region: u32,
        /// The measured descriptor.
        descriptor: Descriptor,
    },
    /// Take a descriptor of `class` near `near` off the map. Core assigns removals to descriptors one to one.
    Remove {
        /// Index of the region it comes from.
        region: u32,
        /// Class in the view.
        class: ClassId,
        /// Where it stood.
        near: GridPoint,
        /// 1σ of `near`, metres.
        sigma_m: f64,
    },
    /// Leave the map alone, for this reason.
    Reject {
        /// Index of the region it comes from.
        region: u32,
        /// Requirement, measured value and limit.
        rejection: Rejection,
    },
}
