//! A scene: a world that is mapped, where a camera can stand in it, and what may change.

use super::random::Random;
use super::world::{Offset, World};
use super::{hall, street};
use anyhow::bail;

/// The places there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// A street canyon of about twenty buildings, as in Tsim Sha Tsui.
    Street,
    /// A lane five metres wide.
    Alley,
    /// A street of the same building over and over: its places cannot be told apart.
    Blocks,
    /// A reading hall with shelves, pillars and desks.
    Hall,
}

impl SceneKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Street, Self::Alley, Self::Blocks, Self::Hall];

    /// Name in paths and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Street => "street",
            Self::Alley => "alley",
            Self::Blocks => "blocks",
            Self::Hall => "hall",
        }
    }
}

impl std::str::FromStr for SceneKind {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match Self::ALL.into_iter().find(|kind| kind.name() == name) {
            Some(kind) => Ok(kind),
            None => bail!("unknown scene {name:?}: expected street, alley, blocks or hall"),
        }
    }
}

/// Limits of what may be put on a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BannerLimits {
    /// Least and greatest distance from the camera, metres.
    pub range_m: [f64; 2],
    /// Least and greatest width, metres.
    pub width_m: [f64; 2],
    /// Least and greatest height of the banner itself, metres.
    pub height_m: [f64; 2],
    /// Its lower edge stays above this, its upper edge below the second, metres above the ground.
    pub between_m: [f64; 2],
}

/// A place, its map, and how people take photos there.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Which one.
    pub kind: SceneKind,
    /// Grid position of the scene's origin: easting, northing, height, metres.
    pub origin: [f64; 3],
    /// The world as the map has it.
    pub world: World,
    /// Turn of the walkable area about the origin, radians, counter-clockwise from above.
    pub turn_rad: f64,
    /// Where a camera can stand, before the turn: least and greatest x, least and greatest y.
    pub walk: [f64; 4],
    /// Greatest angle between the heading and the long axis, degrees; 180 for any heading.
    pub heading_spread_deg: f64,
    /// Least and greatest pitch, degrees.
    pub pitch_deg: [f64; 2],
    /// 1σ of the prior's position along each axis, metres.
    pub prior_sigma_m: f64,
    /// What may be put on its walls.
    pub banner: BannerLimits,
    /// Least and greatest distance of people and chairs, metres.
    pub object_range_m: [f64; 2],
    /// Whether trees and vehicles occur.
    pub outdoors: bool,
}

impl Scene {
    /// The scene of a kind that follows from `seed`.
    pub fn new(kind: SceneKind, seed: u64) -> Self {
        let mut random = Random::new(seed, kind.name());
        match kind {
            SceneKind::Hall => hall::hall(&mut random),
            _ => street::street(kind, &mut random),
        }
    }

    /// Name in paths.
    pub fn name(&self) -> &'static str {
        self.kind.name()
    }

    /// Grid position of an offset, rounded to 0.1 mm.
    pub fn grid(&self, offset: Offset) -> [f64; 3] {
        [0, 1, 2].map(|i| ((self.origin[i] + offset[i]) * 1e4).round() / 1e4)
    }

    /// Turns a point of the walkable area to east and north.
    pub fn east_north(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn_rad.sin_cos();
        [x * cos - y * sin, x * sin + y * cos]
    }
}
