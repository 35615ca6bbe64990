//! One capture with its truth: what the phone sends, what the map knew, what really was.

use super::caster::{Picture, picture};
use super::change::{Event, event};
use super::clutter::{add_clutter, real_world};
use super::kind::ChangeKind;
use super::noise::{NoiseLevel, disturb};
use super::prior::{PriorError, stated_yaw_sigma_deg};
use super::random::Random;
use super::scene::Scene;
use super::truth::{Truth, attitude_deg, base_changes, round, truth};
use super::world::World;
use resurvey_schema::capture::FORMAT;
use resurvey_schema::{CameraFile, CaptureFile, PriorFile};
use serde_json::Value;

/// What capture to make.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseSpec {
    /// Name of its directory.
    pub name: String,
    /// What changed.
    pub change: ChangeKind,
    /// How good labels, prior and map are.
    pub noise: NoiseLevel,
    /// Everything random follows from it.
    pub seed: u64,
    /// Whether the prior is given in grid coordinates and not in WGS84.
    pub grid_prior: bool,
}

/// A capture, its labels, and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// What was asked for.
    pub spec: CaseSpec,
    /// `capture.json`.
    pub capture: CaptureFile,
    /// Class a pixel, top row first.
    pub labels: Vec<u8>,
    /// Columns of the labels.
    pub width: usize,
    /// The lines of `base.changes.jsonl`; empty when the map knew no descriptor.
    pub base_changes: Vec<Value>,
    /// What really was.
    pub truth: Truth,
}

impl Case {
    /// The capture of `scene` that follows from `spec`.
    pub fn new(scene: &Scene, spec: CaseSpec) -> anyhow::Result<Self> {
        let random = |purpose: &str| Random::new(spec.seed, &format!("{} {purpose}", scene.name()));
        let noise = spec.noise;
        let real = real_world(scene, &noise, &mut random("map errors"));
        let event = event(scene, &real, spec.change, &mut random("change"))?;
        let mut cluttered = event.after.clone();
        if scene.outdoors {
            add_clutter(&mut cluttered, scene, &noise, event.camera.position, &mut random("clutter"));
        }
        let before = picture(&event.before, &event.camera);
        let again = |world: &World, known: &World, seen: &Picture| {
            if world == known { seen.clone() } else { picture(world, &event.camera) }
        };
        let after = again(&event.after, &event.before, &before);
        let photo = again(&cluttered, &event.after, &after);
        let changed: Vec<usize> =
            (0..photo.hits.len()).filter(|&i| before.hits[i].class != after.hits[i].class).collect();
        let visible = changed.iter().filter(|&&i| photo.hits[i].thing == after.hits[i].thing).count();
        let labels = disturb(&photo.labels(), photo.width as usize, &noise, &mut random("labels"));
        let error = PriorError::draw(scene, &noise, &mut random("prior"));
        let truth = truth(scene, &spec, &event, &error, [changed.len(), visible], &labels);
        Ok(Self {
            capture: capture(scene, &spec, &event, &error)?,
            labels,
            width: photo.width as usize,
            base_changes: base_changes(scene, &event),
            truth,
            spec,
        })
    }
}

fn capture(scene: &Scene, spec: &CaseSpec, event: &Event, error: &PriorError) -> anyhow::Result<CaptureFile> {
    let camera = &event.camera;
    let [easting, northing, height] = [0, 1, 2].map(|i| scene.origin[i] + camera.position[i] + error.offset_m[i]);
    let wgs84 = if spec.grid_prior { None } else { Some(super::suite::wgs84([easting, northing, height])?) };
    let [yaw, pitch, roll] = attitude_deg(event);
    Ok(CaptureFile {
        format: FORMAT.to_owned(),
        labels: "labels.png".to_owned(),
        taken_at: Some(format!("2026-06-01T10:{:02}:00+08:00", spec.seed % 60)),
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
