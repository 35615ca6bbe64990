//! An update of a copy of the map, the same again, and another photo of the place, against the truth.

use super::cases::{Case, Second};
use super::maps::Maps;
use super::poses::{Photo, Poses};
use crate::args::PriorFrom;
use crate::commands::crs_of;
use crate::commands::update::{Comparers, Outcome, Recording, Run, Work};
use crate::console::Console;
use crate::failure::Failure;
use crate::matching::MatchingTool;
use crate::tools::Tool;
use resurvey_core::evaluate::{ChangeScore, SecondPhoto, score_changes, score_second_photo};
use resurvey_core::localize::Located;
use resurvey_core::store::MapFile;
use resurvey_core::update::{Change, Resolution};
use resurvey_schema::ClassTable;
use serde_json::Map;
use std::path::Path;
use std::time::Instant;

/// What evaluation writes into its own maps.
const RECORDING: Recording<'_> = Recording {
    dry_run: false,
    keep_labels: false,
    message: None,
    author: "eval",
    idempotency_key: None,
    review: None,
    search: None,
};

/// Why a true change was missed where no rejection says more.
const NO_POSE: &str = "no-pose";
const UNRELIABLE: &str = "pose-not-reliable";
const FAILED: &str = "update-failed";
const UNSEEN: &str = "nothing-seen";

/// What an update came to.
#[derive(Default)]
pub struct Update {
    /// What was committed, and what was not with the reason.
    pub resolution: Resolution,
    /// What a second photo of the place committed afterwards.
    pub second_photo: Vec<Change>,
    /// What failed: the update, or what should have followed it.
    pub problems: Vec<String>,
    /// Time after the pose was found.
    pub seconds: f64,
}

/// The score of a capture that nothing could be done with.
pub fn without_pose(case: &Case, classes: &ClassTable) -> ChangeScore {
    let mut score = score_changes(&case.truth, &[], classes);
    score.explain(&[], NO_POSE, classes);
    score
}

/// One contender's updates of one case.
pub struct Judge<'a> {
    /// The case.
    pub case: &'a Case,
    /// Copies of maps.
    pub maps: &'a Maps,
    /// Detector and estimator.
    pub comparers: [&'a Tool; 2],
    /// The matcher, for the evidence.
    pub matcher: Option<&'a MatchingTool>,
}

impl Judge<'_> {
    /// Updates a copy of the map at `path`, which `work` was read from, from the pose that was found; then with the same
    /// capture again, and with the second photo.
    pub fn update(
        &self,
        (work, located): (&Work, &Located),
        path: &Path,
        poses: &mut Poses<'_>,
    ) -> Result<(Update, ChangeScore), Failure> {
        let classes = work.world.classes();
        let copy = self.maps.copy(path)?;
        let map = MapFile::open(copy.path())?;
        let start = Instant::now();
        let first = self.conclude(&map, work, located.clone());
        let seconds = start.elapsed().as_secs_f64();
        let first = match first {
            Ok(first) => first.resolution,
            Err(failure) => {
                let mut score = score_changes(&self.case.truth, &[], classes);
                score.explain(&[], FAILED, classes);
                return Ok((Update { problems: vec![failure.to_string()], seconds, ..Update::default() }, score));
            }
        };
        let mut score = score_changes(&self.case.truth, &first.changes, classes);
        let otherwise = if located.is_reliable() { UNSEEN } else { UNRELIABLE };
        score.explain(&first.rejections, otherwise, classes);
        let mut update = Update { resolution: first, seconds, ..Update::default() };
        let mut changed = update.resolution.changes.clone();
        match self.again(&map, (work, located), &changed, poses) {
            Ok(again) => {
                score.second_run = Some(again.len());
                changed.extend(again);
            }
            Err(problem) => update.problems.push(format!("second run: {problem}")),
        }
        if let Some(second) = &self.case.second {
            match self.second_photo(&map, second, &changed, poses) {
                Ok((is_reliable, made)) => {
                    let first = (&self.case.truth, &score);
                    let scored = score_second_photo(first, &second.truth, &made, classes);
                    score.second_photo = Some(SecondPhoto { reliable: is_reliable, ..scored });
                    update.second_photo = made;
                }
                Err(problem) => update.problems.push(format!("second photo: {problem}")),
            }
        }
        Ok((update, score))
    }

    /// What the same capture changes on `map`, on which it has `changed` something already.
    fn again(
        &self,
        map: &MapFile,
        (work, located): (&Work, &Located),
        changed: &[Change],
        poses: &mut Poses<'_>,
    ) -> Result<Vec<Change>, String> {
        let said = |failure: Failure| failure.to_string();
        // A map that did not change gives the same world, and the same pose in it.
        if changed.is_empty() {
            return Ok(self.conclude(map, work, located.clone()).map_err(said)?.resolution.changes);
        }
        let work = read(map, &self.case.capture()).map_err(said)?;
        let located = poses.of(Photo::First, changed, map, &work)?;
        Ok(self.conclude(map, &work, located).map_err(said)?.resolution.changes)
    }

    /// Whether the pose of the second photo is reliable, and what it changes on `map`, on which `changed` was done.
    fn second_photo(
        &self,
        map: &MapFile,
        second: &Second,
        changed: &[Change],
        poses: &mut Poses<'_>,
    ) -> Result<(bool, Vec<Change>), String> {
        let said = |failure: Failure| failure.to_string();
        let work = read(map, &second.capture).map_err(said)?;
        let located = poses.of(Photo::Second, changed, map, &work)?;
        let is_reliable = located.is_reliable();
        Ok((is_reliable, self.conclude(map, &work, located).map_err(said)?.resolution.changes))
    }

    /// Detects, estimates and commits. What was found is committed, or it is an error.
    fn conclude(&self, map: &MapFile, work: &Work, located: Located) -> Result<Outcome, Failure> {
        let [detector, estimator] = self.comparers;
        let mut used = self.matcher.map_or(Ok(Vec::new()), MatchingTool::used)?;
        used.extend([detector.used()?, estimator.used()?]);
        let mut comparers = Comparers {
            detector: detector.plugin.detector(&detector.settings)?,
            estimator: estimator.plugin.estimator(&estimator.settings)?,
            used,
        };
        let (outcome, _) = quietly(|console| run_on(map)?.conclude(work, located, false, &mut comparers, console))?;
        Ok(outcome)
    }
}

/// Reads the capture at `path` and `map` around it.
pub fn read(map: &MapFile, path: &Path) -> Result<Work, Failure> {
    quietly(|console| run_on(map)?.read(path, None, (&PriorFrom::default(), None), console))
}

fn run_on(map: &MapFile) -> Result<Run<'_>, Failure> {
    Ok(Run { map, crs: crs_of(map)?, recording: RECORDING, timings: Map::new(), is_last: false })
}

/// Runs a stage that says nothing: the bar of the whole run is the only one.
fn quietly<T>(work: impl FnOnce(&mut Console<'_>) -> T) -> T {
    let (mut out, mut err) = (std::io::sink(), std::io::sink());
    work(&mut Console::new(&mut out, &mut err, false, false))
}
