//! `resurvey why`.

use crate::args::Why;
use crate::commands::localize::pose_text;
use crate::console::Console;
use crate::document;
use crate::failure::Failure;
use crate::plain::plain;
use resurvey_core::store::{History, MapFile, Provenance, RecordedObservation};
use resurvey_core::version::{Fid, LocalizationEvidence, Observation, PluginUse, Side, VersionId};
use resurvey_schema::{ClassTable, Intrinsics};
use serde_json::{Value, json};

/// The evidence behind a feature, newest step first.
pub fn run(options: &Why, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open_read_only(&options.map)?;
    let steps = map.why(Fid(options.fid))?;
    let snapshot = map.snapshot(map.head()?)?;
    let classes = snapshot.classes();
    if console.is_json() {
        let steps = steps.iter().map(|step| document_of(&map, step, classes)).collect::<Result<Vec<_>, _>>()?;
        console.document(&json!({ "fid": options.fid, "steps": steps }))?;
        return Ok(0);
    }
    for step in &steps {
        print(&map, step, classes, console)?;
    }
    Ok(0)
}

fn document_of(map: &MapFile, step: &Provenance, classes: &ClassTable) -> Result<Value, Failure> {
    let side = |state: Option<&resurvey_core::version::FeatureState>| {
        state.map(|state| document::state(state, classes)).transpose()
    };
    Ok(json!({
        "op": step.step.name(),
        "version": document::version(&step.record),
        "before": side(step.step.before.state())?,
        "after": side(step.step.after.state())?,
        "observation": step.observation.as_ref().map(|seen| observation(map, seen, classes)).transpose()?,
        "reverted": step.record.reverts.map(|version| reverted(map, version, classes)).transpose()?,
    }))
}

/// The version that a step undoes, with its evidence.
fn reverted(map: &MapFile, version: VersionId, classes: &ClassTable) -> Result<Value, Failure> {
    let seen = map.observation_of(version)?;
    Ok(json!({
        "version": document::version(&map.version(version)?),
        "observation": seen.map(|seen| observation(map, &seen, classes)).transpose()?,
    }))
}

/// An observation with those it was confirmed by.
pub(super) fn observation(
    map: &MapFile,
    recorded: &RecordedObservation,
    classes: &ClassTable,
) -> Result<Value, Failure> {
    let mut document = single(recorded, classes);
    let mut confirmed_by = Vec::new();
    for digest in &recorded.observation.confirmations {
        confirmed_by.push(map.observation_named(*digest)?.map(|seen| single(&seen, classes)));
    }
    document["confirmed_by"] = json!(confirmed_by);
    Ok(document)
}

fn single(recorded: &RecordedObservation, classes: &ClassTable) -> Value {
    let Observation {
        capture,
        taken_at,
        prior,
        camera,
        search,
        localization,
        plugins,
        gates,
        rejections,
        decision,
        ..
    } = &recorded.observation;
    json!({
        "id": recorded.id,
        "sha256": recorded.digest.to_string(),
        "capture_sha256": capture.to_string(),
        "taken_at": taken_at.map(|time| time.to_string()),
        "recorded_at": recorded.recorded_at.to_string(),
        "labels_sha256": recorded.labels.map(|digest| digest.to_string()),
        "prior": prior.map(|prior| json!({
            "pose": prior.pose,
            "position_sigma_m": prior.position_sigma_m,
            "height_sigma_m": prior.height_sigma_m,
            "yaw_sigma_deg": prior.yaw_sigma_rad.to_degrees(),
            "tilt_sigma_deg": prior.tilt_sigma_rad.to_degrees(),
        })),
        "camera": camera.as_ref().map(|camera| json!({
            "model": camera.model.name(), "width": camera.width, "height": camera.height, "fx": camera.fx,
            "fy": camera.fy, "cx": camera.cx, "cy": camera.cy, "distortion": camera.distortion,
        })),
        "search": search.map(|search| json!({
            "radius_m": search.radius_m, "yaw_range_deg": search.yaw_range_deg,
        })),
        "localization": localization.as_ref().map(|found| json!({
            "pose": found.pose,
            "score": found.score,
            "covariance": found.covariance,
            "alignment": found.alignment,
            "runner_up": found.runner_up.map(|other| json!({
                "distance_m": other.distance_m, "score_ratio": other.score_ratio,
            })),
            "candidates": found.candidates,
        })),
        "plugins": plugins.iter().map(document::plugin_use).collect::<Vec<_>>(),
        "gates": document::gates(gates),
        "rejections": rejections.iter().map(|rejection| document::rejection(rejection, classes)).collect::<Vec<_>>(),
        "decision": decision.name(),
    })
}

fn print(map: &MapFile, step: &Provenance, classes: &ClassTable, console: &mut Console<'_>) -> Result<(), Failure> {
    let record = &step.record;
    let (version, kind, author) = (record.version, record.kind.name(), plain(&record.author));
    let op = step.step.name().unwrap_or("unknown, forgotten,");
    console.line(format_args!("version {version}: {op} by {kind}, {author}, {}", record.committed_at))?;
    console.line(format_args!("  message   {}", plain(&record.message)))?;
    console.line(format_args!("  hash      {}", record.hash))?;
    for (name, side) in [("before", &step.step.before), ("after", &step.step.after)] {
        match side {
            Side::State(state) => console.line(format_args!("  {name:9} {}", super::diff::words(state, classes)))?,
            Side::Forgotten => console.line(format_args!("  {name:9} unknown, forgotten"))?,
            Side::Absent => {}
        }
    }
    if let Some(reverted) = record.reverts {
        let message = map.version(reverted)?.message;
        console.line(format_args!("  undoes    version {reverted}: {}", plain(&message)))?;
        if let Some(seen) = map.observation_of(reverted)? {
            print_observation(map, &seen, classes, console)?;
        }
        return Ok(());
    }
    match &step.observation {
        Some(recorded) => print_observation(map, recorded, classes, console),
        None => console.line("  evidence  none: not made from a capture"),
    }
}

/// Prints an observation, and those it was confirmed by.
pub(super) fn print_observation(
    map: &MapFile,
    recorded: &RecordedObservation,
    classes: &ClassTable,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    print_single(recorded, classes, console)?;
    let confirmations = &recorded.observation.confirmations;
    for (place, digest) in confirmations.iter().enumerate() {
        console.line(format_args!("  confirmed {} of {}", place + 1, confirmations.len()))?;
        match map.observation_named(*digest)? {
            Some(seen) => print_single(&seen, classes, console)?,
            None => console.line(format_args!("  evidence  {digest} is not in the map"))?,
        }
    }
    Ok(())
}

fn print_single(
    recorded: &RecordedObservation,
    classes: &ClassTable,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let seen = &recorded.observation;
    let taken = seen.taken_at.map_or_else(|| "unknown".to_owned(), |time| time.to_string());
    console.line(format_args!("  capture   sha256 {}, taken {taken}", seen.capture))?;
    if let Some(digest) = recorded.labels {
        console.line(format_args!("  labels    sha256 {digest}"))?;
    }
    print_input(seen, console)?;
    if let Some(found) = &seen.localization {
        print_pose(found, console)?;
    }
    for gate in &seen.gates {
        let verdict = if gate.passed { "passed" } else { "failed" };
        console.line(format_args!(
            "  gate      {} {:.3} {}, limit {:.3}: {verdict}",
            gate.name, gate.measured, gate.unit, gate.limit
        ))?;
    }
    for used in &seen.plugins {
        print_plugin(used, console)?;
    }
    for rejection in &seen.rejections {
        let (before, after) = (classes.name(rejection.class_before), classes.name(rejection.class_after));
        console.line(format_args!(
            "  rejected  {before} -> {after}, {} px: {} is {:.3} {}, limit {:.3}",
            rejection.pixels,
            plain(&rejection.requirement),
            rejection.measured,
            plain(&rejection.unit),
            rejection.limit
        ))?;
    }
    Ok(())
}

/// Camera, prior, and how far around it the pose was looked for.
fn print_input(seen: &Observation, console: &mut Console<'_>) -> Result<(), Failure> {
    if let Some(camera) = &seen.camera {
        let Intrinsics { width, height, fx, fy, cx, cy, distortion, .. } = camera;
        console.line(format_args!("  camera    {}, {width} x {height} px", camera.model.name()))?;
        console.line(format_args!("            fx {fx} fy {fy} cx {cx} cy {cy}, distortion {distortion:?}"))?;
    }
    if let Some(prior) = &seen.prior {
        console.line(format_args!("  prior     {}", pose_text(&prior.pose)))?;
        console.line(format_args!(
            "            1 sigma {:.2} m in plan, {:.2} m in height, {:.1}° heading, {:.1}° tilt",
            prior.position_sigma_m,
            prior.height_sigma_m,
            prior.yaw_sigma_rad.to_degrees(),
            prior.tilt_sigma_rad.to_degrees()
        ))?;
    }
    if let Some(search) = &seen.search {
        console.line(format_args!("  search    {} m and {}° around it", search.radius_m, search.yaw_range_deg))?;
    }
    Ok(())
}

fn print_pose(found: &LocalizationEvidence, console: &mut Console<'_>) -> Result<(), Failure> {
    console.line(format_args!("  pose      {}", pose_text(&found.pose)))?;
    let [e, n, yaw] = [0, 1, 2].map(|axis| found.covariance[axis][axis].max(0.0).sqrt());
    let score = found.score.map_or_else(|| "none: the pose was given".to_owned(), |score| format!("{score:.4}"));
    let yaw_deg = yaw.to_degrees();
    console.line(format_args!("            score {score}, 1 sigma E {e:.3} m N {n:.3} m heading {yaw_deg:.3}°"))?;
    if let Some(aligned) = &found.alignment {
        let [height, pitch, roll] = [3, 4, 5].map(|axis| aligned.covariance[axis][axis].max(0.0).sqrt());
        let (pitch_deg, roll_deg) = (pitch.to_degrees(), roll.to_degrees());
        console.line(format_args!(
            "            aligned: 1 sigma H {height:.3} m pitch {pitch_deg:.3}° roll {roll_deg:.3}°, walls {:.3} m off the map, \
             contours {:.3} px",
            aligned.map_sigma_m, aligned.label_sigma_px
        ))?;
    }
    if let Some(other) = found.runner_up {
        let (distance_m, ratio) = (other.distance_m, other.score_ratio);
        console.line(format_args!("            runner-up {distance_m:.1} m away, {ratio:.3} of the score"))?;
    }
    Ok(())
}

fn print_plugin(used: &PluginUse, console: &mut Console<'_>) -> Result<(), Failure> {
    let sha256 = used.sha256.map_or_else(|| "built in".to_owned(), |digest| digest.to_string());
    let (name, version) = (plain(&used.name), plain(&used.version));
    console.line(format_args!("  {:9} {name} {version} {sha256}", used.kind))?;
    let digest = used.settings_sha256.map_or_else(String::new, |digest| format!(", sha256 {digest}"));
    let settings = used.settings.to_string();
    console.line(format_args!("            settings {}{digest}", plain(&settings)))?;
    for file in &used.files {
        console.line(format_args!("            {} sha256 {}", plain(&file.setting), file.sha256))?;
    }
    Ok(())
}
