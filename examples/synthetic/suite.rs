//! Maps and captures on disk, in the layout that `score.py` and `resurvey eval` read.

use super::capture::{Case, CaseSpec};
use super::kind::ChangeKind;
use super::model::Model;
use super::noise::NoiseLevel;
use super::photo::Photo;
use super::scene::{Scene, SceneKind};
use super::truth::Truth;
use super::{glb, label_png, three_ds};
use anyhow::Context;
use resurvey_core::crs::{Crs, GridPoint};
use resurvey_schema::CaptureFile;
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};

/// Which changes the captures of a suite show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Changes {
    /// The simple kinds that suit the scene in turn.
    InTurn,
    /// One kind alone.
    Only(ChangeKind),
    /// Every other capture none, the others all other kinds in turn: for false updates per capture.
    HalfNone,
    /// All kinds that suit the scene in turn, the hard ones as well.
    Every,
}

impl std::str::FromStr for Changes {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match name {
            "simple" => Ok(Self::InTurn),
            "half" => Ok(Self::HalfNone),
            "every" => Ok(Self::Every),
            _ => anyhow::bail!("unknown kinds {name:?}: expected simple, half or every"),
        }
    }
}

impl Changes {
    /// The kinds on `scene`, one after another and then again.
    fn kinds(self, scene: &Scene) -> Vec<ChangeKind> {
        let suitable = ChangeKind::of(scene);
        match self {
            Self::InTurn => suitable,
            Self::Only(kind) => vec![kind],
            Self::Every => ChangeKind::every(scene),
            Self::HalfNone => {
                let real = suitable.into_iter().filter(|kind| *kind != ChangeKind::None);
                real.flat_map(|kind| [ChangeKind::None, kind]).collect()
            }
        }
    }
}

/// A set of captures of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Suite {
    /// The place.
    pub scene: SceneKind,
    /// The place follows from it.
    pub seed: u64,
    /// The captures follow from it.
    pub capture_seed: u64,
    /// Number of captures.
    pub count: usize,
    /// How good labels, prior and map are.
    pub noise: NoiseLevel,
    /// What they show.
    pub changes: Changes,
}

impl Suite {
    /// What each capture of the suite is.
    pub fn specs(&self, scene: &Scene) -> Vec<CaseSpec> {
        let kinds = self.changes.kinds(scene);
        (0..self.count)
            .map(|index| {
                let change = kinds[index % kinds.len()];
                let (place, noise) = (scene.name(), self.noise.name);
                CaseSpec {
                    name: format!("{place}-{}-{noise}-{index:03}", change.name().replace('_', "-")),
                    change,
                    noise: self.noise,
                    seed: self.capture_seed.wrapping_mul(1_000_003).wrapping_add(index as u64),
                    grid_prior: false,
                }
            })
            .collect()
    }
}

/// Writes the scene's map under `directory/maps` and returns its directory.
pub fn write_map(scene: &Scene, directory: &Path) -> anyhow::Result<PathBuf> {
    let name = scene.name();
    let folder = directory.join("maps").join(name);
    fs::create_dir_all(&folder).with_context(|| format!("making {}", folder.display()))?;
    let model = Model::new(&scene.world)?;
    write(&folder.join(format!("{name}.3ds")), &three_ds::encode(&model))?;
    write(&folder.join(format!("{name}.glb")), &glb::encode(&model))?;
    for material in &model.materials {
        if let Some(png) = &material.texture {
            write(&folder.join(three_ds::texture_name(material)), png)?;
        }
    }
    let map = json!({"origin": scene.origin, "triangles": model.triangles()});
    write(&folder.join("map.json"), map.to_string().as_bytes())?;
    Ok(folder)
}

/// Writes one capture under `directory` and returns its directory, which holds a second photo, if any, as `second`.
pub fn write_case(case: &Case, directory: &Path) -> anyhow::Result<PathBuf> {
    let folder = directory.join(&case.spec.name);
    write_photo(&case.labels, case.width, &case.capture, &case.truth, &folder)?;
    if let Some(Photo { capture, labels, width, truth }) = &case.second {
        write_photo(labels, *width, capture, truth, &folder.join("second"))?;
    }
    if !case.base_changes.is_empty() {
        let lines: String = case.base_changes.iter().map(|line| format!("{line}\n")).collect();
        write(&folder.join("base.changes.jsonl"), lines.as_bytes())?;
    }
    Ok(folder)
}

fn write_photo(labels: &[u8], width: usize, capture: &CaptureFile, truth: &Truth, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
    write(&folder.join("labels.png"), &label_png::encode(labels, width)?)?;
    write(&folder.join("capture.json"), serde_json::to_string_pretty(capture)?.as_bytes())?;
    write(&folder.join("truth.json"), serde_json::to_string_pretty(&truth.json)?.as_bytes())
}

/// Writes the map and all captures of a suite; returns the captures' directories.
pub fn write_suite(suite: &Suite, directory: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let scene = Scene::new(suite.scene, suite.seed);
    write_map(&scene, directory)?;
    suite.specs(&scene).into_iter().map(|spec| write_case(&Case::new(&scene, spec)?, directory)).collect()
}

/// The same, each capture with a second photo of the same changed place where one can be taken.
pub fn write_suite_with_seconds(suite: &Suite, directory: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let scene = Scene::new(suite.scene, suite.seed);
    write_map(&scene, directory)?;
    suite.specs(&scene).into_iter().map(|spec| write_case(&Case::with_second(&scene, spec)?, directory)).collect()
}

/// Suites of every kind of scene at light and field noise, `count` captures of each, every other one without a change.
/// The two noises of a scene share its map, and no capture is the same with less noise.
pub fn full_suite(seed: u64, count: usize) -> Vec<Suite> {
    let of_scene = |scene| {
        in_both_noises(Suite {
            scene,
            seed,
            capture_seed: seed,
            count,
            noise: NoiseLevel::LIGHT,
            changes: Changes::HalfNone,
        })
    };
    SceneKind::ALL.into_iter().flat_map(of_scene).collect()
}

/// Suites of every kind of scene at light and field noise, each with every kind of change that suits it, `rounds` times.
pub fn every_suite(seed: u64, rounds: usize) -> Vec<Suite> {
    let of_scene = |scene| {
        let count = rounds * ChangeKind::every(&Scene::new(scene, seed)).len();
        in_both_noises(Suite {
            scene,
            seed,
            capture_seed: seed,
            count,
            noise: NoiseLevel::LIGHT,
            changes: Changes::Every,
        })
    };
    SceneKind::ALL.into_iter().flat_map(of_scene).collect()
}

/// The same suite at light noise, and other captures of it at field noise.
fn in_both_noises(light: Suite) -> [Suite; 2] {
    let field = Suite { capture_seed: !light.seed, noise: NoiseLevel::FIELD, ..light.clone() };
    [light, field]
}

/// Latitude and longitude, degrees, of a grid position with a height above HKPD.
pub fn wgs84([easting, northing, height]: [f64; 3]) -> anyhow::Result<[f64; 2]> {
    let wgs84 = Crs::Hk1980.wgs84_from_grid(GridPoint::new(easting, northing, height))?;
    Ok([wgs84.latitude_deg, wgs84.longitude_deg])
}

fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    fs::write(path, bytes).with_context(|| format!("writing {}", path.display()))
}
