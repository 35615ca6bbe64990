//! A reading hall: windows and doors in the walls, shelves in rows, pillars, desks.

use super::random::Random;
use super::scene::{BannerLimits, Scene, SceneKind};
use super::world::{Block, Paint, Texture, World, class};

/// Length, width and height, metres.
const SIZE_M: [f64; 3] = [30.0, 18.0, 3.2];
/// Side of a texel, metres.
const TEXEL_M: f64 = 0.1;

/// The hall.
pub fn hall(random: &mut Random) -> Scene {
    let [length, width, height] = SIZE_M;
    let turn_rad = random.within(-30.0, 30.0).to_radians();
    let room = Block {
        name: "walls".to_owned(),
        centre: [0.0; 2],
        half: [length / 2.0, width / 2.0],
        bottom: 0.0,
        top: height,
        turn_rad: 0.0,
        walls: Paint::Strip(0),
        lid: class::OTHERS,
        joined: [false; 2],
        mapped: true,
    };
    let mut world = World { textures: vec![walls(random, &room)], ..World::default() };
    world.blocks.push(room);
    for index in 0..7 {
        let x = -10.0 + 3.2 * f64::from(index) + random.within(-0.2, 0.2);
        let (long, tall) = (random.within(3.6, 6.0), random.within(1.6, 2.3));
        let walls = if random.chance(0.3) { class::METAL } else { class::STONE };
        furniture(&mut world, &format!("shelf{index}"), [x, -4.6], [0.5, long, tall], walls);
    }
    for index in 0..4 {
        let x = -9.0 + 6.0 * f64::from(index);
        furniture(&mut world, &format!("pillar{index}"), [x, 2.4], [0.6, 0.6, height], class::STONE);
    }
    for index in 0..3 {
        let x = -8.0 + 7.0 * f64::from(index) + random.within(-0.8, 0.8);
        furniture(&mut world, &format!("desk{index}"), [x, 6.2], [2.4, 1.2, 0.75], class::METAL);
    }
    let (sin, cos) = turn_rad.sin_cos();
    for block in &mut world.blocks {
        let [x, y] = block.centre;
        block.centre = [x * cos - y * sin, x * sin + y * cos];
        block.turn_rad = turn_rad;
    }
    Scene {
        kind: SceneKind::Hall,
        origin: [836_690.0, 818_420.0, 7.2],
        world,
        turn_rad,
        walk: [-14.0, 14.0, -1.8, 8.0],
        heading_spread_deg: 180.0,
        pitch_deg: [-5.0, 5.0],
        prior_sigma_m: 5.0,
        banner: BannerLimits { range_m: [2.5, 14.0], width_m: [1.2, 2.4], height_m: [0.8, 1.5], between_m: [0.3, 3.0] },
        object_range_m: [2.0, 6.0],
        outdoors: false,
    }
}

fn furniture(world: &mut World, name: &str, [x, y]: [f64; 2], size_m: [f64; 3], walls: u8) {
    let block = Block::object(walls, [x, y, 0.0], size_m, 0.0);
    world.blocks.push(Block { name: name.to_owned(), mapped: true, joined: [false; 2], ..block });
}

/// Windows and metal doors at irregular places of stone walls, so that the four walls can be told apart.
fn walls(random: &mut Random, room: &Block) -> Texture {
    let around_m = 4.0 * (room.half[0] + room.half[1]);
    let mut openings: Vec<([f64; 4], u8)> = Vec::new();
    let mut at = 1.0;
    while at < around_m - 4.0 {
        let is_door = random.chance(0.2);
        let wide = if is_door { random.within(0.9, 1.8) } else { random.within(0.8, 3.2) };
        let (low, high) = if is_door { (0.0, 2.1) } else { (random.within(0.4, 1.1), random.within(1.9, 2.8)) };
        openings.push(([at, at + wide, low, high], if is_door { class::METAL } else { class::GLASS }));
        at += wide + random.within(0.6, 3.4);
    }
    let (width, height) = ((around_m / TEXEL_M).round() as usize, (SIZE_M[2] / TEXEL_M).round() as usize);
    let mut labels = Vec::with_capacity(width * height);
    for row in (0..height).rev() {
        for column in 0..width {
            let (along_m, up_m) = ((column as f64 + 0.5) * TEXEL_M, (row as f64 + 0.5) * TEXEL_M);
            let holds = |&&([start, end, low, high], _): &&([f64; 4], u8)| {
                (start..end).contains(&along_m) && (low..high).contains(&up_m)
            };
            labels.push(openings.iter().find(holds).map_or(class::STONE, |&(_, class)| class));
        }
    }
    Texture { width, height, labels }
}
