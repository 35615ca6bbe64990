//! `resurvey replay`.

mod builds;

use super::crs_of;
use super::update::{Comparers, Recording, Run, Work, exactly};
use crate::args::{PluginSearch, Replay};
use crate::console::Console;
use crate::document;
use crate::failure::{Failure, MISSING, PLUGIN};
use crate::tools::registry;
use anyhow::anyhow;
use builds::Tools;
use resurvey_core::camera::{Camera, world_from_camera};
use resurvey_core::capture::Capture;
use resurvey_core::image::{LabelReading, read_labels};
use resurvey_core::localize::{GateLimits, Located, SceneServices, SearchLimits, localize};
use resurvey_core::plugin::Kind;
use resurvey_core::store::{History, MapFile, RecordedObservation, Snapshot};
use resurvey_core::update::{Change, Resolution, add_changes, world_around};
use resurvey_core::version::{
    Delta, FeatureState, LocalizationEvidence, PluginUse, UpdateTransaction, VersionId, VersionKind,
};
use resurvey_schema::{ClassTable, Localization, Pose, Rejection};
use serde_json::{Map, Value, json};

/// Poses nearer than this are the same, metres and degrees: what is left of a height that came from the ground.
const SAME_POSE: (f64, f64) = (0.001, 0.001);
/// Measured numbers nearer than this share of them are the same, for the same reason.
const SAME_SHARE: f64 = 1e-6;

/// Runs the plugins of a version again on what it saw, and compares.
pub fn run(options: &Replay, plugins: &PluginSearch, console: &mut Console<'_>) -> Result<u8, Failure> {
    console.listen();
    let map = MapFile::open_read_only(&options.map)?;
    let version = map.resolve(&options.revision)?;
    let recorded = evidence(&map, version)?;
    let tools = Tools::load(&recorded, &mut registry(plugins)?, options)?;
    let snapshot = map.snapshot(recorded.base)?;
    let capture = capture(&map, &snapshot, &recorded, options)?;
    let replayed = replay(&map, capture, &recorded, tools, console)?;
    let document = compare(&map, version, &recorded, &replayed)?;
    let is_same = document["same"] == json!(true);
    if console.is_json() {
        console.document(&document)?;
    } else {
        print(&document, console)?;
    }
    Ok(if is_same { 0 } else { PLUGIN })
}

/// The observation of a version that was made from one.
fn evidence(map: &MapFile, version: VersionId) -> Result<RecordedObservation, Failure> {
    let kind = map.version(version)?.kind.name();
    map.observation_of(version)?.ok_or_else(|| {
        let text =
            format!("version {version} is of kind {kind} and was not made from a capture; there is nothing to replay");
        Failure::new(MISSING, anyhow!(text))
    })
}

/// What was seen: out of the map, or from the file whose digest was recorded.
fn capture(
    map: &MapFile,
    snapshot: &Snapshot<'_>,
    recorded: &RecordedObservation,
    options: &Replay,
) -> Result<Capture, Failure> {
    let seen = &recorded.observation;
    let segmenter = seen.plugins.iter().find(|used| used.kind == Kind::Segmenter.to_string());
    if let (Some(path), Some(segmenter)) = (&options.capture, segmenter) {
        return Err(Failure::input(format!(
            "{}: the labels were made by the segmenter {}, which is not run again: leave out --capture, which works where \
             update --keep-labels kept them",
            path.display(),
            segmenter.name
        )));
    }
    if let Some(path) = &options.capture {
        let mut capture = Capture::labelled(path, snapshot.classes())?;
        if capture.digest != seen.capture {
            let (place, expected, found) = (path.display(), seen.capture, capture.digest);
            return Err(Failure::input(format!(
                "{place}: not what was seen: expected a capture with digest {expected}, found {found}"
            )));
        }
        capture.prior = seen.prior.unwrap_or(capture.prior);
        capture.taken_at = seen.taken_at;
        return Ok(capture);
    }
    let kept = recorded.labels.map(|digest| map.label_image(digest)).transpose()?.flatten();
    let (Some(label_bytes), Some(camera), Some(prior)) = (kept, seen.camera, seen.prior) else {
        return Err(not_kept(recorded, segmenter));
    };
    let damaged = |error: &dyn std::fmt::Display| {
        Failure::new(crate::failure::MAP, anyhow!("{}: observation {}: {error}", map.path().display(), recorded.id))
    };
    let labels =
        read_labels(&label_bytes, snapshot.classes(), &LabelReading::default()).map_err(|error| damaged(&error))?;
    let camera = Camera::new(camera).map_err(|error| damaged(&error))?;
    Ok(Capture { labels, label_bytes, camera, prior, taken_at: seen.taken_at, digest: seen.capture })
}

fn not_kept(recorded: &RecordedObservation, segmenter: Option<&PluginUse>) -> Failure {
    let what = if recorded.observation.camera.is_none() { "the camera" } else { "the label image" };
    let next = match segmenter {
        Some(segmenter) => format!("the segmenter {} made it and is not run again", segmenter.name),
        None => "give the capture: --capture CAPTURE.json".to_owned(),
    };
    let id = recorded.id;
    let text = format!(
        "the map did not keep {what} of observation {id}; {next} (update --keep-labels keeps what replay needs)"
    );
    Failure::new(MISSING, anyhow!(text))
}

/// What the plugins answer now.
struct Replayed {
    located: Located,
    changes: Vec<Change>,
    rejections: Vec<Rejection>,
    builds: Vec<Value>,
    was_given: bool,
}

fn replay(
    map: &MapFile,
    capture: Capture,
    recorded: &RecordedObservation,
    tools: Tools,
    console: &mut Console<'_>,
) -> Result<Replayed, Failure> {
    let crs = crs_of(map)?;
    let seen = &recorded.observation;
    let found = seen
        .localization
        .as_ref()
        .ok_or_else(|| Failure::new(MISSING, anyhow!("observation {} has no pose to compare with", recorded.id)))?;
    let was_given = tools.matcher.is_none();
    let place = if was_given { found.pose.position } else { capture.prior.pose.position };
    let world = world_around(&map.snapshot(recorded.base)?, place)?;
    let located = match &tools.matcher {
        None => Located::new(given(found), &GateLimits::default()),
        Some(matcher) => {
            let stage = console.stage("localize");
            let services = SceneServices::new(&world, &capture, crs, &stage);
            let search = seen.search.map_or_else(SearchLimits::default, |range| SearchLimits {
                radius_m: range.radius_m,
                yaw_range_deg: range.yaw_range_deg,
            });
            let mut matcher = matcher.matching()?;
            localize(&mut matcher, &services, &GateLimits::default(), &search)?
        }
    };
    let mut comparers = Comparers {
        detector: tools.detector.plugin.detector(&tools.detector.settings)?,
        estimator: tools.estimator.plugin.estimator(&tools.estimator.settings)?,
        used: Vec::new(),
    };
    let recording = Recording {
        dry_run: true,
        keep_labels: false,
        message: None,
        author: "replay",
        idempotency_key: None,
        review: None,
        search: None,
    };
    let mut run = Run { map, crs, recording, timings: Map::new(), is_last: true };
    let work = Work { base: recorded.base, capture, world, prior: Value::Null };
    let (resolution, _, _) = run.compare(&work.world, &work.capture, &located, &mut comparers, console)?;
    let Resolution { changes, rejections, .. } = resolution;
    Ok(Replayed { located, changes, rejections, builds: tools.builds, was_given })
}

/// A pose that was given, with what was said of it.
fn given(found: &LocalizationEvidence) -> Localization {
    Localization { covariance: found.covariance, alignment: found.alignment, ..exactly(found.pose) }
}

fn compare(
    map: &MapFile,
    version: VersionId,
    recorded: &RecordedObservation,
    replayed: &Replayed,
) -> Result<Value, Failure> {
    let seen = &recorded.observation;
    let found = &replayed.located.localization;
    let then = seen.localization.as_ref().map_or(found.pose, |localization| localization.pose);
    let (distance_m, angle_deg) = apart(&then, &found.pose);
    let is_same_pose = distance_m <= SAME_POSE.0 && angle_deg <= SAME_POSE.1;
    // Of a version that several captures confirmed, one alone says something else.
    let is_fused = !seen.confirmations.is_empty();
    let snapshot = map.snapshot(recorded.base)?;
    let (missing, new) = match is_fused {
        true => (Vec::new(), Vec::new()),
        false => differing(&map.changes_of(version)?, &replayed.changes),
    };
    let classes = snapshot.classes();
    let (no_more, not_then) = other_rejections(&seen.rejections, &replayed.rejections);
    let is_same_rejected = no_more.is_empty() && not_then.is_empty();
    let is_same = is_same_pose && missing.is_empty() && new.is_empty() && is_same_rejected;
    let states = |states: &[Side]| states.iter().map(|side| side.document(classes)).collect::<Result<Vec<_>, _>>();
    let rejections = |some: &[&Rejection]| -> Vec<Value> {
        some.iter().map(|rejection| document::rejection(rejection, classes)).collect()
    };
    Ok(json!({
        "version": version.0,
        "base_version": recorded.base.0,
        "observation": recorded.id,
        "same": is_same,
        "plugins": replayed.builds,
        "pose": {
            "given": replayed.was_given, "recorded": then, "found": found.pose, "distance_m": distance_m,
            "angle_deg": angle_deg, "same": is_same_pose,
            "recorded_score": seen.localization.as_ref().and_then(|localization| localization.score),
            "found_score": (!replayed.was_given).then_some(found.score),
        },
        "changes": {
            "compared": !is_fused, "missing": states(&missing)?, "new": states(&new)?,
            "rejections": {
                "recorded": seen.rejections.len(), "found": replayed.rejections.len(), "same": is_same_rejected,
                "missing": rejections(&no_more), "new": rejections(&not_then),
            },
        },
    }))
}

fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    let offset = |one: f64, other: f64| one - other;
    let (p, q) = (a.position, b.position);
    let distance = offset(p.easting_m, q.easting_m)
        .hypot(offset(p.northing_m, q.northing_m))
        .hypot(offset(p.height_m, q.height_m));
    (distance, world_from_camera(a).angle_to(&world_from_camera(b)).to_degrees())
}

/// One change, without the number of what is new.
struct Side {
    fid: Option<u64>,
    before: Option<FeatureState>,
    after: Option<FeatureState>,
}

impl Side {
    fn of(delta: &Delta) -> Self {
        let fid = delta.before().map(|_| delta.fid().0);
        Self { fid, before: delta.before().cloned(), after: delta.after().cloned() }
    }

    fn is_same_as(&self, other: &Self) -> bool {
        let same = |one: &Option<FeatureState>, other: &Option<FeatureState>| match (one, other) {
            (Some(one), Some(other)) => one.is_same_as(other),
            (None, None) => true,
            _ => false,
        };
        self.fid == other.fid && same(&self.before, &other.before) && same(&self.after, &other.after)
    }

    fn document(&self, classes: &ClassTable) -> Result<Value, Failure> {
        let state =
            |state: &Option<FeatureState>| state.as_ref().map(|state| document::state(state, classes)).transpose();
        Ok(json!({ "fid": self.fid, "before": state(&self.before)?, "after": state(&self.after)? }))
    }
}

/// What the version did that is not found again, and the other way round.
fn differing(did: &[Delta], found: &[Change]) -> (Vec<Side>, Vec<Side>) {
    let mut transaction = UpdateTransaction::new(VersionId(0), VersionKind::Update, "", "");
    add_changes(&mut transaction, found);
    let additions = transaction.additions.into_iter().map(|state| Side { fid: None, before: None, after: Some(state) });
    let mut new: Vec<Side> = additions.chain(transaction.deltas.iter().map(Side::of)).collect();
    let mut missing = Vec::new();
    for side in did.iter().map(Side::of) {
        match new.iter().position(|other| other.is_same_as(&side)) {
            Some(index) => {
                new.remove(index);
            }
            None => missing.push(side),
        }
    }
    (missing, new)
}

/// Rejections that are not found again, and the other way round.
fn other_rejections<'a>(then: &'a [Rejection], now: &'a [Rejection]) -> (Vec<&'a Rejection>, Vec<&'a Rejection>) {
    let (mut new, mut missing): (Vec<&Rejection>, Vec<&Rejection>) = (now.iter().collect(), Vec::new());
    for rejection in then {
        match new.iter().position(|other| is_same_rejection(rejection, other)) {
            Some(index) => {
                new.remove(index);
            }
            None => missing.push(rejection),
        }
    }
    (missing, new)
}

/// The same words, and the same numbers as far as poses are the same.
fn is_same_rejection(a: &Rejection, b: &Rejection) -> bool {
    let near = |a: f64, b: f64| (a - b).abs() <= SAME_SHARE * a.abs().max(b.abs());
    let words =
        |one: &Rejection| (one.class_before, one.class_after, one.pixels, one.requirement.clone(), one.unit.clone());
    words(a) == words(b) && near(a.measured, b.measured) && near(a.limit, b.limit)
}

fn print(document: &Value, console: &mut Console<'_>) -> Result<(), Failure> {
    let verdict = if document["same"] == json!(true) { "the same" } else { "not the same" };
    console
        .line(format_args!("version {}, observation {}: {verdict}", document["version"], document["observation"]))?;
    for build in document["plugins"].as_array().into_iter().flatten() {
        let word = |key: &str| build[key].as_str().unwrap_or_default().to_owned();
        let note = if build["same"] == json!(true) { "" } else { ", another build than recorded" };
        console.line(format_args!("  {:9} {} {}{note}", word("kind"), word("name"), word("found_sha256")))?;
    }
    let number = |value: &Value| value.as_f64().unwrap_or_default();
    let pose = &document["pose"];
    let how = if pose["given"] == json!(true) { "given" } else { "found" };
    let (distance_m, angle_deg) = (number(&pose["distance_m"]), number(&pose["angle_deg"]));
    console.line(format_args!("  pose      {how} {distance_m:.4} m and {angle_deg:.4} deg from the recorded one"))?;
    let changes = &document["changes"];
    let count = |key: &str| changes[key].as_array().map_or(0, Vec::len);
    if changes["compared"] == json!(true) {
        console.line(format_args!("  changes   {} missing, {} new", count("missing"), count("new")))?;
    } else {
        console.line("  changes   fused from several captures: not compared")?;
    }
    let rejections = &changes["rejections"];
    let others = |key: &str| rejections[key].as_array().map_or(0, Vec::len);
    let (now, then) = (&rejections["found"], &rejections["recorded"]);
    let text = format!("{now} now, {then} then: {} missing, {} new", others("missing"), others("new"));
    console.line(format_args!("  rejected  {text}"))
}
