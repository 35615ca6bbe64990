//! Poses, banners and objects, drawn so that a photo can show them.

use super::camera::{Camera, distance_m, dot, subtract};
use super::caster::{Thing, at, cast};
use super::random::Random;
use super::scene::Scene;
use super::world::{Block, Offset, Paint, Panel, World, class};

/// Width, depth and height of a pedestrian, metres.
pub const PEDESTRIAN_M: [f64; 3] = [0.5, 0.5, 1.7];
/// Width, depth and height of a chair, metres.
pub const CHAIR_M: [f64; 3] = [0.5, 0.5, 0.9];
/// Banners hang this far off their wall, metres.
const OFF_WALL_M: f64 = 0.04;
/// Everything that changes stays this far from the image's border, pixels.
pub const BORDER_PX: f64 = 12.0;

/// A pose at eye height that stands in nothing; half the time `None`, where it does.
pub fn pose(scene: &Scene, world: &World, random: &mut Random) -> Option<Camera> {
    let [west, east, south, north] = scene.walk;
    let own = [random.within(west, east), random.within(south, north)];
    let [x, y] = scene.east_north(own);
    let spread = scene.heading_spread_deg;
    let turned = random.within(-spread, spread);
    let axis_deg = if random.chance(0.5) { 90.0 } else { 270.0 } - scene.turn_rad.to_degrees();
    let pitch = random.within(scene.pitch_deg[0], scene.pitch_deg[1]);
    let attitude = [axis_deg + turned, pitch, random.normal()].map(f64::to_radians);
    let is_free = world.blocks.iter().all(|block| block.name == "walls" || !block.covers([x, y], 0.8));
    is_free.then(|| Camera::new([x, y, 1.6], attitude))
}

/// A banner that the camera sees whole, at a proper range and not too obliquely.
pub fn banner(scene: &Scene, world: &World, camera: &Camera, random: &mut Random) -> Option<Panel> {
    let limits = &scene.banner;
    let axes = camera.axes();
    for _ in 0..60 {
        let aim =
            [random.within(0.1, 0.9) * f64::from(camera.width), random.within(0.1, 0.9) * f64::from(camera.height)];
        let ray = camera.ray(&axes, aim[0], aim[1]);
        let hit = cast(world, camera.position, ray);
        let Thing::Block(index, wall @ 0..4) = hit.thing else { continue };
        let block = &world.blocks[index as usize];
        let Paint::Strip(_) = block.walls else { continue };
        let size = [limits.width_m, limits.height_m].map(|[low, high]| random.within(low, high));
        let aimed = at(camera.position, ray, hit.distance);
        let Some(panel) = panel_on(block, usize::from(wall), aimed, size, limits.between_m) else { continue };
        if is_well_seen(world, camera, &panel, limits.range_m) {
            return Some(panel);
        }
    }
    None
}

/// A panel on `wall` around `aimed`, moved to lie wholly on the wall; `None` when it does not fit.
pub fn panel_on(
    block: &Block,
    wall: usize,
    aimed: Offset,
    [wide, tall]: [f64; 2],
    between_m: [f64; 2],
) -> Option<Panel> {
    let is_inside = block.name == "walls";
    let out = block.normal(wall).map(|n| if is_inside { -n } else { n });
    // Right as seen by someone in front of the wall.
    let right = [-out[1], out[0]];
    let corner = {
        let corners = block.corners();
        if is_inside { corners[(wall + 1) % 4] } else { corners[wall] }
    };
    let along = (aimed[0] - corner[0]) * right[0] + (aimed[1] - corner[1]) * right[1];
    let (end, edge) = (block.wall_length_m(wall), if is_inside { 0.1 } else { 0.6 });
    let (low, high) = (block.bottom.max(between_m[0]), (block.top - edge).min(between_m[1]));
    if end < wide + 2.0 * edge || high < low + tall {
        return None;
    }
    let start = (along - wide / 2.0).clamp(edge, end - wide - edge);
    let base = (aimed[2] - tall / 2.0).clamp(low, high - tall);
    let point = |along: f64, up: f64| {
        [corner[0] + right[0] * along + out[0] * OFF_WALL_M, corner[1] + right[1] * along + out[1] * OFF_WALL_M, up]
    };
    let corners =
        [point(start, base), point(start + wide, base), point(start + wide, base + tall), point(start, base + tall)];
    Some(Panel { class: class::BANNER, corners })
}

/// Whole in the image, within range, seen at less than 65° from its normal, and hidden by nothing.
pub fn is_well_seen(world: &World, camera: &Camera, panel: &Panel, range_m: [f64; 2]) -> bool {
    let axes = camera.axes();
    let [a, b, c, d] = panel.corners;
    let centre = [0, 1, 2].map(|i| (a[i] + c[i]) / 2.0);
    let to_camera = subtract(camera.position, centre);
    let range = distance_m(camera.position, centre);
    let is_facing = dot(outward(panel), to_camera) > range * 65_f64.to_radians().cos();
    let is_in_range = (range_m[0]..range_m[1]).contains(&range);
    let is_held = |corner| camera.pixel(&axes, corner).is_some_and(|pixel| camera.holds(pixel, BORDER_PX));
    is_facing && is_in_range && panel.corners.into_iter().all(is_held) && {
        let mut with = world.clone();
        with.panels.push(panel.clone());
        let mine = Thing::Panel(with.panels.len() as u32 - 1);
        let spots = (0..=6).flat_map(|s| (0..=6).map(move |t| [f64::from(s) / 6.0, f64::from(t) / 6.0]));
        spots.into_iter().all(|[s, t]| {
            let (s, t) = (0.004 + 0.992 * s, 0.004 + 0.992 * t);
            let point = [0, 1, 2].map(|i| a[i] + s * (b[i] - a[i]) + t * (d[i] - a[i]));
            let hit = cast(&with, camera.position, subtract(point, camera.position));
            hit.thing == mine
        })
    }
}

/// Outward unit normal of a panel.
pub fn outward(panel: &Panel) -> Offset {
    let along = subtract(panel.corners[1], panel.corners[0]);
    let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
    [along[1] / length, -along[0] / length, 0.0]
}

/// Ground contact of an object that is wholly in the image and hidden by nothing.
pub fn standing(
    [near, far]: [f64; 2],
    world: &World,
    camera: &Camera,
    size_m: [f64; 3],
    random: &mut Random,
) -> Option<Offset> {
    for _ in 0..60 {
        let (range, off) = (random.within(near, far), random.within(-45_f64, 45.0).to_radians());
        let heading = camera.yaw_rad + off;
        let foot = [camera.position[0] + range * heading.sin(), camera.position[1] + range * heading.cos(), 0.0];
        if is_clear(world, camera, foot, size_m) {
            return Some(foot);
        }
    }
    None
}

/// Whether an object at `foot` stands in nothing.
pub fn stands_free(world: &World, foot: Offset) -> bool {
    world.blocks.iter().all(|block| {
        if block.name == "walls" {
            block.covers([foot[0], foot[1]], -0.4)
        } else {
            !block.covers([foot[0], foot[1]], 0.4)
        }
    })
}

/// Whether an object at `foot` stands in nothing, and is wholly in the image and hidden by nothing.
pub fn is_clear(world: &World, camera: &Camera, foot: Offset, size_m: [f64; 3]) -> bool {
    let axes = camera.axes();
    let object = Block::object(class::CHAIR, foot, size_m, 0.0);
    let points: Vec<Offset> =
        object.corners().into_iter().flat_map(|[x, y]| [[x, y, 0.02], [x, y, object.top]]).collect();
    stands_free(world, foot)
        && points.into_iter().all(|point| {
            let is_held = camera.pixel(&axes, point).is_some_and(|pixel| camera.holds(pixel, BORDER_PX));
            is_held && cast(world, camera.position, subtract(point, camera.position)).distance > 0.999
        })
}
