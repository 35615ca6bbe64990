//! How much of a thing a photo shows.

use super::camera::{Camera, distance_m, dot, subtract};
use super::caster::cast;
use super::change::Placed;
use super::placing::{BORDER_PX, CHAIR_M, PEDESTRIAN_M, outward};
use super::scene::Scene;
use super::world::{Block, Offset, World, class};

/// Shares of the pixels that a thing would cover in an image without borders and with nothing else in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Share beyond the border.
    pub outside: f64,
    /// Share in the image that nothing hides.
    pub shown: f64,
}

impl Seen {
    /// Of a thing behind the camera.
    pub const NOTHING: Self = Self { outside: 1.0, shown: 0.0 };
}

/// Rays over the longer side of what is looked at.
const RAYS: f64 = 40.0;
/// A hit nearer than this share of the distance is something in front.
const SAME_DISTANCE: f64 = 1.0 - 1e-6;

impl Placed {
    /// The object as a block; `None` for a panel.
    pub fn block(&self) -> Option<Block> {
        match self {
            Self::Panel(_) => None,
            Self::Object(class, foot) => Some(Block::object(*class, *foot, size_m(*class), 0.0)),
        }
    }

    /// Adds the thing to a world.
    pub fn put(&self, world: &mut World) {
        match self {
            Self::Panel(panel) => world.panels.push(panel.clone()),
            Self::Object(..) => world.blocks.extend(self.block()),
        }
    }

    /// Its corners: four of a panel, eight of an object.
    pub fn points(&self) -> Vec<Offset> {
        let of_block = |block: Block| {
            let [low, high] = [block.bottom + 0.02, block.top];
            block.corners().into_iter().flat_map(|[x, y]| [[x, y, low], [x, y, high]]).collect()
        };
        match self {
            Self::Panel(panel) => panel.corners.to_vec(),
            Self::Object(..) => self.block().map(of_block).unwrap_or_default(),
        }
    }

    /// The middle of its corners.
    pub fn centre(&self) -> Offset {
        let points = self.points();
        [0, 1, 2].map(|i| points.iter().map(|point| point[i]).sum::<f64>() / points.len() as f64)
    }

    /// Left, top, right, bottom of its pixels, beyond the image as well; `None` where a corner is behind the camera.
    pub fn bounds_px(&self, camera: &Camera) -> Option<[f64; 4]> {
        let axes = camera.axes();
        let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
        for point in self.points() {
            let [u, v] = camera.pixel(&axes, point)?;
            bounds = [bounds[0].min(u), bounds[1].min(v), bounds[2].max(u), bounds[3].max(v)];
        }
        Some(bounds)
    }

    /// Whether its pixels and those of `other` are at least `margin_px` apart.
    pub fn is_apart(&self, other: &Self, camera: &Camera, margin_px: f64) -> bool {
        let (Some(own), Some(others)) = (self.bounds_px(camera), other.bounds_px(camera)) else { return false };
        (0..2).any(|i| own[i] > others[i + 2] + margin_px || others[i] > own[i + 2] + margin_px)
    }

    /// How much of it a photo of `world` shows, whether or not it stands in that world; `None` behind the camera.
    pub fn seen(&self, world: &World, camera: &Camera) -> Option<Seen> {
        let [left, top, right, bottom] = self.bounds_px(camera)?;
        let step = ((right - left).max(bottom - top) / RAYS).max(0.5);
        let mut alone = World::default();
        self.put(&mut alone);
        let axes = camera.axes();
        let (mut all, mut outside, mut shown) = (0_u32, 0_u32, 0_u32);
        let steps =
            |low: f64, high: f64| (0..((high - low) / step).ceil() as u32).map(move |i| (f64::from(i) + 0.5) * step);
        for v in steps(top, bottom).map(|by| top + by) {
            for u in steps(left, right).map(|by| left + by) {
                let ray = camera.ray(&axes, u, v);
                let own = cast(&alone, camera.position, ray).distance;
                if own.is_finite() {
                    all += 1;
                    let is_outside = !camera.holds([u, v], 0.0);
                    outside += u32::from(is_outside);
                    shown +=
                        u32::from(!is_outside && cast(world, camera.position, ray).distance >= own * SAME_DISTANCE);
                }
            }
        }
        let share = |count: u32| f64::from(count) / f64::from(all);
        (all > 0).then(|| Seen { outside: share(outside), shown: share(shown) })
    }

    /// Whether it is whole in the image, in the scene's range and, if a panel, not too oblique.
    pub fn is_in_view(&self, scene: &Scene, camera: &Camera) -> bool {
        let axes = camera.axes();
        let is_held = |point| camera.pixel(&axes, point).is_some_and(|pixel| camera.holds(pixel, BORDER_PX));
        let range = distance_m(camera.position, self.centre());
        let [near, far] = match self {
            Self::Panel(_) => scene.banner.range_m,
            Self::Object(..) => scene.object_range_m,
        };
        (near..far).contains(&range) && self.is_facing(camera) && self.points().into_iter().all(is_held)
    }

    /// Whether a panel is seen at less than 65° from its normal; objects always are.
    pub fn is_facing(&self, camera: &Camera) -> bool {
        let Self::Panel(panel) = self else { return true };
        let to_camera = subtract(camera.position, self.centre());
        let range = dot(to_camera, to_camera).sqrt();
        dot(outward(panel), to_camera) > range * 65_f64.to_radians().cos()
    }
}

/// Width, depth and height of an object of a class.
fn size_m(class: u8) -> [f64; 3] {
    if class == class::PEDESTRIAN { PEDESTRIAN_M } else { CHAIR_M }
}
