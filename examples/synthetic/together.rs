//! Several things in one photo.

use super::camera::subtract;
use super::change::{Event, Placed};
use super::placing::{CHAIR_M, PEDESTRIAN_M, is_clear, standing};
use super::random::Random;
use super::replace::{chair, lone_banner};
use super::scene::Scene;
use super::world::{Offset, class};

/// Two that touch stand so far apart across the line of sight, and so much deeper, metres.
const ABREAST_M: [f64; 2] = [0.5, 0.7];
const DEEPER_M: [f64; 2] = [0.0, 0.5];
/// Share of each of two that touch which the other leaves visible.
const TOUCHING_SHOWN: f64 = 0.7;
/// Two that touch stand no further away than this, metres.
const TOUCHING_REACH_M: f64 = 10.0;
/// Side of an object, metres.
const SIDE_M: f64 = 0.5;
/// Things that should not touch are this far apart in the image, pixels.
const APART_PX: f64 = 20.0;

/// Two pedestrians, indoors two chairs, side by side as the camera sees them.
pub fn touching(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let (class, size_m) = newcomer(scene);
    let [near, far] = scene.object_range_m;
    let first = standing([near, far.min(TOUCHING_REACH_M)], &event.after, &event.camera, size_m, random)?;
    let second = beside(event, first, random);
    let [one, other] = [first, second].map(|foot| Placed::Object(class, foot));
    let overlap = (0..2).all(|axis| (first[axis] - second[axis]).abs() < SIDE_M);
    let [a, b] = [one.bounds_px(&event.camera)?, other.bounds_px(&event.camera)?];
    if overlap || a[2] < b[0] || b[2] < a[0] || !is_clear(&event.after, &event.camera, second, size_m) {
        return None;
    }
    let mut world = event.after.clone();
    one.put(&mut world);
    other.put(&mut world);
    let is_shown =
        |placed: &Placed| placed.seen(&world, &event.camera).is_some_and(|seen| seen.shown >= TOUCHING_SHOWN);
    if !is_shown(&one) || !is_shown(&other) {
        return None;
    }
    event.add(one);
    event.add(other);
    event.least_shown = TOUCHING_SHOWN;
    Some(())
}

/// A place next to `foot`, to one side of it as the camera sees it.
fn beside(event: &Event, foot: Offset, random: &mut Random) -> Offset {
    let [x, y, _] = subtract(foot, event.camera.position);
    let range = x.hypot(y);
    let side = if random.chance(0.5) { 1.0 } else { -1.0 };
    let (across, deeper) = (side * random.within(ABREAST_M[0], ABREAST_M[1]), random.within(DEEPER_M[0], DEEPER_M[1]));
    [foot[0] + (across * y + deeper * x) / range, foot[1] + (deeper * y - across * x) / range, foot[2]]
}

/// Who comes to a scene: pedestrians outdoors, chairs indoors.
fn newcomer(scene: &Scene) -> (u8, [f64; 3]) {
    if scene.outdoors { (class::PEDESTRIAN, PEDESTRIAN_M) } else { (class::CHAIR, CHAIR_M) }
}

/// A new banner, a new pedestrian or chair, and a banner that is gone, apart in the image.
pub fn several(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let camera = event.camera;
    let gone = Placed::Panel(lone_banner(scene, &event.after, &camera, random)?);
    let mut with_gone = event.after.clone();
    gone.put(&mut with_gone);
    let added = Placed::Panel(lone_banner(scene, &with_gone, &camera, random)?);
    let (class, size_m) = newcomer(scene);
    let newcomer = Placed::Object(class, standing(scene.object_range_m, &event.after, &camera, size_m, random)?);
    let is_apart = |a: &Placed, b: &Placed| a.is_apart(b, &camera, APART_PX);
    if !is_apart(&gone, &added) || !is_apart(&gone, &newcomer) || !is_apart(&added, &newcomer) {
        return None;
    }
    event.add(added);
    event.add(newcomer);
    event.remove(gone);
    Some(())
}

/// A banner and a chair that the map knew, and nothing new.
pub fn known(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let camera = event.camera;
    let banner = Placed::Panel(lone_banner(scene, &event.after, &camera, random)?);
    let chair = Placed::Object(class::CHAIR, chair(scene, &event.after, &camera, random)?);
    banner.is_apart(&chair, &camera, APART_PX).then(|| {
        event.keep(banner);
        event.keep(chair);
    })
}
