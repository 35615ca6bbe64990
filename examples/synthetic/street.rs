//! Street canyons: two rows of buildings along a straight street.

use super::facade::Style;
use super::random::Random;
use super::scene::{BannerLimits, Scene, SceneKind};
use super::world::{Block, Paint, World, class};

/// Measures of a street, metres.
struct Plan {
    origin: [f64; 3],
    half_length_m: f64,
    half_width_m: f64,
    widths_m: [f64; 2],
    heights_m: [f64; 2],
    setbacks_m: &'static [f64],
    gap_chance: f64,
    tower_chance: f64,
    is_uniform: bool,
}

fn plan(kind: SceneKind) -> Plan {
    let street = Plan {
        origin: [835_680.0, 817_640.0, 4.2],
        half_length_m: 150.0,
        half_width_m: 9.0,
        widths_m: [15.0, 40.0],
        heights_m: [22.0, 88.0],
        setbacks_m: &[0.0, 0.0, 0.0, 0.0, 0.8, 2.5],
        gap_chance: 0.3,
        tower_chance: 0.25,
        is_uniform: false,
    };
    match kind {
        SceneKind::Alley => Plan {
            origin: [835_910.0, 817_860.0, 5.1],
            half_length_m: 110.0,
            half_width_m: 2.5,
            widths_m: [9.0, 22.0],
            heights_m: [12.0, 45.0],
            setbacks_m: &[0.0, 0.0, 0.0, 0.6],
            ..street
        },
        SceneKind::Blocks => Plan {
            origin: [835_330.0, 818_450.0, 4.8],
            widths_m: [24.0, 24.0],
            heights_m: [45.0, 45.0],
            setbacks_m: &[0.0],
            gap_chance: 1.0,
            tower_chance: 0.0,
            is_uniform: true,
            ..street
        },
        _ => street,
    }
}

/// The street of a kind.
pub fn street(kind: SceneKind, random: &mut Random) -> Scene {
    let plan = plan(kind);
    let turn_rad = random.within(-12.0, 12.0).to_radians();
    let mut world = World { ground_half_m: 400.0, ..World::default() };
    for side in [-1.0, 1.0] {
        row(&mut world, &plan, side, random);
    }
    if plan.is_uniform {
        let style = Style { open: [true; 2], ..Style::draw(random, 24.0, 45.0) };
        let texture = style.texture(&world.blocks[0]);
        world.textures = vec![texture; world.blocks.len()];
    }
    let (sin, cos) = turn_rad.sin_cos();
    for block in &mut world.blocks {
        let [x, y] = block.centre;
        block.centre = [x * cos - y * sin, x * sin + y * cos];
        block.turn_rad = turn_rad;
    }
    let reach = plan.half_length_m - 35.0;
    let is_alley = kind == SceneKind::Alley;
    Scene {
        kind,
        origin: plan.origin,
        world,
        turn_rad,
        walk: [-reach, reach, 1.5 - plan.half_width_m, plan.half_width_m - 1.5],
        heading_spread_deg: if is_alley { 35.0 } else { 60.0 },
        pitch_deg: [0.0, 15.0],
        prior_sigma_m: 15.0,
        banner: BannerLimits {
            range_m: if is_alley { [4.0, 20.0] } else { [8.0, 30.0] },
            width_m: if is_alley { [2.0, 4.5] } else { [3.5, 8.0] },
            height_m: if is_alley { [1.5, 3.0] } else { [2.5, 5.0] },
            between_m: [5.4, 24.0],
        },
        object_range_m: [3.5, 14.0],
        outdoors: true,
    }
}

/// Buildings along one side, from west to east.
fn row(world: &mut World, plan: &Plan, side: f64, random: &mut Random) {
    let mut x = -plan.half_length_m;
    let mut joined_west = false;
    while x < plan.half_length_m {
        let width = random.within(plan.widths_m[0], plan.widths_m[1]);
        let height = random.within(plan.heights_m[0], plan.heights_m[1]);
        let depth = if plan.is_uniform { 24.0 } else { random.within(18.0, 30.0) };
        let setback = plan.setbacks_m[random.below(plan.setbacks_m.len())];
        let has_gap = random.chance(plan.gap_chance);
        let block = Block {
            name: format!("b{}", world.blocks.len()),
            centre: [x + width / 2.0, side * (plan.half_width_m + setback + depth / 2.0)],
            half: [width / 2.0, depth / 2.0],
            bottom: 0.0,
            top: height,
            turn_rad: 0.0,
            walls: Paint::Strip(world.textures.len()),
            lid: class::STONE,
            joined: [joined_west, !has_gap],
            mapped: true,
        };
        let style = Style::draw(random, width, height);
        if random.chance(plan.tower_chance) && height > 50.0 {
            tower(world, &block, &style);
        } else {
            world.textures.push(style.texture(&block));
            world.blocks.push(block);
        }
        joined_west = !has_gap;
        x += width + if has_gap { 3.0 } else { 0.0 };
    }
}

/// A podium of about 15 m with a tower that stands back from it on all sides.
fn tower(world: &mut World, block: &Block, style: &Style) {
    let podium = Block { top: 15.0, ..block.clone() };
    let tower = Block {
        name: format!("b{}", world.blocks.len() + 1),
        half: [block.half[0] - 2.5, block.half[1] - 3.5],
        bottom: 15.0,
        top: block.top,
        walls: Paint::Strip(world.textures.len() + 1),
        joined: [false; 2],
        ..block.clone()
    };
    let podium_style = Style { hoardings: Vec::new(), ..style.clone() };
    let tower_style = Style { shop_m: 0.0, open: [true; 2], ..podium_style.clone() };
    world.textures.push(podium_style.texture(&podium));
    world.textures.push(tower_style.texture(&tower));
    world.blocks.extend([podium, tower]);
}
