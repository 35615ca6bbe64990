//! One capture with its truth: what the phone sends, what the map knew, what really was.

use super::caster::{Picture, picture};
use super::change::{Change, ChangeKind, Event, Placed, event};
use super::clutter::{add_clutter, real_world};
use super::noise::{NoiseLevel, disturb};
use super::prior::{PriorError, stated_yaw_sigma_deg};
use super::random::Random;
use super::scene::Scene;
use super::world::World;
use resurvey_schema::capture::FORMAT;
use resurvey_schema::{CameraFile, CaptureFile, ClassId, ClassTable, PriorFile};
use serde_json::{Map, Value, json};

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

/// One true change with grid coordinates, rounded as in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueChange {
    /// `add`, `remove` or `modify`.
    pub op: &'static str,
    /// Class of the descriptor; of the new walls when a façade changed.
    pub class: String,
    /// Centre of a banner or ground contact of an object; `None` for a façade.
    pub position: Option<[f64; 3]>,
    /// Corners of a banner.
    pub corners: Option<[[f64; 3]; 4]>,
    /// As `truth.json` has it.
    pub json: Value,
}

/// What really was.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Easting, northing, height of the camera, metres.
    pub position: [f64; 3],
    /// Yaw, pitch, roll, degrees.
    pub attitude_deg: [f64; 3],
    /// What changed.
    pub changes: Vec<TrueChange>,
    /// As `truth.json` has it.
    pub json: Value,
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

fn round(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale
}

fn attitude_deg(event: &Event) -> [f64; 3] {
    let camera = &event.camera;
    let [yaw, pitch, roll] = [camera.yaw_rad, camera.pitch_rad, camera.roll_rad].map(f64::to_degrees);
    [yaw.rem_euclid(360.0), pitch, roll].map(|value| round(value, 5))
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

fn truth(
    scene: &Scene,
    spec: &CaseSpec,
    event: &Event,
    error: &PriorError,
    [changed, visible]: [usize; 2],
    labels: &[u8],
) -> Truth {
    let position = scene.grid(event.camera.position);
    let attitude_deg = attitude_deg(event);
    let changes: Vec<TrueChange> = event.changes.iter().map(|change| true_change(scene, change)).collect();
    let known: Vec<Value> = event.known.iter().map(|placed| descriptor(scene, placed).1).collect();
    let [yaw, pitch, roll] = attitude_deg;
    let json = json!({
        "pose": {"easting": position[0], "northing": position[1], "height": position[2],
            "yaw_deg": yaw, "pitch_deg": pitch, "roll_deg": roll},
        "changes": changes.iter().map(|change| change.json.clone()).collect::<Vec<_>>(),
        "base_descriptors": known,
        "change_px": changed,
        "change_visible_px": visible,
        "case": spec.name,
        "scene": scene.name(),
        "kind": spec.change.name(),
        "seed": spec.seed,
        "noise": noise_json(scene, &spec.noise),
        "prior_error": {"position_m": round(error.offset_m[0].hypot(error.offset_m[1]), 3),
            "yaw_deg": round(error.yaw_deg, 3)},
        "label_share": label_share(labels),
    });
    Truth { position, attitude_deg, changes, json }
}

fn noise_json(scene: &Scene, noise: &NoiseLevel) -> Value {
    if noise.is_ideal() {
        return json!({});
    }
    let mut json = json!({"jitter": noise.jitter_px, "blobs": noise.blobs});
    if scene.outdoors {
        json["trees"] = json!(noise.trees);
        json["cars"] = json!(noise.cars);
    }
    if noise.shift_m > 0.0 {
        json["shift"] = json!(noise.shift_m);
    }
    json["tilt"] = json!(noise.tilt_deg);
    json["alt"] = json!(noise.height_m);
    json
}

fn label_share(labels: &[u8]) -> Value {
    let share = |class: ClassId| labels.iter().filter(|&&label| label == class.0).count() as f64 / labels.len() as f64;
    let table = ClassTable::default();
    table.iter().map(|class| (class.name.clone(), json!(round(share(class.index), 4)))).collect::<Map<_, _>>().into()
}

/// Position and JSON of a descriptor.
fn descriptor(scene: &Scene, placed: &Placed) -> ([f64; 3], Value) {
    let table = ClassTable::default();
    match placed {
        Placed::Object(class, foot) => {
            let position = scene.grid(*foot);
            (position, json!({"class": table.name(ClassId(*class)), "position": position}))
        }
        Placed::Panel(panel) => {
            let corners = panel.corners.map(|corner| scene.grid(corner));
            let [a, b, c, d] = panel.corners;
            let position = scene.grid([0, 1, 2].map(|i| (a[i] + b[i] + c[i] + d[i]) / 4.0));
            let [width_m, height_m] = [b, d].map(|end| round(super::camera::distance_m(a, end), 4));
            let json = json!({"class": table.name(ClassId(panel.class)), "corners": corners,
                "width_m": width_m, "height_m": height_m, "position": position});
            (position, json)
        }
    }
}

fn true_change(scene: &Scene, change: &Change) -> TrueChange {
    let table = ClassTable::default();
    let (op, placed) = match change {
        Change::Add(placed) => ("add", placed),
        Change::Remove(placed) => ("remove", placed),
        Change::Repaint(object, from, to) => {
            let (from, to) = (table.name(ClassId(*from)), table.name(ClassId(*to)));
            let json = json!({"op": "modify", "object": object, "from": from, "to": to,
                "expected": "refused: not one captured rectangle"});
            return TrueChange { op: "modify", class: to.to_owned(), position: None, corners: None, json };
        }
    };
    let (position, descriptor) = descriptor(scene, placed);
    let corners = match placed {
        Placed::Panel(panel) => Some(panel.corners.map(|corner| scene.grid(corner))),
        Placed::Object(..) => None,
    };
    let class = descriptor["class"].as_str().unwrap_or_default().to_owned();
    let mut json = json!({"op": op});
    for (key, value) in descriptor.as_object().into_iter().flatten() {
        json[key] = value.clone();
    }
    TrueChange { op, class, position: Some(position), corners, json }
}

/// A change set that puts the known descriptors on the map.
fn base_changes(scene: &Scene, event: &Event) -> Vec<Value> {
    if event.known.is_empty() {
        return Vec::new();
    }
    let header = json!({"format": resurvey_schema::changes::FORMAT, "base_version": null, "author": "survey",
        "message": "descriptors surveyed before the capture"});
    let line = |placed: &Placed| {
        let (_, descriptor) = descriptor(scene, placed);
        let keep = |key: &&str| {
            ["class", "corners"].contains(key) || (*key == "position" && descriptor.get("corners").is_none())
        };
        let keys = ["class", "corners", "position"].into_iter().filter(keep);
        let after: Map<String, Value> =
            keys.filter_map(|key| Some((key.to_owned(), descriptor.get(key)?.clone()))).collect();
        json!({"op": "add", "after": after})
    };
    std::iter::once(header).chain(event.known.iter().map(line)).collect()
}
