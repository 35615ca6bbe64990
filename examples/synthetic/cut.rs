//! New things that the image border cuts, so that no one can say how large they are or where they stand.

use super::caster::{Thing, at, cast};
use super::change::{Event, Placed};
use super::placing::{panel_on, stands_free};
use super::random::Random;
use super::replace::is_alone;
use super::scene::Scene;
use super::world::{Paint, class};

/// Share of the thing beyond the border.
const OUTSIDE: [f64; 2] = [0.1, 0.6];
/// Of what is in the image, this share is hidden by nothing.
const SHOWN: f64 = 0.95;
/// Least and greatest distance of an object, metres.
const RANGE_M: [f64; 2] = [1.3, 7.0];
/// Greatest angle of an object from the optical axis, degrees; the border is at 54.
const OFF_AXIS_DEG: f64 = 62.0;
const TRIES: usize = 60;

/// A pedestrian or a chair whose foot or side is cut.
pub fn object(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let class = if scene.outdoors && random.chance(0.5) { class::PEDESTRIAN } else { class::CHAIR };
    let camera = event.camera;
    let [width, height] = [camera.width, camera.height].map(f64::from);
    for _ in 0..TRIES {
        let range = random.within(RANGE_M[0], RANGE_M[1]);
        let heading = camera.yaw_rad + random.within(-OFF_AXIS_DEG, OFF_AXIS_DEG).to_radians();
        let foot = [camera.position[0] + range * heading.sin(), camera.position[1] + range * heading.cos(), 0.0];
        let placed = Placed::Object(class, foot);
        let Some([left, _, right, bottom]) = placed.bounds_px(&camera) else { continue };
        let is_cut = left < 0.0 || right > width || bottom > height;
        if is_cut && stands_free(&event.after, foot) && is_cut_well(event, &placed) {
            add_cut(event, placed);
            return Some(());
        }
    }
    None
}

/// A banner that is cut on any side.
pub fn banner(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let (camera, limits) = (event.camera, &scene.banner);
    let axes = camera.axes();
    for _ in 0..TRIES {
        let aim = [camera.width, camera.height].map(|size| random.within(-0.1, 1.1) * f64::from(size));
        let ray = camera.ray(&axes, aim[0], aim[1]);
        let hit = cast(&event.after, camera.position, ray);
        let Thing::Block(index, wall @ 0..4) = hit.thing else { continue };
        let block = &event.after.blocks[index as usize];
        let Paint::Strip(_) = block.walls else { continue };
        let size_m = [limits.width_m, limits.height_m].map(|[low, high]| random.within(low, high));
        let aimed = at(camera.position, ray, hit.distance);
        let Some(panel) = panel_on(block, usize::from(wall), aimed, size_m, limits.between_m) else { continue };
        let is_near = (limits.range_m[0]..limits.range_m[1]).contains(&hit.distance);
        let is_lone = is_near && is_alone(&event.after, &camera, &panel);
        let placed = Placed::Panel(panel);
        if is_lone && placed.is_facing(&camera) && is_cut_well(event, &placed) {
            add_cut(event, placed);
            return Some(());
        }
    }
    None
}

/// Whether the border, and nothing else, hides a share of the thing.
fn is_cut_well(event: &Event, placed: &Placed) -> bool {
    placed.seen(&event.after, &event.camera).is_some_and(|seen| {
        (OUTSIDE[0]..=OUTSIDE[1]).contains(&seen.outside) && seen.shown >= SHOWN * (1.0 - seen.outside)
    })
}

fn add_cut(event: &mut Event, placed: Placed) {
    placed.put(&mut event.after);
    event.unmeasurable.push(placed);
}
