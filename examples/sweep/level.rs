//! Captures at one level of a noise, and their evaluation.

use crate::synthetic::random::Random;
use crate::synthetic::{Case, CaseSpec, Changes, NoiseLevel, Scene, SceneKind, Suite, write_case, write_map};
use anyhow::{Context, bail, ensure};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What is raised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// 1σ by which contours wander, pixels.
    Jitter,
    /// Share of pixels in blobs of a wrong class, per cent.
    Blobs,
    /// Distance of the prior from the true place, metres.
    Prior,
}

impl Noise {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Jitter, Self::Blobs, Self::Prior];

    /// Name in paths and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jitter => "jitter",
            Self::Blobs => "blobs",
            Self::Prior => "prior",
        }
    }

    /// What it is, with its unit.
    pub fn label(self) -> &'static str {
        match self {
            Self::Jitter => "contours wander by (1σ), px",
            Self::Blobs => "pixels in wrong blobs, %",
            Self::Prior => "error of the prior's position, m",
        }
    }

    /// The levels.
    pub fn values(self) -> &'static [f64] {
        match self {
            Self::Jitter => &[0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0],
            Self::Blobs => &[0.0, 1.0, 2.0, 4.0, 6.0, 8.0],
            Self::Prior => &[0.0, 5.0, 10.0, 20.0, 30.0, 35.0, 40.0],
        }
    }

    /// Light noise with this one at `value`.
    fn at(self, value: f64) -> NoiseLevel {
        let light = NoiseLevel { name: "sweep", ..NoiseLevel::LIGHT };
        match self {
            Self::Jitter => NoiseLevel { jitter_px: value, ..light },
            Self::Blobs => NoiseLevel { blobs: value / 100.0, ..light },
            Self::Prior => light,
        }
    }
}

impl std::str::FromStr for Noise {
    type Err = anyhow::Error;

    fn from_str(name: &str) -> anyhow::Result<Self> {
        match Self::ALL.into_iter().find(|noise| noise.name() == name) {
            Some(noise) => Ok(noise),
            None => bail!("unknown noise {name:?}: expected jitter, blobs or prior"),
        }
    }
}

/// One noise on captures of one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sweep {
    /// What is raised.
    pub noise: Noise,
    /// The place.
    pub scene: SceneKind,
    /// Place and captures follow from it.
    pub seed: u64,
    /// Captures at each level.
    pub count: usize,
}

/// What `eval` says at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The level.
    pub value: f64,
    /// Number of captures.
    pub captures: f64,
    /// Median and ninth decile of the error in plan, metres; infinite where there is no answer.
    pub error_m: [f64; 2],
    /// Share within (1 m, 1°) and within (2 m, 2°), and of reliable answers.
    pub recall: [f64; 2],
    /// Share of captures with a reliable answer.
    pub coverage: f64,
    /// Changes found, and changes there are.
    pub changes: [f64; 2],
    /// Changes committed, and false ones among them.
    pub committed: [f64; 2],
}

impl Sweep {
    /// Makes the captures at `value` under `directory` and evaluates them.
    pub fn level(&self, value: f64, directory: &Path) -> anyhow::Result<Level> {
        let folder = self.write(value, directory)?;
        let folder = folder.to_str().with_context(|| format!("{} is not Unicode", folder.display()))?;
        let words = ["resurvey", "eval", folder, "--updates", "--matcher", "semantic", "--json"];
        let (mut out, mut messages) = (Vec::new(), Vec::new());
        let code = resurvey::run(words, &mut out, &mut messages);
        ensure!(code == 0, "resurvey eval ended with {code}: {}", String::from_utf8_lossy(&messages));
        let document: Value = serde_json::from_slice(&out).context("reading the answer of resurvey eval")?;
        Ok(Level::of(value, &document["groups"][0]["summaries"][0]))
    }

    /// The same poses and changes at every level.
    fn write(&self, value: f64, directory: &Path) -> anyhow::Result<PathBuf> {
        let Self { noise, scene, seed, count } = *self;
        let suite =
            Suite { scene, seed, capture_seed: seed, count, noise: noise.at(value), changes: Changes::HalfNone };
        let place = Scene::new(scene, seed);
        write_map(&place, directory)?;
        let folder = directory.join(format!("{}-{}-{value}", scene.name(), noise.name()));
        // Captures of an earlier run would be evaluated with these.
        ensure!(!folder.exists(), "{}: expected no such directory yet; name another --out", folder.display());
        for spec in suite.specs(&place) {
            let mut case = Case::new(&place, CaseSpec { grid_prior: true, ..spec })?;
            if noise == Noise::Prior {
                move_prior(&mut case, value);
            }
            write_case(&case, &folder)?;
        }
        Ok(folder)
    }
}

/// Puts the prior `error_m` from the true place, in a direction that follows from the capture's seed.
fn move_prior(case: &mut Case, error_m: f64) {
    let bearing_rad = Random::new(case.spec.seed, "bearing of the prior").within(0.0, std::f64::consts::TAU);
    let [e, n, _] = case.truth.position;
    case.capture.prior.easting = Some(e + error_m * bearing_rad.sin());
    case.capture.prior.northing = Some(n + error_m * bearing_rad.cos());
}

impl Level {
    fn of(value: f64, summary: &Value) -> Self {
        let number = |value: &Value| value.as_f64().unwrap_or(f64::INFINITY);
        let middle = |key: &str| number(&summary[key]["value"]);
        let changes = &summary["changes"];
        let both = |key: &str| number(&changes["material"][key]) + number(&changes["dynamic"][key]);
        Self {
            value,
            captures: number(&summary["captures"]),
            error_m: [middle("median_m"), middle("ninth_decile_m")],
            recall: [middle("recall_1m_1deg"), middle("recall_2m_2deg")],
            coverage: middle("coverage"),
            changes: [both("found"), both("expected")],
            committed: [number(&changes["committed"]), number(&changes["false_updates"])],
        }
    }

    /// Changes found, of a hundred.
    pub fn found_percent(&self) -> f64 {
        100.0 * self.changes[0] / self.changes[1]
    }

    /// False updates of a hundred captures.
    pub fn false_per_100(&self) -> f64 {
        100.0 * self.committed[1] / self.captures
    }
}
