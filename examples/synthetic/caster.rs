//! The photo: one ray a pixel against every thing of the world, in f64. Slow, short, and independent of the product's
//! renderer on purpose.

use super::camera::{Camera, cross, dot, subtract};
use super::world::{Block, Crown, Offset, Paint, Panel, Texture, World, class};
use rayon::prelude::*;

/// What a ray hits first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in units of the direction's length.
    pub distance: f64,
    /// Class there.
    pub class: u8,
    /// The thing that was hit.
    pub thing: Thing,
}

/// A thing of the world, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thing {
    /// Nothing.
    Sky,
    /// The ground.
    Ground,
    /// A block and its wall 0–3; 4 for top and bottom.
    Block(u32, u8),
    /// A panel.
    Panel(u32),
    /// A crown.
    Crown(u32),
}

/// Hits over an image, row-major, top-left first.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// One a pixel.
    pub hits: Vec<Hit>,
}

impl Picture {
    /// Class a pixel.
    pub fn labels(&self) -> Vec<u8> {
        self.hits.iter().map(|hit| hit.class).collect()
    }
}

/// Hits nearer than this are the surface the ray starts from.
const NEAREST: f64 = 1e-6;

/// The world as the camera sees it.
pub fn picture(world: &World, camera: &Camera) -> Picture {
    let axes = camera.axes();
    let rows: Vec<Vec<Hit>> = (0..camera.height)
        .into_par_iter()
        .map(|v| {
            let pixel = |u: u32| camera.ray(&axes, f64::from(u) + 0.5, f64::from(v) + 0.5);
            (0..camera.width).map(|u| cast(world, camera.position, pixel(u))).collect()
        })
        .collect();
    Picture { width: camera.width, height: camera.height, hits: rows.concat() }
}

/// The first thing from `origin` along `direction`.
pub fn cast(world: &World, origin: Offset, direction: Offset) -> Hit {
    let mut best = Hit { distance: f64::INFINITY, class: class::SKY, thing: Thing::Sky };
    let mut offer = |found: Option<(f64, u8)>, thing: Thing| {
        if let Some((distance, class)) = found.filter(|&(distance, _)| distance < best.distance) {
            best = Hit { distance, class, thing };
        }
    };
    offer(ground(world.ground_half_m, origin, direction).map(|t| (t, class::OTHERS)), Thing::Ground);
    for (index, block) in world.blocks.iter().enumerate() {
        if let Some((distance, wall)) = block_hit(block, origin, direction) {
            let class = block_class(block, &world.textures, wall, at(origin, direction, distance));
            offer(Some((distance, class)), Thing::Block(index as u32, wall as u8));
        }
    }
    for (index, panel) in world.panels.iter().enumerate() {
        offer(panel_hit(panel, origin, direction).map(|t| (t, panel.class)), Thing::Panel(index as u32));
    }
    for (index, crown) in world.crowns.iter().enumerate() {
        offer(crown_hit(crown, origin, direction).map(|t| (t, class::FOLIAGE)), Thing::Crown(index as u32));
    }
    best
}

/// The point at `distance` along a ray.
pub fn at(origin: Offset, direction: Offset, distance: f64) -> Offset {
    [0, 1, 2].map(|i| origin[i] + distance * direction[i])
}

fn ground(half_m: f64, origin: Offset, direction: Offset) -> Option<f64> {
    let distance = -origin[2] / direction[2];
    let point = at(origin, direction, distance);
    (distance > NEAREST && point[0].abs() <= half_m && point[1].abs() <= half_m).then_some(distance)
}

/// Distance and wall (4 for top and bottom). From inside, the far side is what is seen.
fn block_hit(block: &Block, origin: Offset, direction: Offset) -> Option<(f64, usize)> {
    let [ox, oy] = block.own_from_east_north([origin[0] - block.centre[0], origin[1] - block.centre[1]]);
    let [dx, dy] = block.own_from_east_north([direction[0], direction[1]]);
    let slabs = [
        (ox, dx, -block.half[0], block.half[0], 3, 1),
        (oy, dy, -block.half[1], block.half[1], 0, 2),
        (origin[2], direction[2], block.bottom, block.top, 4, 4),
    ];
    let (mut enter, mut leave) = ((f64::NEG_INFINITY, 4), (f64::INFINITY, 4));
    for (start, step, low, high, low_wall, high_wall) in slabs {
        let (to_low, to_high) = ((low - start) / step, (high - start) / step);
        // A ray along a slab gives 0/0 only on its very edge; it then misses.
        let (near, far) = if step >= 0.0 {
            ((to_low, low_wall), (to_high, high_wall))
        } else {
            ((to_high, high_wall), (to_low, low_wall))
        };
        if near.0 > enter.0 {
            enter = near;
        }
        if far.0 < leave.0 {
            leave = far;
        }
    }
    if enter.0 > leave.0 {
        return None;
    }
    [enter, leave].into_iter().find(|hit| hit.0 > NEAREST && hit.0.is_finite())
}

fn block_class(block: &Block, textures: &[Texture], wall: usize, point: Offset) -> u8 {
    match block.walls {
        _ if wall == 4 => block.lid,
        Paint::Class(class) => class,
        Paint::Strip(texture) => {
            let [x, y] = block.own_from_east_north([point[0] - block.centre[0], point[1] - block.centre[1]]);
            let [half_x, half_y] = block.half;
            let along_m = [x + half_x, y + half_y, half_x - x, half_y - y][wall];
            let share = along_m / block.wall_length_m(wall);
            let u = block.strip_start(wall) * (1.0 - share) + block.strip_start(wall + 1) * share;
            textures[texture].at(u, (point[2] - block.bottom) / (block.top - block.bottom))
        }
    }
}

fn panel_hit(panel: &Panel, origin: Offset, direction: Offset) -> Option<f64> {
    let [corner, right, _, up] = panel.corners;
    let (along, upward) = (subtract(right, corner), subtract(up, corner));
    let normal = cross(along, upward);
    let distance = dot(subtract(corner, origin), normal) / dot(direction, normal);
    let offset = subtract(at(origin, direction, distance), corner);
    let (s, t) = (dot(offset, along) / dot(along, along), dot(offset, upward) / dot(upward, upward));
    (distance > NEAREST && (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)).then_some(distance)
}

fn crown_hit(crown: &Crown, origin: Offset, direction: Offset) -> Option<f64> {
    let o = [0, 1, 2].map(|i| (origin[i] - crown.centre[i]) / crown.half[i]);
    let d = [0, 1, 2].map(|i| direction[i] / crown.half[i]);
    let (a, b, c) = (dot(d, d), dot(o, d), dot(o, o) - 1.0);
    let root = (b * b - a * c).sqrt();
    [(-b - root) / a, (-b + root) / a].into_iter().find(|&distance| distance > NEAREST)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tower(turn_rad: f64) -> World {
        let tower =
            Block { mapped: true, turn_rad, ..Block::object(class::STONE, [0.0, 20.0, 0.0], [10.0, 4.0, 30.0], 0.0) };
        World { blocks: vec![tower], ground_half_m: 100.0, ..World::default() }
    }

    #[test]
    fn a_wall_ahead_is_hit_at_its_distance() {
        let hit = cast(&tower(0.0), [0.0, 0.0, 1.6], [0.0, 1.0, 0.0]);
        assert!((hit.distance - 18.0).abs() < 1e-12);
        assert_eq!((hit.class, hit.thing), (class::STONE, Thing::Block(0, 0)));
    }

    #[test]
    fn a_block_turned_by_a_quarter_shows_its_narrow_side() {
        let hit = cast(&tower(90_f64.to_radians()), [0.0, 0.0, 1.6], [0.0, 1.0, 0.0]);
        assert!((hit.distance - 15.0).abs() < 1e-9);
    }

    #[test]
    fn the_ground_is_hit_at_height_over_slope_and_ends_at_its_edge() {
        let hit = cast(&tower(0.0), [0.0, 0.0, 1.6], [1.0, 0.0, -0.1]);
        assert!((hit.distance - 16.0).abs() < 1e-9);
        assert_eq!(hit.class, class::OTHERS);
        assert_eq!(cast(&tower(0.0), [0.0, 0.0, 1.6], [1.0, 0.0, -0.01]).class, class::SKY);
    }

    #[test]
    fn from_inside_a_block_its_far_wall_is_seen() {
        let hit = cast(&tower(0.0), [0.0, 20.0, 1.6], [1.0, 0.0, 0.0]);
        assert!((hit.distance - 5.0).abs() < 1e-12);
        assert_eq!(hit.thing, Thing::Block(0, 1));
    }

    #[test]
    fn a_texel_is_seen_where_its_strip_puts_it() {
        // Strip of 28 texels around 28 m of wall: one a metre; the south wall holds columns 0–9 from west to east.
        let mut world = tower(0.0);
        let labels = (0..28 * 30).map(|i| if i % 28 == 7 { class::GLASS } else { class::STONE }).collect();
        world.textures.push(Texture { width: 28, height: 30, labels });
        world.blocks[0].walls = Paint::Strip(0);
        let seen = |x: f64| cast(&world, [x, 0.0, 1.6], [0.0, 1.0, 0.0]).class;
        assert_eq!([seen(1.99), seen(2.01), seen(2.99), seen(3.01)], [0, 1, 1, 0]);
    }

    #[test]
    fn a_panel_hides_the_wall_behind_it_only_within_its_edges() {
        let mut world = tower(0.0);
        let corners = [[-1.0, 17.9, 2.0], [1.0, 17.9, 2.0], [1.0, 17.9, 4.0], [-1.0, 17.9, 4.0]];
        world.panels.push(Panel { class: class::BANNER, corners });
        let seen = |z: f64| cast(&world, [0.0, 0.0, z], [0.0, 1.0, 0.0]).class;
        assert_eq!([seen(1.99), seen(2.01), seen(3.99), seen(4.01)], [0, 3, 3, 0]);
    }

    #[test]
    fn a_crown_is_hit_on_its_near_side() {
        let world =
            World { crowns: vec![Crown { centre: [0.0, 10.0, 0.0], half: [1.0, 2.0, 3.0] }], ..World::default() };
        assert!((cast(&world, [0.0; 3], [0.0, 1.0, 0.0]).distance - 8.0).abs() < 1e-12);
    }
}
