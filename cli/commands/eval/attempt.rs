//! One capture with every contender: the pose, and where asked the update, against the truth.

use super::cases::Case;
use super::contender::Field;
use super::judge::{Judge, Update, read, without_pose};
use super::maps::{Maps, apply};
use super::poses::{Photo, Poses};
use super::progress::Portion;
use crate::commands::update::Work;
use crate::failure::{Failure, INPUT};
use crate::tools::Choices;
use resurvey_core::evaluate::{Answer, ChangeScore, PoseError, Trial, nees};
use resurvey_core::localize::Located;
use resurvey_core::store::MapFile;
use resurvey_schema::ClassTable;
use std::path::Path;
use std::time::Instant;

/// A capture with what each contender made of it.
pub struct Record {
    /// The capture.
    pub case: Case,
    /// Error of the phone's pose; `None` where the capture could not be read.
    pub prior: Option<PoseError>,
    /// One a contender, in their order.
    pub attempts: Vec<Attempt>,
}

/// What one contender made of one capture.
pub struct Attempt {
    /// The numbers.
    pub trial: Trial,
    /// The answer, or why there is none.
    pub answer: Result<Located, String>,
    /// The update, where one was asked for.
    pub update: Option<Update>,
}

impl Attempt {
    fn without_answer(reason: String, seconds: f64, changes: Option<ChangeScore>) -> Self {
        Self { trial: Trial { answer: None, seconds, changes }, answer: Err(reason), update: None }
    }
}

/// All contenders on one capture after another.
pub struct Runner<'a> {
    field: &'a Field,
    choices: Choices,
    maps: Maps,
    with_updates: bool,
}

impl<'a> Runner<'a> {
    /// A runner with the maps of its scenes.
    pub fn new(field: &'a Field, maps: Maps, with_updates: bool) -> Result<Self, Failure> {
        Ok(Self { field, choices: field.choices()?, maps, with_updates })
    }

    /// Every contender on `case`; `portion` is the whole capture's.
    pub fn record(&self, case: &Case, portion: &Portion<'_>) -> Result<Record, Failure> {
        let base = self.maps.of_scene(&case.scene)?;
        if let Some(changes) = case.base_changes() {
            apply(&changes, base.path())?;
        }
        let map = MapFile::open_read_only(base.path())?;
        let matchers = self.field.matchers.len();
        let mut attempts = Vec::with_capacity(self.field.contenders.len());
        let mut prior = None;
        match read(&map, &case.capture()) {
            Ok(work) => {
                prior = Some(PoseError::of(&work.capture.prior.pose, &case.truth.pose));
                for (matcher, entry) in self.field.matchers.iter().enumerate() {
                    let share = portion.share / matchers as f64;
                    let own = Portion {
                        start: portion.start + share * matcher as f64,
                        share,
                        place: format!("{}, {}", portion.place, entry.name),
                        ..*portion
                    };
                    attempts.extend(self.attempts(case, matcher, (&map, &work), &own)?);
                }
            }
            // The capture itself is at fault: no contender has an answer.
            Err(failure) if failure.code() == INPUT => {
                let changes = || self.with_updates.then(|| without_pose(case, &ClassTable::default()));
                let contenders = self.field.contenders.iter();
                attempts.extend(contenders.map(|_| Attempt::without_answer(failure.to_string(), 0.0, changes())));
            }
            Err(failure) => return Err(failure),
        }
        Ok(Record { case: case.clone(), prior, attempts })
    }

    /// Every contender with this matcher, which searches once for all of them; `work` was read from `map`.
    fn attempts(
        &self,
        case: &Case,
        matcher: usize,
        (map, work): (&MapFile, &Work),
        portion: &Portion<'_>,
    ) -> Result<Vec<Attempt>, Failure> {
        let tool = self.field.matchers[matcher].tool.as_ref();
        let mut poses = Poses::new(tool, &self.choices, portion);
        let start = Instant::now();
        let located = poses.of(Photo::First, &[], map, work);
        let seconds = start.elapsed().as_secs_f64();
        let mut attempts = Vec::new();
        for contender in self.field.with_matcher(matcher) {
            let judge = Judge { case, maps: &self.maps, comparers: self.field.comparers(contender), matcher: tool };
            attempts.push(match &located {
                Ok(located) => self.attempt((located, seconds), (work, map.path()), &judge, &mut poses)?,
                Err(reason) => {
                    let nothing = self.with_updates.then(|| without_pose(case, work.world.classes()));
                    Attempt::without_answer(reason.clone(), seconds, nothing)
                }
            });
        }
        Ok(attempts)
    }

    fn attempt(
        &self,
        (located, seconds): (&Located, f64),
        (work, path): (&Work, &Path),
        judge: &Judge<'_>,
        poses: &mut Poses<'_>,
    ) -> Result<Attempt, Failure> {
        let error = PoseError::of(&located.localization.pose, &judge.case.truth.pose);
        let answer =
            Answer { error, is_reliable: located.is_reliable(), nees: nees(&error, &located.localization.covariance) };
        let judged = self.with_updates.then(|| judge.update((work, located), path, poses)).transpose()?;
        let (update, changes) = judged.unzip();
        Ok(Attempt { trial: Trial { answer: Some(answer), seconds, changes }, answer: Ok(located.clone()), update })
    }
}
