//! What happens between the survey and the photo, placed where the photo can show it.

use super::camera::{Camera, distance_m, dot, subtract};
use super::caster::{Thing, at, cast, picture};
use super::random::Random;
use super::scene::Scene;
use super::world::{Block, Offset, Paint, Panel, World, class};
use anyhow::bail;

/// The kinds of change; the paper's six places are all among them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeKind {
    /// Nothing.
    None,
    /// A banner is hung on a wall.
    Banner,
    /// A banner the map knew is gone.
    BannerRemoved,
    /// The stone or metal of a whole building becomes glass: more than one captured rectangle, so not to be placed.
    Facade,
    /// A pedestrian stands there.
    Pedestrian,
    /// Two chairs stand there.
    TwoChairs,
    /// One of two chairs the map knew is gone.
    ChairRemoved,
}

impl ChangeKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::Banner,
        Self::BannerRemoved,
        Self::Facade,
        Self::Pedestrian,
        Self::TwoChairs,
        Self::ChairRemoved,
    ];

    /// Name in `truth.json` and in paths.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Banner => "banner",
            Self::BannerRemoved => "banner_removed",
            Self::Facade => "facade",
            Self::Pedestrian => "pedestrian",
            Self::TwoChairs => "two_chairs",
            Self::ChairRemoved => "chair_removed",
        }
    }

    /// The kinds that suit a scene.
    pub fn of(scene: &Scene) -> Vec<Self> {
        let outdoors = [Self::Banner, Self::None, Self::Pedestrian, Self::BannerRemoved, Self::Facade];
        let indoors = [Self::TwoChairs, Self::ChairRemoved, Self::Banner, Self::None];
        if scene.outdoors { outdoors.to_vec() } else { indoors.to_vec() }
    }
}

impl std::str::FromStr for ChangeKind {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match Self::ALL.into_iter().find(|kind| kind.name() == name) {
            Some(kind) => Ok(kind),
            None => bail!("unknown change {name:?}: expected one of {}", Self::ALL.map(Self::name).join(", ")),
        }
    }
}

/// A descriptor in the scene's frame.
#[derive(Clone, Debug, PartialEq)]
pub enum Placed {
    /// A rectangle on a wall.
    Panel(Panel),
    /// Class and ground contact of an object.
    Object(u8, Offset),
}

/// One true change.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Something new.
    Add(Placed),
    /// Something gone.
    Remove(Placed),
    /// A block whose walls turned from one class into another.
    Repaint(String, u8, u8),
}

/// Before and after, without clutter, and what the map knew.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The camera that took the photo.
    pub camera: Camera,
    /// The place as the survey saw it.
    pub before: World,
    /// The place as the photo sees it.
    pub after: World,
    /// What changed.
    pub changes: Vec<Change>,
    /// Descriptors that the map has from before.
    pub known: Vec<Placed>,
}

/// Sizes of the default class table, metres.
const PEDESTRIAN_M: [f64; 3] = [0.5, 0.5, 1.7];
const CHAIR_M: [f64; 3] = [0.5, 0.5, 0.9];
/// Banners hang this far off their wall, metres.
const OFF_WALL_M: f64 = 0.04;
/// Everything that changes stays this far from the image's border, pixels.
const BORDER_PX: f64 = 12.0;

/// A photo of `world` (the place as it is) with a change of this kind; fails when no pose shows one.
pub fn event(scene: &Scene, world: &World, kind: ChangeKind, random: &mut Random) -> anyhow::Result<Event> {
    for _ in 0..400 {
        let Some(camera) = pose(scene, world, random) else { continue };
        if let Some(event) = change(scene, world, kind, camera, random) {
            return Ok(event);
        }
    }
    bail!("no pose in scene {:?} shows a change of kind {:?} after 400 tries", scene.name(), kind.name())
}

/// A pose at eye height that stands in nothing; half the time `None`, where it does.
fn pose(scene: &Scene, world: &World, random: &mut Random) -> Option<Camera> {
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

fn change(scene: &Scene, world: &World, kind: ChangeKind, camera: Camera, random: &mut Random) -> Option<Event> {
    let mut event =
        Event { camera, before: world.clone(), after: world.clone(), changes: Vec::new(), known: Vec::new() };
    match kind {
        ChangeKind::None => {}
        ChangeKind::Banner => {
            let panel = banner(scene, world, &camera, random)?;
            event.after.panels.push(panel.clone());
            event.changes.push(Change::Add(Placed::Panel(panel)));
        }
        ChangeKind::BannerRemoved => {
            let panel = banner(scene, world, &camera, random)?;
            event.before.panels.push(panel.clone());
            event.known.push(Placed::Panel(panel.clone()));
            event.changes.push(Change::Remove(Placed::Panel(panel)));
        }
        ChangeKind::Facade => repaint(&mut event, scene, &camera)?,
        ChangeKind::Pedestrian => {
            let foot = standing(scene, world, &camera, PEDESTRIAN_M, random)?;
            event.after.blocks.push(Block::object(class::PEDESTRIAN, foot, PEDESTRIAN_M, 0.0));
            event.changes.push(Change::Add(Placed::Object(class::PEDESTRIAN, foot)));
        }
        ChangeKind::TwoChairs | ChangeKind::ChairRemoved => chairs(&mut event, scene, kind, random)?,
    }
    Some(event)
}

/// A banner that the camera sees whole, at a proper range and not too obliquely.
fn banner(scene: &Scene, world: &World, camera: &Camera, random: &mut Random) -> Option<Panel> {
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
fn panel_on(block: &Block, wall: usize, aimed: Offset, [wide, tall]: [f64; 2], between_m: [f64; 2]) -> Option<Panel> {
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
fn is_well_seen(world: &World, camera: &Camera, panel: &Panel, range_m: [f64; 2]) -> bool {
    let axes = camera.axes();
    let [a, b, c, d] = panel.corners;
    let centre = [0, 1, 2].map(|i| (a[i] + c[i]) / 2.0);
    let to_camera = subtract(camera.position, centre);
    let normal = {
        let along = subtract(b, a);
        let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
        [along[1] / length, -along[0] / length, 0.0]
    };
    let range = distance_m(camera.position, centre);
    let is_facing = dot(normal, to_camera) > range * 65_f64.to_radians().cos();
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

/// Ground contact of an object that is wholly in the image and hidden by nothing.
fn standing(scene: &Scene, world: &World, camera: &Camera, size_m: [f64; 3], random: &mut Random) -> Option<Offset> {
    let [near, far] = scene.object_range_m;
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

/// Whether an object at `foot` stands in nothing, and is wholly in the image and hidden by nothing.
fn is_clear(world: &World, camera: &Camera, foot: Offset, size_m: [f64; 3]) -> bool {
    let axes = camera.axes();
    let object = Block::object(class::CHAIR, foot, size_m, 0.0);
    let stands_free = world.blocks.iter().all(|block| {
        if block.name == "walls" {
            block.covers([foot[0], foot[1]], -0.4)
        } else {
            !block.covers([foot[0], foot[1]], 0.4)
        }
    });
    let points: Vec<Offset> =
        object.corners().into_iter().flat_map(|[x, y]| [[x, y, 0.02], [x, y, object.top]]).collect();
    stands_free
        && points.into_iter().all(|point| {
            let is_held = camera.pixel(&axes, point).is_some_and(|pixel| camera.holds(pixel, BORDER_PX));
            is_held && cast(world, camera.position, subtract(point, camera.position)).distance > 0.999
        })
}

fn chairs(event: &mut Event, scene: &Scene, kind: ChangeKind, random: &mut Random) -> Option<()> {
    let first = standing(scene, &event.before, &event.camera, CHAIR_M, random)?;
    let away = random.within(0.0, std::f64::consts::TAU);
    let apart = random.within(1.0, 1.4);
    let second = [first[0] + apart * away.cos(), first[1] + apart * away.sin(), 0.0];
    let mut with_first = event.before.clone();
    with_first.blocks.push(Block::object(class::CHAIR, first, CHAIR_M, 0.0));
    if !is_clear(&with_first, &event.camera, second, CHAIR_M) {
        return None;
    }
    let chair = |foot| Block::object(class::CHAIR, foot, CHAIR_M, 0.0);
    let placed = |foot| Placed::Object(class::CHAIR, foot);
    event.after.blocks.push(chair(second));
    if kind == ChangeKind::TwoChairs {
        event.after.blocks.push(chair(first));
        event.changes.extend([Change::Add(placed(first)), Change::Add(placed(second))]);
    } else {
        event.before.blocks.extend([chair(first), chair(second)]);
        event.known.extend([placed(first), placed(second)]);
        event.changes.push(Change::Remove(placed(first)));
    }
    Some(())
}

/// Turns the wall class of the building that fills most of the photo into glass, above the shops.
fn repaint(event: &mut Event, scene: &Scene, camera: &Camera) -> Option<()> {
    let small = Camera { width: 96, height: 72, focal_px: camera.focal_px / 10.0, ..*camera };
    let seen = picture(&event.before, &small);
    let mut counts = vec![0_u32; event.before.blocks.len()];
    for hit in &seen.hits {
        if let Thing::Block(index, _) = hit.thing {
            let is_wall = matches!(hit.class, class::STONE | class::METAL) && hit.distance < 40.0;
            counts[index as usize] += u32::from(is_wall);
        }
    }
    let (index, &count) = counts.iter().enumerate().max_by_key(|&(_, &count)| count)?;
    let Paint::Strip(texture) = event.before.blocks[index].walls else { return None };
    if !(140..900).contains(&count) {
        return None;
    }
    let labels = &mut event.after.textures[texture];
    let above_shops = labels.height - ((6.0 / 0.2) as usize).min(labels.height);
    let upper = &mut labels.labels[..above_shops * labels.width];
    let stone = upper.iter().filter(|&&label| label == class::STONE).count();
    let metal = upper.iter().filter(|&&label| label == class::METAL).count();
    let from = if stone > metal { class::STONE } else { class::METAL };
    for label in upper {
        if *label == from {
            *label = class::GLASS;
        }
    }
    let name = scene.world.blocks[index].name.clone();
    event.changes.push(Change::Repaint(name, from, class::GLASS));
    Some(())
}
