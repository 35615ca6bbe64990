//! What happens between the survey and the photo, placed where the photo can show it.

use super::camera::Camera;
use super::caster::{Thing, picture};
use super::kind::ChangeKind;
use super::placing::{CHAIR_M, PEDESTRIAN_M, banner, is_clear, pose, standing};
use super::random::Random;
use super::scene::Scene;
use super::world::{Block, Offset, Paint, Panel, World, class};
use super::{cut, hide, replace, together};
use anyhow::bail;

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
    /// Something the map knew that is now of another class, of another size or elsewhere.
    Replace {
        /// As the map knew it.
        before: Placed,
        /// As it is.
        after: Placed,
    },
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
    /// New things that the photo shows only in part.
    pub unmeasurable: Vec<Placed>,
    /// Known things that are still there and that the photo hardly shows.
    pub hidden: Vec<Placed>,
    /// What hides them.
    pub hiding: Vec<Block>,
    /// Share of what it is about that the photo shows at least.
    pub least_shown: f64,
}

/// Poses that are tried for a simple and for a hard kind of change.
const TRIES: usize = 400;
const HARD_TRIES: usize = 2000;
/// Share of a thing that a photo has to show.
const SHOWN: f64 = 0.9;

impl Event {
    fn new(world: &World, camera: Camera) -> Self {
        Self {
            camera,
            before: world.clone(),
            after: world.clone(),
            changes: Vec::new(),
            known: Vec::new(),
            unmeasurable: Vec::new(),
            hidden: Vec::new(),
            hiding: Vec::new(),
            least_shown: SHOWN,
        }
    }

    /// What the photo is about: the changes, else what it cuts, else what the map knew.
    pub fn shows(&self) -> Vec<&Placed> {
        let placed = self.changes.iter().filter_map(|change| match change {
            Change::Add(placed) | Change::Remove(placed) | Change::Replace { after: placed, .. } => Some(placed),
            Change::Repaint(..) => None,
        });
        let placed: Vec<&Placed> = placed.chain(&self.unmeasurable).collect();
        if placed.is_empty() && self.changes.is_empty() { self.known.iter().collect() } else { placed }
    }

    /// Something new in the photo.
    pub fn add(&mut self, placed: Placed) {
        placed.put(&mut self.after);
        self.changes.push(Change::Add(placed));
    }

    /// Something the map knew and the photo misses.
    pub fn remove(&mut self, placed: Placed) {
        placed.put(&mut self.before);
        self.known.push(placed.clone());
        self.changes.push(Change::Remove(placed));
    }

    /// Something the map knew that is another now.
    pub fn replace(&mut self, before: Placed, after: Placed) {
        before.put(&mut self.before);
        after.put(&mut self.after);
        self.known.push(before.clone());
        self.changes.push(Change::Replace { before, after });
    }

    /// Something the map knew that is still there.
    pub fn keep(&mut self, placed: Placed) {
        placed.put(&mut self.before);
        placed.put(&mut self.after);
        self.known.push(placed);
    }
}

/// A photo of `world` (the place as it is) with a change of this kind; fails when no pose shows one.
pub fn event(scene: &Scene, world: &World, kind: ChangeKind, random: &mut Random) -> anyhow::Result<Event> {
    let tries = if ChangeKind::HARD.contains(&kind) { HARD_TRIES } else { TRIES };
    for _ in 0..tries {
        let Some(camera) = pose(scene, world, random) else { continue };
        if let Some(event) = change(scene, world, kind, camera, random) {
            return Ok(event);
        }
    }
    bail!("no pose in scene {:?} shows a change of kind {:?} after {tries} tries", scene.name(), kind.name())
}

fn change(scene: &Scene, world: &World, kind: ChangeKind, camera: Camera, random: &mut Random) -> Option<Event> {
    let mut event = Event::new(world, camera);
    match kind {
        ChangeKind::None => {}
        ChangeKind::Banner => {
            event.add(Placed::Panel(banner(scene, world, &camera, random)?));
        }
        ChangeKind::BannerRemoved => {
            event.remove(Placed::Panel(banner(scene, world, &camera, random)?));
        }
        ChangeKind::Facade => repaint(&mut event, scene, &camera)?,
        ChangeKind::Pedestrian => {
            let foot = standing(scene.object_range_m, world, &camera, PEDESTRIAN_M, random)?;
            event.add(Placed::Object(class::PEDESTRIAN, foot));
        }
        ChangeKind::TwoChairs | ChangeKind::ChairRemoved => chairs(&mut event, scene, kind, random)?,
        ChangeKind::BannerReplaced => replace::banner_replaced(&mut event, scene, random)?,
        ChangeKind::BannerGrown => replace::banner_grown(&mut event, scene, random)?,
        ChangeKind::ChairMoved => replace::chair_moved(&mut event, scene, random)?,
        ChangeKind::Touching => together::touching(&mut event, scene, random)?,
        ChangeKind::Several => together::several(&mut event, scene, random)?,
        ChangeKind::Known => together::known(&mut event, scene, random)?,
        ChangeKind::CutByBorder => cut::object(&mut event, scene, random)?,
        ChangeKind::BannerCut => cut::banner(&mut event, scene, random)?,
        ChangeKind::Hidden => hide::hidden(&mut event, scene, random)?,
    }
    Some(event)
}

fn chairs(event: &mut Event, scene: &Scene, kind: ChangeKind, random: &mut Random) -> Option<()> {
    let first = standing(scene.object_range_m, &event.before, &event.camera, CHAIR_M, random)?;
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
    let seen = picture(&event.before, &camera.tenth());
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
