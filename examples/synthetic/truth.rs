//! `truth.json`: the true pose and what really changed.

use super::camera::{Camera, distance_m};
use super::capture::CaseSpec;
use super::change::{Change, Event, Placed};
use super::noise::NoiseLevel;
use super::prior::PriorError;
use super::scene::Scene;
use super::seen::Seen;
use resurvey_schema::{ClassId, ClassTable};
use serde_json::{Map, Value, json};

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

/// What `truth.json` says of the photo with these `labels`.
pub fn truth(
    scene: &Scene,
    spec: &CaseSpec,
    event: &Event,
    error: &PriorError,
    [changed, visible]: [usize; 2],
    labels: &[u8],
    seen: impl Fn(&Placed) -> Seen,
) -> Truth {
    let position = scene.grid(event.camera.position);
    let attitude_deg = attitude_deg(&event.camera);
    let changes: Vec<TrueChange> = event.changes.iter().map(|change| true_change(scene, change)).collect();
    let known: Vec<Value> = event.known.iter().map(|placed| descriptor(scene, placed).1).collect();
    let [yaw, pitch, roll] = attitude_deg;
    let mut json = json!({
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
    if !event.unmeasurable.is_empty() {
        let cut =
            event.unmeasurable.iter().map(|placed| with_share(scene, placed, "outside_share", seen(placed).outside));
        json["unmeasurable"] = cut.collect();
    }
    if !event.hidden.is_empty() {
        let hidden = event.hidden.iter().map(|placed| with_share(scene, placed, "shown_share", seen(placed).shown));
        json["hidden"] = hidden.collect();
    }
    Truth { position, attitude_deg, changes, json }
}

/// A descriptor with a share of it, 0–1.
fn with_share(scene: &Scene, placed: &Placed, key: &str, share: f64) -> Value {
    let mut json = descriptor(scene, placed).1;
    json[key] = json!(round(share, 3));
    json
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
            let [width_m, height_m] = [b, d].map(|end| round(distance_m(a, end), 4));
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
        Change::Replace { after, .. } => ("add", after),
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
    if let Change::Replace { before, .. } = change {
        json["replaces"] = self::descriptor(scene, before).1;
    }
    TrueChange { op, class, position: Some(position), corners, json }
}

/// A change set that puts the known descriptors on the map.
pub fn base_changes(scene: &Scene, event: &Event) -> Vec<Value> {
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

/// `value` to so many digits after the point.
pub fn round(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale
}

/// Yaw, pitch, roll, degrees, as written.
pub fn attitude_deg(camera: &Camera) -> [f64; 3] {
    let [yaw, pitch, roll] = [camera.yaw_rad, camera.pitch_rad, camera.roll_rad].map(f64::to_degrees);
    [yaw.rem_euclid(360.0), pitch, roll].map(|value| round(value, 5))
}
