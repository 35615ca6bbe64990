//! `resurvey update`: localize, detect, estimate, commit.

mod tally;
mod told;

use super::crs_of;
use crate::args::{PluginSearch, PriorFrom, Update};
use crate::commands::review::{Review, repeated};
use crate::conflict::refused;
use crate::console::{Console, Stage};
use crate::failure::Failure;
use crate::matching::MatchingTool;
use crate::out_file::delivered;
use crate::prior::{Placed, read_placed};
use crate::report::{Reports, Seen, Sheet};
use crate::segment::Segmenting;
use crate::tools::{self, Choices, Tool, registry};
use jiff::Timestamp;
use resurvey_core::capture::{Capture, GivenPose, read_given_pose};
use resurvey_core::crs::Crs;
use resurvey_core::localize::{GateLimits, Located, Matching, SceneServices, World, inside_building, localize};
use resurvey_core::plugin::{Detector, Estimator, Kind};
use resurvey_core::render::{inside_solid, view};
use resurvey_core::store::{History, Made, MapFile};
use resurvey_core::update::{Change, Comparison, Resolution, add_changes, pose_estimate, resolve};
use resurvey_core::version::{
    BoxMm, Decision, Delta, LocalizationEvidence, Observation, PluginUse, SearchRange, UpdateTransaction, VersionId,
    VersionKind,
};
use resurvey_schema::{Localization, Pose};
use serde_json::{Map, Value, json};
use std::path::Path;
use tally::Tally;

/// Updates the map with every capture in turn. The exit code is 21 when one of them met a conflict, else 0 when any changed
/// something, else that of the last one.
pub fn run(options: &Update, plugins: &PluginSearch, console: &mut Console<'_>) -> Result<u8, Failure> {
    refuse_one_for_several(options)?;
    console.listen();
    let mut tools = Tools::load(options, plugins)?;
    let map = if options.dry_run { MapFile::open_read_only(&options.map)? } else { MapFile::open(&options.map)? };
    let given = options.pose.as_deref().map(read_given_pose).transpose()?;
    let mut reports = options.report.as_deref().map(Reports::start).transpose()?;
    let mut tally = Tally::default();
    for (index, path) in options.captures.iter().enumerate() {
        let recording = Recording {
            dry_run: options.dry_run,
            keep_labels: options.keep_labels,
            message: options.message.as_deref(),
            author: &options.author,
            idempotency_key: options.idempotency_key.as_deref(),
            review: match (options.propose, options.confirm) {
                (_, Some(captures)) => Some(Review::Confirm(usize::try_from(captures).unwrap_or(usize::MAX))),
                (true, None) => Some(Review::Propose),
                (false, None) => None,
            },
            search: Some(tools.choices.search_range()),
        };
        let is_last = index + 1 == options.captures.len();
        let mut run = Run { map: &map, crs: crs_of(&map)?, recording, timings: Map::new(), is_last };
        let result = run.capture(path, (given, &options.prior), &mut tools, reports.as_mut(), console);
        if let (Err(failure), Some(reports)) = (&result, &mut reports) {
            reports.add_failure(path, failure);
        }
        if !tally.count(path, result, console) {
            break;
        }
    }
    if console.is_json() && tally.is_told() {
        match tally.documents.as_slice() {
            [only] if options.captures.len() == 1 => console.document(only)?,
            several => console.document(&several)?,
        }
    }
    let written = reports.map_or(Ok(()), Reports::finish);
    match tally.code() {
        Ok(code) => delivered(code, written, console),
        Err(failure) => {
            delivered(failure.code(), written, console)?;
            Err(failure)
        }
    }
}

/// What belongs to one photo is refused with several captures.
fn refuse_one_for_several(options: &Update) -> Result<(), Failure> {
    let of_one = [
        ("--pose", options.pose.is_some()),
        ("--photo", options.prior.photo.is_some()),
        ("--at-time", options.prior.at_time.is_some()),
        ("--idempotency-key", options.idempotency_key.is_some()),
    ];
    let count = options.captures.len();
    match of_one.into_iter().find(|(_, is_given)| *is_given && count > 1) {
        Some((name, _)) => {
            let next = "update with one capture at a time";
            Err(Failure::usage(format!("{name} belongs to one photo: expected one capture, found {count}; {next}")))
        }
        None => Ok(()),
    }
}

/// The plugins of one run.
struct Tools {
    choices: Choices,
    segmenting: Option<Segmenting>,
    matcher: Matching,
    comparers: Comparers,
}

/// What finds and measures changes where the pose is known.
pub(super) struct Comparers {
    pub(super) detector: Detector,
    pub(super) estimator: Estimator,
    /// Every plugin of the run for the evidence, in the order in which they are called.
    pub(super) used: Vec<PluginUse>,
}

impl Tools {
    fn load(options: &Update, plugins: &PluginSearch) -> Result<Self, Failure> {
        let registry = registry(plugins)?;
        let names = [options.matcher.as_str(), options.detector.as_str(), options.estimator.as_str()];
        let all: Vec<&str> = options.labels.segmenter.as_deref().into_iter().chain(names).collect();
        let choices = Choices::read(&options.settings, &all)?;
        let segmenting = Segmenting::load(&options.labels, &options.prior, &registry, &choices)?;
        let load = |name: &str| -> Result<Tool, Failure> { choices.tool(&tools::load(&registry, name)?) };
        let matcher = MatchingTool::load(&registry, &choices, names[0])?;
        let [detector, estimator] = [load(names[1])?, load(names[2])?];
        let mut used: Vec<PluginUse> = segmenting.iter().map(|one| one.used.clone()).collect();
        used.extend(matcher.used()?);
        used.extend([detector.used()?, estimator.used()?]);
        Ok(Self {
            matcher: matcher.matching()?,
            comparers: Comparers {
                detector: detector.plugin.detector(&detector.settings)?,
                estimator: estimator.plugin.estimator(&estimator.settings)?,
                used,
            },
            choices,
            segmenting,
        })
    }
}

/// One capture on one map.
pub(super) struct Run<'a> {
    pub(super) map: &'a MapFile,
    pub(super) crs: Crs,
    pub(super) recording: Recording<'a>,
    /// Milliseconds of each stage.
    pub(super) timings: Map<String, Value>,
    /// Whether the plugins are ended before the commit, so that one that crashes then changes nothing.
    pub(super) is_last: bool,
}

/// What the map keeps of a run, and who says so.
#[derive(Clone, Copy)]
pub(super) struct Recording<'a> {
    pub(super) dry_run: bool,
    pub(super) keep_labels: bool,
    pub(super) message: Option<&'a str>,
    pub(super) author: &'a str,
    pub(super) idempotency_key: Option<&'a str>,
    pub(super) review: Option<Review>,
    /// How far around the prior the pose is looked for.
    pub(super) search: Option<SearchRange>,
}

/// A capture that was read, and the map around it.
pub(super) struct Work {
    pub(super) base: VersionId,
    pub(super) capture: Capture,
    pub(super) world: World,
    /// The `prior` of the result.
    pub(super) prior: Value,
}

/// What one capture came to.
pub(super) struct Outcome {
    pub(super) located: Located,
    pub(super) resolution: Resolution,
    pub(super) viewed_region: Option<BoxMm>,
    /// `None` where the pose is not reliable.
    seen: Option<Seen>,
}

impl Run<'_> {
    fn capture(
        &mut self,
        path: &Path,
        (given, prior): (Option<GivenPose>, &PriorFrom),
        tools: &mut Tools,
        reports: Option<&mut Reports>,
        console: &mut Console<'_>,
    ) -> Result<(Value, u8), Failure> {
        console.go_on()?;
        let photo = prior.photo.as_deref().filter(|_| tools.segmenting.is_some());
        if let Some(document) = repeated(self.map, self.recording.idempotency_key, path, photo)? {
            if !console.is_json() {
                console.line(format_args!("{}: committed before, version {}", path.display(), document["version"]))?;
            }
            return Ok((document, 0));
        }
        let from = (prior, tools.segmenting.as_mut());
        let work = self.read(path, given.map(|given| given.pose), from, console)?;
        let located = self.locate(&work.world, &work.capture, given, tools, console)?;
        let (outcome, committed) = self.conclude(&work, located, given.is_some(), &mut tools.comparers, console)?;
        if let Some(version) = committed.version {
            console.did(format_args!("version {version} was committed"));
        }
        let used = (tools.matcher.info(), tools.comparers.used.as_slice());
        let told = self.told(path, &work, &outcome, &committed, used)?;
        if !console.is_json() {
            told::summary(path, &told.document, &outcome, console)?;
            console.out().flush()?;
        }
        if let Some(reports) = reports {
            reports.add(&Sheet {
                path,
                map: self.map.path(),
                document: &told.document,
                changes: &told.own,
                capture: &work.capture,
                world: &work.world,
                located: &outcome.located,
                resolution: &outcome.resolution,
                seen: outcome.seen.as_ref(),
            });
        }
        Ok((told.document, told.code))
    }

    /// Reads the capture at `path` and the map around it.
    pub(super) fn read(
        &mut self,
        path: &Path,
        given: Option<Pose>,
        from: (&PriorFrom, Option<&mut Segmenting>),
        console: &mut Console<'_>,
    ) -> Result<Work, Failure> {
        let base = self.map.head()?;
        let snapshot = self.map.snapshot(base)?;
        let stage = console.stage("read");
        let placed = read_placed(path, from, given, (&snapshot, self.crs), console);
        self.timings.insert("read".to_owned(), json!(console.finish(&stage)));
        let Placed { capture, world, prior } = placed?;
        Ok(Work { base, capture, world, prior })
    }

    /// Finds what changed, where the pose is reliable, and commits it.
    pub(super) fn conclude(
        &mut self,
        work: &Work,
        located: Located,
        is_given: bool,
        comparers: &mut Comparers,
        console: &mut Console<'_>,
    ) -> Result<(Outcome, Committed), Failure> {
        let (resolution, viewed_region, seen) = if located.is_reliable() {
            let (resolution, region, seen) = self.compare(&work.world, &work.capture, &located, comparers, console)?;
            (resolution, region, Some(seen))
        } else {
            (Resolution::default(), None, None)
        };
        let outcome = Outcome { located, resolution, viewed_region, seen };
        if self.is_last {
            comparers.detector.finish()?;
            comparers.estimator.finish()?;
        }
        console.go_on()?;
        let stage = console.stage("commit");
        let committed = self.commit(work.base, &work.capture, is_given, &outcome, &comparers.used);
        self.timings.insert("commit".to_owned(), json!(console.finish(&stage)));
        Ok((outcome, committed?))
    }

    fn locate(
        &mut self,
        world: &World,
        capture: &Capture,
        given: Option<GivenPose>,
        tools: &mut Tools,
        console: &mut Console<'_>,
    ) -> Result<Located, Failure> {
        if let Some(given) = given {
            return Ok(given_pose(world, given, &tools.choices.gate));
        }
        let stage = console.stage("localize");
        let services = SceneServices::new(world, capture, self.crs, &stage);
        let located = localize(&mut tools.matcher, &services, &tools.choices.gate, &tools.choices.search);
        let ended = if self.is_last && located.is_ok() { tools.matcher.finish() } else { Ok(()) };
        // What the matcher said comes before why it failed.
        self.timings.insert("localize".to_owned(), json!(console.finish(&stage)));
        let located = located?;
        ended?;
        Ok(located)
    }

    /// Finds and measures what differs from the map, seen from where the photo stood.
    pub(super) fn compare(
        &mut self,
        world: &World,
        capture: &Capture,
        located: &Located,
        comparers: &mut Comparers,
        console: &mut Console<'_>,
    ) -> Result<(Resolution, Option<BoxMm>, Seen), Failure> {
        let mut time = |name: &'static str, console: &mut Console<'_>, stage: &Stage| {
            self.timings.insert(name.to_owned(), json!(console.finish(stage)));
        };
        let stage = console.stage("view");
        let scene = world.scene(true);
        let view = view(scene, &capture.camera, &located.localization.pose);
        let estimate = pose_estimate(&located.localization, capture);
        let comparison = Comparison { capture, view: &view, scene, estimate };
        time("view", console, &stage);
        let stage = console.stage("detect");
        let services = SceneServices::new(world, capture, self.crs, &stage);
        let regions = comparison.detect(&mut comparers.detector, &services);
        time("detect", console, &stage);
        let regions = regions?;
        let stage = console.stage("estimate");
        let services = SceneServices::new(world, capture, self.crs, &stage);
        let proposals = comparison.estimate(&mut comparers.estimator, &services, &regions);
        time("estimate", console, &stage);
        let proposals = proposals?;
        let resolution = resolve(proposals.clone(), &regions, world.descriptors());
        let viewed_region = comparison.viewed_region();
        Ok((resolution, viewed_region, Seen { view, regions, proposals }))
    }

    /// Commits the changes, or records the attempt; a dry run does neither.
    fn commit(
        &self,
        base: VersionId,
        capture: &Capture,
        is_given: bool,
        outcome: &Outcome,
        used: &[PluginUse],
    ) -> Result<Committed, Failure> {
        let decision = match (outcome.located.is_reliable(), outcome.resolution.changes.is_empty()) {
            (false, _) => Decision::Unreliable,
            (true, true) => Decision::Nothing,
            (true, false) => Decision::Committed,
        };
        if self.recording.dry_run {
            return Ok(Committed::nothing(decision));
        }
        let evidence = self.evidence(capture, is_given, outcome, used, decision);
        let now = Timestamp::now();
        if decision != Decision::Committed {
            self.map.record_observation(base, &evidence, now)?;
            return Ok(Committed::nothing(decision));
        }
        if let Some(review) = self.recording.review {
            return self.put_forward(review, (base, capture), &evidence, outcome);
        }
        let message = self.recording.message.map_or_else(|| message_of(&outcome.resolution.changes), ToOwned::to_owned);
        let mut transaction = UpdateTransaction::new(base, VersionKind::Update, self.recording.author, message);
        transaction.observed_at = capture.taken_at;
        transaction.viewed_region = outcome.viewed_region;
        transaction.evidence = Some(evidence);
        transaction.idempotency_key = self.recording.idempotency_key.map(ToOwned::to_owned);
        transaction.request = Some(capture.digest);
        add_changes(&mut transaction, &outcome.resolution.changes);
        let committed = self.map.commit_once(&transaction, now);
        let Made { version, repeated } = committed.map_err(|error| refused(error, self.map, &transaction.deltas))?;
        let changes = self.map.changes_of(version)?;
        let fids = changes.iter().filter(|delta| delta.before().is_none()).map(|delta| delta.fid().0).collect();
        Ok(Committed { version: Some(version), fids, repeated, ..Committed::nothing(decision) })
    }

    fn evidence(
        &self,
        capture: &Capture,
        is_given: bool,
        outcome: &Outcome,
        used: &[PluginUse],
        decision: Decision,
    ) -> Observation {
        let (localization, matcher) = (&outcome.located.localization, Kind::Matcher.to_string());
        Observation {
            capture: capture.digest,
            photo: Some(capture.photo_digest()),
            taken_at: capture.taken_at,
            labels: self.recording.keep_labels.then(|| capture.label_bytes.clone()),
            prior: Some(capture.prior),
            camera: Some(capture.camera.intrinsics()),
            search: self.recording.search.filter(|_| !is_given),
            localization: Some(LocalizationEvidence {
                pose: localization.pose,
                score: (!is_given).then_some(localization.score),
                covariance: localization.covariance,
                alignment: localization.alignment,
                runner_up: localization.runner_up,
                candidates: localization.candidates,
            }),
            plugins: used.iter().filter(|used| !is_given || used.kind != matcher).cloned().collect(),
            gates: outcome.located.gates.clone(),
            rejections: outcome.resolution.rejections.clone(),
            decision,
            confirmations: Vec::new(),
        }
    }
}

/// What became of the changes.
pub(super) struct Committed {
    pub(super) decision: Decision,
    pub(super) version: Option<VersionId>,
    pub(super) fids: Vec<u64>,
    pub(super) proposals: Vec<u64>,
    /// Those of the proposals that somebody decided before, and how.
    pub(super) decided: Vec<(u64, &'static str)>,
    /// What the version did, where that is not what this capture saw alone.
    pub(super) did: Option<Vec<Delta>>,
    /// Whether the same request made the version before.
    pub(super) repeated: bool,
}

impl Committed {
    pub(super) fn nothing(decision: Decision) -> Self {
        Self {
            decision,
            version: None,
            fids: Vec::new(),
            proposals: Vec::new(),
            decided: Vec::new(),
            did: None,
            repeated: false,
        }
    }
}

/// A pose that was given passes the gates, except inside a building: what it sees from there is no street.
fn given_pose(world: &World, given: GivenPose, limits: &GateLimits) -> Located {
    let GivenPose { pose, covariance, alignment } = given;
    let exact = exactly(pose);
    let covariance = covariance.unwrap_or(exact.covariance);
    let mut located = Located::new(Localization { covariance, alignment, ..exact }, limits);
    if inside_solid(world.scene(true), pose.position) {
        return located.inside_building("the pose that was given");
    }
    located.gates.push(inside_building(true));
    located
}

/// A pose that was given is taken at its word.
pub(super) fn exactly(pose: Pose) -> Localization {
    Localization {
        pose,
        score: 1.0,
        covariance: [[0.0; 3]; 3],
        alignment: None,
        runner_up: None,
        candidates: 0,
        skipped: 0,
        heat: Vec::new(),
    }
}

pub(super) fn message_of(changes: &[Change]) -> String {
    let count = |pick: fn(&Change) -> bool| changes.iter().filter(|change| pick(change)).count();
    let added = count(|change| matches!(change, Change::Add(_)));
    let modified = count(|change| matches!(change, Change::Modify { .. }));
    let removed = count(|change| matches!(change, Change::Remove { .. }));
    format!("update: {added} added, {modified} modified, {removed} removed")
}
