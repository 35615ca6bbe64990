//! One capture with every contender: the pose, and where asked the update, against the truth.

use super::cases::Case;
use super::contender::{Contender, Field};
use super::maps::{Maps, apply};
use crate::args::PriorFrom;
use crate::commands::crs_of;
use crate::commands::update::{Comparers, Outcome, Recording, Run, Work};
use crate::console::{Console, Stage};
use crate::failure::{Failure, INPUT};
use crate::tools::{Choices, Tool};
use resurvey_core::capture::Capture;
use resurvey_core::evaluate::{Answer, PoseError, Trial, nees, score_changes};
use resurvey_core::localize::{Listener, Located, SceneServices, localize};
use resurvey_core::store::MapFile;
use resurvey_core::update::Change;
use resurvey_schema::service::Level;
use resurvey_schema::{ClassTable, Localization, Rejection};
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
};

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

/// What an update came to.
pub struct Update {
    /// What was committed.
    pub changes: Vec<Change>,
    /// What was not, and why.
    pub rejections: Vec<Rejection>,
    /// Why it failed.
    pub problem: Option<String>,
    /// Time after the pose was found.
    pub seconds: f64,
}

/// The share of a run that one contender on one capture is.
pub struct Portion<'a> {
    /// The bar of the whole run.
    pub stage: &'a Stage,
    /// Where it begins, 0–1.
    pub start: f64,
    /// Its part, 0–1.
    pub share: f64,
    /// Capture and contender.
    pub place: String,
}

impl Listener for Portion<'_> {
    fn log(&self, level: Level, text: &str) {
        if level == Level::Warning {
            self.stage.log(level, &format!("{}: {text}", self.place));
        }
    }

    fn progress(&self, fraction: f64) {
        self.stage.progress(self.start + self.share * fraction.clamp(0.0, 1.0));
    }

    fn cancelled(&self) -> bool {
        false
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
    pub fn record(&mut self, case: Case, portion: &Portion<'_>) -> Result<Record, Failure> {
        let mut path = self.maps.of_scene(&case.scene)?;
        if let Some(changes) = case.base_changes() {
            path = self.maps.copy(&path, "base")?;
            apply(&changes, &path)?;
        }
        let map = MapFile::open_read_only(&path)?;
        let read = quietly(|console| run_on(&map)?.read(&case.capture(), None, &PriorFrom::default(), console));
        let contenders = &self.field.contenders;
        let mut attempts = Vec::with_capacity(contenders.len());
        let mut prior = None;
        match read {
            Ok(work) => {
                prior = Some(PoseError::of(&work.capture.prior.pose, &case.truth.pose));
                for (index, contender) in contenders.iter().enumerate() {
                    let share = portion.share / contenders.len() as f64;
                    let own = Portion {
                        stage: portion.stage,
                        start: portion.start + share * index as f64,
                        share,
                        place: format!("{}, {}", portion.place, contender.name),
                    };
                    attempts
                        .push(Trying { runner: self, case: &case, contender, portion: &own }.attempt(&work, &path)?);
                }
            }
            // The capture itself is at fault: no contender has an answer.
            Err(failure) if failure.code() == INPUT => {
                let changes = || self.with_updates.then(|| score_changes(&case.truth, &[], &ClassTable::default()));
                attempts
                    .extend(contenders.iter().map(|_| Attempt::without_answer(failure.to_string(), 0.0, changes())));
            }
            Err(failure) => return Err(failure),
        }
        Ok(Record { case, prior, attempts })
    }
}

impl Attempt {
    fn without_answer(reason: String, seconds: f64, changes: Option<resurvey_core::evaluate::ChangeScore>) -> Self {
        Self { trial: Trial { answer: None, seconds, changes }, answer: Err(reason), update: None }
    }
}

/// One contender on one capture.
struct Trying<'a> {
    runner: &'a Runner<'a>,
    case: &'a Case,
    contender: &'a Contender,
    portion: &'a Portion<'a>,
}

impl Trying<'_> {
    /// `work` was read from the map at `path`.
    fn attempt(&self, work: &Work, path: &Path) -> Result<Attempt, Failure> {
        let truth = &self.case.truth;
        let map = MapFile::open_read_only(path)?;
        let start = Instant::now();
        let located = self.locate(&map, work);
        let seconds = start.elapsed().as_secs_f64();
        let located = match located {
            Ok(located) => located,
            Err(failure) => {
                let nothing = self.runner.with_updates.then(|| score_changes(truth, &[], work.world.classes()));
                return Ok(Attempt::without_answer(failure.to_string(), seconds, nothing));
            }
        };
        let error = PoseError::of(&located.localization.pose, &truth.pose);
        let answer =
            Answer { error, is_reliable: located.is_reliable(), nees: nees(&error, &located.localization.covariance) };
        let mut trial = Trial { answer: Some(answer), seconds, changes: None };
        let mut update = None;
        if self.runner.with_updates {
            let (done, second_run) = self.update(work, located.clone(), path)?;
            let mut score = score_changes(truth, &done.changes, work.world.classes());
            score.second_run = second_run;
            trial.changes = Some(score);
            update = Some(done);
        }
        Ok(Attempt { trial, answer: Ok(located), update })
    }

    fn locate(&self, map: &MapFile, work: &Work) -> Result<Located, Failure> {
        let Choices { gate, search, .. } = &self.runner.choices;
        let Some(tool) = &self.contender.matcher else { return Ok(Located::new(as_answer(&work.capture), gate)) };
        // A new instance each time: what one capture did to it is nothing to the next.
        let mut matcher = tool.plugin.matcher(&tool.settings)?;
        let services = SceneServices::new(&work.world, &work.capture, crs_of(map)?, self.portion);
        Ok(localize(&mut matcher, &services, gate, search)?)
    }

    /// Updates a copy of the map at `path` twice; what the first run did, and the number of changes of the second.
    fn update(&self, work: &Work, located: Located, path: &Path) -> Result<(Update, Option<usize>), Failure> {
        let copy = self.runner.maps.copy(path, "update")?;
        let map = MapFile::open(&copy)?;
        let start = Instant::now();
        let first = self.conclude(&map, work, located);
        let seconds = start.elapsed().as_secs_f64();
        let first = match first {
            Ok(first) => first,
            Err(failure) => {
                let problem = Some(failure.to_string());
                return Ok((Update { changes: Vec::new(), rejections: Vec::new(), problem, seconds }, None));
            }
        };
        let again = quietly(|console| run_on(&map)?.read(&self.case.capture(), None, &PriorFrom::default(), console))
            .and_then(|work| self.conclude(&map, &work, self.locate(&map, &work)?));
        let (second_run, problem) = match again {
            Ok(outcome) => (Some(outcome.resolution.changes.len()), None),
            Err(failure) => (None, Some(format!("second run: {failure}"))),
        };
        let resolution = first.resolution;
        let update = Update { changes: resolution.changes, rejections: resolution.rejections, problem, seconds };
        Ok((update, second_run))
    }

    /// Detects, estimates and commits. What was found is committed, or it is an error.
    fn conclude(&self, map: &MapFile, work: &Work, located: Located) -> Result<Outcome, Failure> {
        let [detector, estimator] = &self.runner.field.others;
        let matcher = self.contender.matcher.as_ref();
        let tools = matcher.into_iter().chain([detector, estimator]);
        let mut comparers = Comparers {
            detector: detector.plugin.detector(&detector.settings)?,
            estimator: estimator.plugin.estimator(&estimator.settings)?,
            used: tools.map(Tool::used).collect::<Result<_, _>>()?,
        };
        let (outcome, _) = quietly(|console| run_on(map)?.conclude(work, located, false, &mut comparers, console))?;
        Ok(outcome)
    }
}

fn run_on(map: &MapFile) -> Result<Run<'_>, Failure> {
    Ok(Run { map, crs: crs_of(map)?, recording: RECORDING, timings: Map::new() })
}

/// Runs a stage that says nothing: the bar of the whole run is the only one.
fn quietly<T>(work: impl FnOnce(&mut Console<'_>) -> T) -> T {
    let (mut out, mut err) = (std::io::sink(), std::io::sink());
    work(&mut Console::new(&mut out, &mut err, false, false))
}

/// The phone's pose as an answer, as sure as the phone says.
fn as_answer(capture: &Capture) -> Localization {
    let prior = &capture.prior;
    let position_m2 = prior.position_sigma_m.powi(2);
    Localization {
        pose: prior.pose,
        score: 1.0,
        covariance: [[position_m2, 0.0, 0.0], [0.0, position_m2, 0.0], [0.0, 0.0, prior.yaw_sigma_rad.powi(2)]],
        alignment: None,
        runner_up: None,
        candidates: 1,
        skipped: 0,
        heat: Vec::new(),
    }
}
