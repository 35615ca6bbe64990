//! Trying a plugin: its settings as the host completes them, and for a matcher in `score` form flat label images and a
//! street corner around which it looks for the camera.

use super::{Paint, ToyCamera, ToyHost, ToyScene};
use crate::host::Host;
use crate::image::{ImageRef, ViewImages};
use crate::kinds::{Error, Plugin, Scorer};
use resurvey_schema::{ClassId, GridPoint, Intrinsics, Pose};
use serde_json::Value;

/// A plugin with the defaults of its schema but for `changed`, a JSON object such as `{"least_px": 20}`; the host's checks
/// of names and ranges are not made.
pub fn create<T: Plugin>(changed: &str) -> Result<T, Error> {
    type Object = serde_json::Map<String, Value>;
    let object = |what: &str, text: &str| {
        serde_json::from_str::<Object>(text)
            .map_err(|error| Error(format!("{what}: expected a JSON object, found {error}")))
    };
    let schema = if T::SETTINGS.is_empty() { Object::new() } else { object("SETTINGS", T::SETTINGS)? };
    let properties = schema.get("properties").and_then(Value::as_object).cloned().unwrap_or_default();
    let default = |(name, schema): (String, Value)| schema.get("default").map(|default| (name, default.clone()));
    let mut settings: Object = properties.into_iter().filter_map(default).collect();
    settings.extend(object("changed settings", changed)?);
    T::create(serde_json::from_value(settings.into()).map_err(|error| format!("settings: {error}"))?)
}

/// Labels with a range a pixel, as a photo or as a view.
#[derive(Clone, Debug, PartialEq)]
pub struct Labels {
    width: u32,
    labels: Vec<u8>,
    range_m: Vec<f32>,
}

impl Labels {
    /// Row-major `labels` on something 10 m away; a last row that is not full is cut off.
    pub fn new(width: u32, labels: &[u8]) -> Self {
        let whole = labels.len() - labels.len() % (width.max(1) as usize);
        Self { width, labels: labels[..whole].to_vec(), range_m: vec![10.0; whole] }
    }

    /// The same with the range of each pixel as `range_m` says of its column and row, metres.
    pub fn at(self, range_m: impl Fn(u32, u32) -> f32) -> Self {
        let of_pixel = |index: u32| range_m(index % self.width, index / self.width);
        let range_m = (0..self.labels.len() as u32).map(of_pixel).collect();
        Self { range_m, ..self }
    }

    /// What `scorer` says of these as the photo and `view` as the view.
    pub fn score(&self, scorer: &mut impl Scorer, view: &Self) -> Result<f64, Error> {
        let images = ViewImages {
            width: view.width,
            height: view.labels.len() as u32 / view.width.max(1),
            origin: GridPoint::new(0.0, 0.0, 0.0),
            labels: view.labels.clone(),
            range_m: view.range_m.clone(),
            points: vec![[0.0; 3]; view.labels.len()],
            features: vec![0; view.labels.len()],
            feature_table: Vec::new(),
        };
        scored(scorer, &self.labels, &images)
    }
}

impl ToyScene {
    /// A stone house with a glass door, a lower one of glass across the street, and a metal one behind, on flat ground.
    pub fn corner() -> Self {
        let [stone, glass, metal, ground] = [0, 1, 2, 8].map(ClassId);
        let mut scene = Self { ground: Some((0.0, ground)), ..Self::default() };
        scene.add_wall([-6.0, 2.0], [-6.0, 18.0], [0.0, 12.0], Paint::Plain(stone));
        scene.add_wall([-5.95, 8.0], [-5.95, 10.0], [0.0, 3.0], Paint::Plain(glass));
        scene.add_wall([5.0, 26.0], [5.0, 6.0], [0.0, 7.0], Paint::Plain(glass));
        scene.add_wall([-14.0, 30.0], [9.0, 30.0], [0.0, 9.0], Paint::Plain(metal));
        scene
    }
}

/// Where the photo of [`corner`](ToyScene::corner) is taken, as metres east and north and degrees from the middle of the
/// candidates.
pub const OFF: [f64; 3] = [1.5, -1.0, 4.0];

/// The candidate on the street corner that `scorer` likes best, off the middle as [`OFF`] is: 9 × 9 places 0.5 m apart,
/// seven headings 2° apart. The first among equals.
pub fn best_candidate(scorer: &mut impl Scorer) -> Result<[f64; 3], Error> {
    let host = ToyHost::new(ToyScene::corner(), camera());
    let photo = host.labels(&pose(OFF));
    let (mut best, mut best_score) = (OFF, f64::NEG_INFINITY);
    let places = || (-4..=4).map(|step| f64::from(step) * 0.5);
    for (east_m, north_m) in places().flat_map(|east_m| places().map(move |north_m| (east_m, north_m))) {
        for turn_deg in (-3..=3).map(|step| f64::from(step) * 2.0) {
            let off = [east_m, north_m, turn_deg];
            let score = scored(scorer, &photo, &host.render(1, true, &[pose(off)])?[0])?;
            if score > best_score {
                (best, best_score) = (off, score);
            }
        }
    }
    Ok(best)
}

fn camera() -> Intrinsics {
    ToyCamera::intrinsics(96, 72, 120.0)
}

fn pose([east_m, north_m, turn_deg]: [f64; 3]) -> Pose {
    let position = GridPoint::new(east_m, north_m, 1.6);
    Pose { position, yaw_rad: turn_deg.to_radians(), pitch_rad: 0.1, roll_rad: 0.0 }
}

fn scored(scorer: &mut impl Scorer, photo: &[u8], view: &ViewImages) -> Result<f64, Error> {
    let (width, height) = (view.width, view.height);
    let photo = ImageRef::new(photo, width, height, width as usize);
    let photo = photo.ok_or_else(|| format!("expected a photo of {width}×{height} pixels, as the view"))?;
    scorer.score(photo, &view.view())
}
