//! Known things that are still there behind something else: a hidden object is not a removed one.

use super::camera::subtract;
use super::change::{Event, Placed};
use super::random::Random;
use super::replace::{chair, lone_banner};
use super::scene::Scene;
use super::world::{Block, World, class};

/// The photo shows at most this share of what is hidden.
const MOST_SHOWN: f64 = 0.1;
/// Least distance of the box from the camera, metres.
const NEAREST_M: f64 = 1.5;
/// The box is at least this high, metres: it rises above the horizon of a camera at 1.6 m, for what hides only ground of
/// its own class looks the same as a thing that is gone.
const LOWEST_M: f64 = 1.9;
/// Greatest width and height of the box outdoors (a lorry) and indoors (a trolley), metres.
const LORRY_M: [f64; 2] = [7.0, 4.4];
const TROLLEY_M: [f64; 2] = [3.0, 2.6];
const TRIES: usize = 20;

/// A banner or a chair that the map knew, and a box that stands before it.
pub fn hidden(event: &mut Event, scene: &Scene, random: &mut Random) -> Option<()> {
    let placed = if random.chance(0.5) {
        Placed::Panel(lone_banner(scene, &event.after, &event.camera, random)?)
    } else {
        Placed::Object(class::CHAIR, chair(scene, &event.after, &event.camera, random)?)
    };
    for _ in 0..TRIES {
        let Some(hiding) = before(event, scene, &placed, random) else { continue };
        let mut world = event.after.clone();
        placed.put(&mut world);
        world.blocks.push(hiding.clone());
        if placed.seen(&world, &event.camera).is_some_and(|seen| seen.shown <= MOST_SHOWN) {
            event.keep(placed.clone());
            event.hidden.push(placed);
            event.hiding.push(hiding);
            return Some(());
        }
    }
    None
}

/// A box somewhere on the way to `placed`, just wide and high enough; `None` where none can stand.
fn before(event: &Event, scene: &Scene, placed: &Placed, random: &mut Random) -> Option<Block> {
    let camera = event.camera.position;
    let [x, y, _] = subtract(placed.centre(), camera);
    let toward = [x / x.hypot(y), y / x.hypot(y)];
    let along = |[x, y]: [f64; 2]| x * toward[0] + y * toward[1];
    let offsets: Vec<[f64; 3]> = placed.points().into_iter().map(|point| subtract(point, camera)).collect();
    let nearest = offsets.iter().map(|&[x, y, _]| along([x, y])).fold(f64::INFINITY, f64::min);
    let slopes = |slope: &dyn Fn(&[f64; 3]) -> f64| {
        let all = offsets.iter().map(|offset| slope(offset) / along([offset[0], offset[1]]));
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], slope| [low.min(slope), high.max(slope)])
    };
    let [left, right] = slopes(&|&[x, y, _]| x * toward[1] - y * toward[0]);
    let [_, up] = slopes(&|&[_, _, up]| up);
    let front = nearest * random.within(0.2, 0.8);
    let depth = if scene.outdoors { random.within(1.0, 2.2) } else { random.within(0.4, 0.8) };
    let mut margin = || random.within(-0.04, 0.25);
    let width = ((right - left) * front + margin() + margin()).max(0.8);
    let tall = (camera[2] + up * front + margin()).max(LOWEST_M + margin());
    let [widest, tallest] = if scene.outdoors { LORRY_M } else { TROLLEY_M };
    if front < NEAREST_M || front + depth > nearest - 0.3 || width > widest || tall > tallest {
        return None;
    }
    let (middle, deep) = ((left + right) / 2.0 * front, front + depth / 2.0);
    let foot =
        [camera[0] + toward[0] * deep + toward[1] * middle, camera[1] + toward[1] * deep - toward[0] * middle, 0.0];
    let block = Block::object(class::OTHERS, foot, [width, depth, tall], (-toward[0]).atan2(toward[1]));
    stands_free(&event.after, &block).then_some(block)
}

/// Whether a box stands in no block.
fn stands_free(world: &World, own: &Block) -> bool {
    let corners = own.corners();
    let between = |a: [f64; 2], b: [f64; 2]| [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0];
    let middles = (0..4).map(|i| between(corners[i], corners[(i + 1) % 4]));
    corners.into_iter().chain(middles).chain([own.centre]).all(|point| {
        world
            .blocks
            .iter()
            .all(|block| if block.name == "walls" { block.covers(point, -0.1) } else { !block.covers(point, 0.1) })
    })
}
