//! Where a second photo of the same changed place is taken from.

use super::camera::Camera;
use super::caster::picture;
use super::change::{Change, Event};
use super::random::Random;
use super::scene::Scene;
use super::world::{Offset, World};

/// Least and greatest distance between the two photos, metres.
const AWAY_M: [f64; 2] = [3.0, 8.0];
/// Poses that are tried.
const TRIES: usize = 4000;
/// The camera turns away from what it looks at by up to this, degrees.
const AIM_SPREAD_DEG: f64 = 25.0;
/// Pixels of a photo of a tenth of the size that a changed façade has to cover.
const REPAINTED_PX: usize = 140;

/// A camera a few metres from the first that sees what `event` is about well in `world`, the place with its clutter;
/// `None` when no pose does.
pub fn second_camera(scene: &Scene, world: &World, event: &Event, random: &mut Random) -> Option<Camera> {
    let aim = aim(event);
    let mut pose = || {
        let (bearing, away) = (random.within(0.0, std::f64::consts::TAU), random.within(AWAY_M[0], AWAY_M[1]));
        let [x, y, z] = event.camera.position;
        let position = [x + away * bearing.sin(), y + away * bearing.cos(), z];
        let heading = match aim {
            Some(aim) => (aim[0] - position[0]).atan2(aim[1] - position[1]),
            None => event.camera.yaw_rad,
        };
        let turned = random.within(-AIM_SPREAD_DEG, AIM_SPREAD_DEG).to_radians();
        let pitch = random.within(scene.pitch_deg[0], scene.pitch_deg[1]).to_radians();
        let roll = random.normal().to_radians();
        Camera::new(position, [heading + turned, pitch, roll])
    };
    (0..TRIES)
        .map(|_| pose())
        .find(|camera| stands_free(scene, world, camera.position) && shows(scene, world, event, camera))
}

/// The middle of what the event is about; `None` when it is about nothing.
fn aim(event: &Event) -> Option<Offset> {
    let repainted = event.changes.iter().filter_map(|change| match change {
        Change::Repaint(name, ..) => event.after.blocks.iter().find(|block| block.name == *name),
        _ => None,
    });
    let middles = repainted.map(|block| [block.centre[0], block.centre[1], 0.0]);
    let centres: Vec<Offset> = event.shows().iter().map(|placed| placed.centre()).chain(middles).collect();
    let mean = |axis: usize| centres.iter().map(|centre| centre[axis]).sum::<f64>() / centres.len() as f64;
    (!centres.is_empty()).then(|| [0, 1, 2].map(mean))
}

/// Whether someone can stand there: where people walk, in nothing and under no crown's leaves.
fn stands_free(scene: &Scene, world: &World, position: Offset) -> bool {
    let [west, east, south, north] = scene.walk;
    let [x, y] = {
        let (sin, cos) = scene.turn_rad.sin_cos();
        [position[0] * cos + position[1] * sin, position[1] * cos - position[0] * sin]
    };
    let is_walkable = (west..east).contains(&x) && (south..north).contains(&y);
    let plan = [position[0], position[1]];
    let is_out = |centre: Offset, half: [f64; 3]| {
        let share: f64 = (0..3).map(|i| ((position[i] - centre[i]) / (half[i] + 0.5)).powi(2)).sum();
        share > 1.0
    };
    is_walkable
        && world.blocks.iter().all(|block| block.name == "walls" || !block.covers(plan, 0.8))
        && world.crowns.iter().all(|crown| is_out(crown.centre, crown.half))
}

fn shows(scene: &Scene, world: &World, event: &Event, camera: &Camera) -> bool {
    let things = event.shows();
    let is_repainted = event.changes.iter().any(|change| matches!(change, Change::Repaint(..)));
    things.iter().all(|placed| placed.is_in_view(scene, camera))
        && things.iter().all(|placed| placed.seen(world, camera).is_some_and(|seen| seen.shown >= event.least_shown))
        && (!is_repainted || repainted_px(event, camera) >= REPAINTED_PX)
}

/// Pixels of a photo of a tenth of the size whose class changed.
fn repainted_px(event: &Event, camera: &Camera) -> usize {
    let small = camera.tenth();
    let [before, after] = [&event.before, &event.after].map(|world| picture(world, &small).labels());
    before.iter().zip(&after).filter(|(before, after)| before != after).count()
}
