//! One capture with its truth: what the phone sends, what the map knew, what really was.

use super::kind::ChangeKind;
use super::noise::NoiseLevel;
use super::photo::{Photo, Place, Shot};
use super::scene::Scene;
use super::truth::{Truth, base_changes};
use resurvey_schema::CaptureFile;
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
    /// The same changed place from another pose; `None` when it was not asked for, or when no pose near by shows it.
    pub second: Option<Photo>,
}

impl Case {
    /// The capture of `scene` that follows from `spec`.
    pub fn new(scene: &Scene, spec: CaseSpec) -> anyhow::Result<Self> {
        Self::of(&Place::new(scene, &spec)?, spec)
    }

    /// The same capture, and a second photo of the changed place from 3 to 8 m away.
    pub fn with_second(scene: &Scene, spec: CaseSpec) -> anyhow::Result<Self> {
        let place = Place::new(scene, &spec)?;
        let second = place.seen_again();
        let second = second.map(|place| place.photo(Shot::Second)).transpose()?;
        Ok(Self { second, ..Self::of(&place, spec)? })
    }

    fn of(place: &Place<'_>, spec: CaseSpec) -> anyhow::Result<Self> {
        let Photo { capture, labels, width, truth } = place.photo(Shot::First)?;
        let base_changes = base_changes(place.scene, &place.event);
        Ok(Self { spec, capture, labels, width, base_changes, truth, second: None })
    }
}
