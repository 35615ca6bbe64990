//! What a photo has and the map has not: trees, vehicles, and walls that stand a little elsewhere.

use super::camera::distance_m;
use super::noise::NoiseLevel;
use super::random::Random;
use super::scene::Scene;
use super::world::{Block, Crown, Offset, World, class};

/// The world as it really is: the map's blocks moved and resized by what the map gets wrong.
pub fn real_world(scene: &Scene, noise: &NoiseLevel, random: &mut Random) -> World {
    let mut world = scene.world.clone();
    for block in &mut world.blocks {
        let mut moved = [0.0; 4];
        for (side, by) in moved.iter_mut().enumerate() {
            let is_joined = side < 2 && block.joined[side];
            *by = random.normal() * if is_joined { 0.0 } else { noise.shift_m };
        }
        let [west, east, south, north] = moved;
        let by = block.east_north_from_own([(west + east) / 2.0, (south + north) / 2.0]);
        block.centre = [block.centre[0] + by[0], block.centre[1] + by[1]];
        block.half = [block.half[0] + (east - west) / 2.0, block.half[1] + (north - south) / 2.0];
        if scene.outdoors && block.bottom == 0.0 {
            block.top += 2.0 * noise.shift_m * random.normal();
        }
    }
    world
}

/// Adds the trees and vehicles of a photo taken from `camera`.
pub fn add_clutter(world: &mut World, scene: &Scene, noise: &NoiseLevel, camera: Offset, random: &mut Random) {
    let [west, east, south, north] = scene.walk;
    let near = |random: &mut Random, kerb_m: f64| {
        let side = if random.chance(0.5) { south - 1.5 + kerb_m } else { north + 1.5 - kerb_m };
        let along = random.within(west - 20.0, east + 20.0);
        scene.east_north([along, side])
    };
    let is_clear = |[x, y]: [f64; 2], free_m: f64| distance_m([x, y, camera[2]], camera) > free_m;
    let mut trees = 0;
    while trees < noise.trees {
        let foot = near(random, 2.0);
        if is_clear(foot, 4.5) {
            tree(world, foot, random);
            trees += 1;
        }
    }
    let mut cars = 0;
    while cars < noise.cars {
        let foot = near(random, 3.2);
        if is_clear(foot, 5.0) {
            let size_m = [random.within(3.8, 5.2), random.within(1.7, 2.1), random.within(1.4, 2.4)];
            world.blocks.push(Block::object(class::OTHERS, [foot[0], foot[1], 0.0], size_m, scene.turn_rad));
            cars += 1;
        }
    }
}

fn tree(world: &mut World, [x, y]: [f64; 2], random: &mut Random) {
    let (radius, tall) = (random.within(1.0, 2.0), random.within(3.0, 5.0));
    world.blocks.push(Block::object(class::FOLIAGE, [x, y, 0.0], [0.3, 0.3, tall], 0.0));
    world.crowns.push(Crown { centre: [x, y, tall], half: [radius, radius, radius * 1.1] });
    for _ in 0..6 {
        let mut off = || random.within(-0.7, 0.7) * radius;
        let centre = [x + off(), y + off(), tall + off()];
        let half = radius * random.within(0.45, 0.8);
        world.crowns.push(Crown { centre, half: [half, half, half * 0.9] });
    }
}
