//! What happens between the survey and the photo, placed where the photo can show it.

use super::camera::Camera;
use super::caster::{Thing, picture};
use super::kind::ChangeKind;
use super::placing::{CHAIR_M, PEDESTRIAN_M, banner, is_clear, pose, standing};
use super::random::Random;
use super::scene::Scene;
use super::world::{Block, Offset, Paint, Panel, World, class};
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

/// Share of a thing that a photo has to show.
const SHOWN: f64 = 0.9;

impl Event {
    /// What the photo is about, each with the share that it has to show at least.
    pub fn shows(&self) -> Vec<(&Placed, f64)> {
        let placed = self.changes.iter().filter_map(|change| match change {
            Change::Add(placed) | Change::Remove(placed) => Some((placed, SHOWN)),
            Change::Repaint(..) => None,
        });
        placed.collect()
    }
}

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
