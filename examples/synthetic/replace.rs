//! Changes of what the map already knew: another material in its place, another size, another place.

use super::camera::Camera;
use super::caster::cast;
use super::change::{Event, Placed};
use super::placing::{CHAIR_M, banner, is_clear, standing};
use super::random::Random;
use super::scene::Scene;
use super::world::{Offset, Panel, World, class};

/// Edges of a panel in place of another are off by up to this share of its size.
const REPLACED_OFF: f64 = 0.02;
/// Share that a banner has grown by.
const GROWN: [f64; 2] = [0.3, 0.6];
/// How far a chair has moved, metres.
const MOVED_M: [f64; 2] = [0.4, 1.5];
/// Chairs further away than this are a few pixels, metres.
const CHAIR_REACH_M: f64 = 8.0;
/// A panel's surroundings are this many times as wide and high as it is.
const AROUND: f64 = 1.3;
/// Share of the surroundings that may have the class of what is hung there.
const SAME_CLASS: f64 = 0.02;

/// Hangs a panel of another material where the map knew a banner.
pub fn banner_replaced(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let before = lone_banner(scene, &event.after, &event.camera, random)?;
    let materials = [class::METAL, class::STONE, class::GLASS];
    let behind = classes_around(&event.after, &event.camera, &before);
    let class = materials.into_iter().find(|material| share(&behind, *material) <= SAME_CLASS)?;
    let mut off = || random.within(-REPLACED_OFF, REPLACED_OFF);
    let after = Panel { class, ..part(&before, [off(), 1.0 + off()], [off(), 1.0 + off()]) };
    event.replace(Placed::Panel(before), Placed::Panel(after));
    Some(())
}

/// Makes a banner that the map knew wider or higher.
pub fn banner_grown(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let after = lone_banner(scene, &event.after, &event.camera, random)?;
    let kept = 1.0 / (1.0 + random.within(GROWN[0], GROWN[1]));
    let (whole, kept) = ([0.0, 1.0], if random.chance(0.5) { [0.0, kept] } else { [1.0 - kept, 1.0] });
    let before = if random.chance(0.5) { part(&after, kept, whole) } else { part(&after, whole, kept) };
    event.replace(Placed::Panel(before), Placed::Panel(after));
    Some(())
}

/// Moves a chair that the map knew.
pub fn chair_moved(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let before = chair(scene, &event.after, &event.camera, random)?;
    let (bearing, by) = (random.within(0.0, std::f64::consts::TAU), random.within(MOVED_M[0], MOVED_M[1]));
    let after = [before[0] + by * bearing.sin(), before[1] + by * bearing.cos(), before[2]];
    is_clear(&event.after, &event.camera, after, CHAIR_M).then(|| {
        event.replace(Placed::Object(class::CHAIR, before), Placed::Object(class::CHAIR, after));
    })
}

/// Ground contact of a chair that is near enough to be measured.
pub fn chair(scene: &Scene, world: &World, camera: &Camera, random: &mut Random) -> Option<Offset> {
    let [near, far] = scene.object_range_m;
    standing([near, far.min(CHAIR_REACH_M)], world, camera, CHAIR_M, random)
}

/// A well seen banner with no other one behind or beside it.
pub fn lone_banner(scene: &Scene, world: &World, camera: &Camera, random: &mut Random) -> Option<Panel> {
    banner(scene, world, camera, random).filter(|panel| is_alone(world, camera, panel))
}

/// Whether nothing behind a panel or around it has its class.
pub fn is_alone(world: &World, camera: &Camera, panel: &Panel) -> bool {
    share(&classes_around(world, camera, panel), panel.class) <= SAME_CLASS
}

/// Classes that `world`, without the panel, shows behind it and around.
fn classes_around(world: &World, camera: &Camera, panel: &Panel) -> Vec<u8> {
    let [low, high] = [(1.0 - AROUND) / 2.0, (1.0 + AROUND) / 2.0];
    let around = part(panel, [low, high], [low, high]);
    let [a, b, _, d] = around.corners;
    let steps = (0..14).flat_map(|s| (0..14).map(move |t| [f64::from(s) / 13.0, f64::from(t) / 13.0]));
    let point = |[s, t]: [f64; 2]| [0, 1, 2].map(|i| a[i] + s * (b[i] - a[i]) + t * (d[i] - a[i]));
    steps
        .map(|at| {
            let point = point(at);
            cast(world, camera.position, [0, 1, 2].map(|i| point[i] - camera.position[i])).class
        })
        .collect()
}

fn share(classes: &[u8], class: u8) -> f64 {
    classes.iter().filter(|&&other| other == class).count() as f64 / classes.len() as f64
}

/// The part of a panel between two shares of its width and two of its height, which may lie beyond it.
fn part(panel: &Panel, [left, right]: [f64; 2], [low, high]: [f64; 2]) -> Panel {
    let [a, b, _, d] = panel.corners;
    let point = |[s, t]: [f64; 2]| [0, 1, 2].map(|i| a[i] + s * (b[i] - a[i]) + t * (d[i] - a[i]));
    Panel { class: panel.class, corners: [[left, low], [right, low], [right, high], [left, high]].map(point) }
}
