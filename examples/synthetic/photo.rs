//! A photo of a changed place: what the phone sends, and what it should lead to.

use super::camera::Camera;
use super::capture::CaseSpec;
use super::caster::{Picture, picture};
use super::change::{Change, Event, Placed, event};
use super::clutter::{add_clutter, real_world};
use super::kind::ChangeKind;
use super::noise::disturb;
use super::prior::{PriorError, stated_yaw_sigma_deg};
use super::random::Random;
use super::scene::Scene;
use super::second::second_camera;
use super::seen::Seen;
use super::truth::{Truth, attitude_deg, round, truth};
use super::world::World;
use resurvey_schema::capture::FORMAT;
use resurvey_schema::{CameraFile, CaptureFile, PriorFile};

/// Draws of trees and vehicles before a photo goes without them.
const CLUTTER_TRIES: usize = 40;

/// One photo with its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// `capture.json`.
    pub capture: CaptureFile,
    /// Class a pixel, top row first.
    pub labels: Vec<u8>,
    /// Columns of the labels.
    pub width: usize,
    /// What really was.
    pub truth: Truth,
}

/// Which photo of a place it is: each has its own errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shot {
    /// The one that the place was changed for.
    First,
    /// The one from another pose, an hour later.
    Second,
}

impl Shot {
    /// The stream of random numbers of one purpose.
    fn purpose(self, name: &str) -> String {
        match self {
            Self::First => name.to_owned(),
            Self::Second => format!("second {name}"),
        }
    }

    fn hour(self) -> u32 {
        match self {
            Self::First => 10,
            Self::Second => 11,
        }
    }
}

/// A place after its change, with all that a photo of it can show.
#[derive(Clone, Debug)]
pub struct Place<'a> {
    /// The mapped place.
    pub scene: &'a Scene,
    /// What changed, and the camera.
    pub event: Event,
    spec: CaseSpec,
    cluttered: World,
}

impl<'a> Place<'a> {
    /// The place that follows from `spec`, as its first photo sees it.
    pub fn new(scene: &'a Scene, spec: &CaseSpec) -> anyhow::Result<Self> {
        let noise = &spec.noise;
        let real = real_world(scene, noise, &mut random(scene, spec, "map errors"));
        let event = event(scene, &real, spec.change, &mut random(scene, spec, "change"))?;
        let cluttered = cluttered(scene, spec, &event);
        Ok(Self { scene, event, spec: spec.clone(), cluttered })
    }

    /// The same place as a second photo sees it, whole things that the first one cuts; `None` when no pose near by shows the change.
    pub fn seen_again(&self) -> Option<Self> {
        let mut random = random(self.scene, &self.spec, "second pose");
        let camera = second_camera(self.scene, &self.cluttered, &self.event, &mut random)?;
        let mut event = Event { camera, ..self.event.clone() };
        event.changes.extend(event.unmeasurable.drain(..).map(Change::Add));
        Some(Self { event, ..self.clone() })
    }

    /// The photo from the camera of the event.
    pub fn photo(&self, shot: Shot) -> anyhow::Result<Photo> {
        let Self { scene, event, spec, cluttered } = self;
        let camera = &event.camera;
        let before = picture(&event.before, camera);
        let after = again(&event.after, &event.before, &before, camera);
        let photo = again(cluttered, &event.after, &after, camera);
        let changed: Vec<usize> =
            (0..photo.hits.len()).filter(|&i| before.hits[i].class != after.hits[i].class).collect();
        let visible = changed.iter().filter(|&&i| photo.hits[i].thing == after.hits[i].thing).count();
        let width = photo.width as usize;
        let labels = disturb(&photo.labels(), width, &spec.noise, &mut random(scene, spec, &shot.purpose("labels")));
        let error = PriorError::draw(scene, &spec.noise, &mut random(scene, spec, &shot.purpose("prior")));
        let truth = truth(scene, spec, event, &error, [changed.len(), visible], &labels, |placed| {
            placed.seen(cluttered, camera).unwrap_or(Seen::NOTHING)
        });
        Ok(Photo { capture: capture(scene, spec, camera, &error, shot)?, labels, width, truth })
    }
}

/// The place with trees and vehicles. Those of a hard kind do not stand before what the photo is about.
fn cluttered(scene: &Scene, spec: &CaseSpec, event: &Event) -> World {
    let mut plain = event.after.clone();
    plain.blocks.extend(event.hiding.iter().cloned());
    if !scene.outdoors {
        return plain;
    }
    let mut random = random(scene, spec, "clutter");
    let mut draw = || {
        let mut world = plain.clone();
        add_clutter(&mut world, scene, &spec.noise, event.camera.position, &mut random);
        world
    };
    let first = draw();
    if !ChangeKind::HARD.contains(&spec.change) {
        return first;
    }
    let shown = |placed: &Placed, world: &World| placed.seen(world, &event.camera).map_or(0.0, |seen| seen.shown);
    let things = event.shows();
    let is_good =
        |world: &World| things.iter().all(|placed| shown(placed, world) >= event.least_shown * shown(placed, &plain));
    std::iter::once(first).chain((0..CLUTTER_TRIES).map(|_| draw())).find(is_good).unwrap_or(plain)
}

fn random(scene: &Scene, spec: &CaseSpec, purpose: &str) -> Random {
    Random::new(spec.seed, &format!("{} {purpose}", scene.name()))
}

/// The picture of `world`, which is `seen` when `world` is the `known` one.
fn again(world: &World, known: &World, seen: &Picture, camera: &Camera) -> Picture {
    if world == known { seen.clone() } else { picture(world, camera) }
}

fn capture(
    scene: &Scene,
    spec: &CaseSpec,
    camera: &Camera,
    error: &PriorError,
    shot: Shot,
) -> anyhow::Result<CaptureFile> {
    let [easting, northing, height] = [0, 1, 2].map(|i| scene.origin[i] + camera.position[i] + error.offset_m[i]);
    let wgs84 = if spec.grid_prior { None } else { Some(super::suite::wgs84([easting, northing, height])?) };
    let [yaw, pitch, roll] = attitude_deg(camera);
    Ok(CaptureFile {
        format: FORMAT.to_owned(),
        labels: Some("labels.png".to_owned()),
        taken_at: Some(format!("2026-06-01T{}:{:02}:00+08:00", shot.hour(), spec.seed % 60)),
        camera: CameraFile {
            model: "pinhole".to_owned(),
            width: camera.width,
            height: camera.height,
            fx: Some(camera.focal_px),
            fy: Some(camera.focal_px),
            cx: Some(f64::from(camera.width) / 2.0),
            cy: Some(f64::from(camera.height) / 2.0),
            distortion: None,
            diagonal_fov_deg: None,
        },
        prior: PriorFile {
            latitude: wgs84.map(|[latitude, _]| round(latitude, 9)),
            longitude: wgs84.map(|[_, longitude]| round(longitude, 9)),
            easting: wgs84.is_none().then_some(round(easting, 3)),
            northing: wgs84.is_none().then_some(round(northing, 3)),
            height: Some(round(height, 3)),
            height_datum: Some("hkpd".to_owned()),
            height_sigma_m: None,
            yaw_deg: Some(round((yaw + error.yaw_deg).rem_euclid(360.0), 3)),
            pitch_deg: round(pitch + error.tilt_deg[0], 3),
            roll_deg: round(roll + error.tilt_deg[1], 3),
            tilt_sigma_deg: None,
            north: Some("grid".to_owned()),
            declination_deg: None,
            position_sigma_m: Some(scene.prior_sigma_m),
            yaw_sigma_deg: Some(stated_yaw_sigma_deg()),
        },
    })
}
