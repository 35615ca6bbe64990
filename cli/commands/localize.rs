//! `resurvey localize`.

use super::crs_of;
use crate::args::{Localize, PluginSearch};
use crate::console::Console;
use crate::document;
use crate::failure::{Failure, UNRELIABLE};
use crate::matching::MatchingTool;
use crate::out_file::{check_file, delivered, write_file};
use crate::prior::{Placed, read_placed};
use crate::segment::Segmenting;
use crate::tools::{Choices, registry};
use resurvey_core::capture::{Capture, read_pose};
use resurvey_core::localize::{HeatMap, Located, SceneServices, heat_map, localize};
use resurvey_core::store::{History, MapFile};
use resurvey_schema::Pose;
use serde_json::{Map, Value, json};
use std::path::Path;

/// Finds the pose of a capture. Exit code 0 when it is reliable, 22 when it is not.
pub fn run(options: &Localize, plugins: &PluginSearch, console: &mut Console<'_>) -> Result<u8, Failure> {
    console.listen();
    // A search of minutes is not thrown away for the name of a file.
    options.heatmap.iter().chain(&options.out).try_for_each(|path| check_file(path))?;
    let registry = registry(plugins)?;
    let names: Vec<&str> = options.labels.segmenter.as_deref().into_iter().chain([options.matcher.as_str()]).collect();
    let mut choices = Choices::read(&options.settings, &names)?;
    if options.exhaustive {
        choices.exhaustive(&registry, &options.matcher)?;
    }
    let mut matcher = MatchingTool::load(&registry, &choices, &options.matcher)?.matching()?;
    let mut segmenting = Segmenting::load(&options.labels, &options.prior, &registry, &choices)?;
    let map = MapFile::open_read_only(&options.map)?;
    let snapshot = map.snapshot(map.resolve(&options.at)?)?;
    let crs = crs_of(&map)?;
    let truth = options.truth.as_deref().map(read_pose).transpose()?;
    let mut timings = Map::new();
    let stage = console.stage("read");
    let from = (&options.prior, segmenting.as_mut());
    let placed = read_placed(&options.capture, from, None, (&snapshot, crs), console);
    timings.insert("read".to_owned(), json!(console.finish(&stage)));
    let Placed { capture, world, prior } = placed?;
    let stage = console.stage("localize");
    let services = SceneServices::new(&world, &capture, crs, &stage);
    let located = localize(&mut matcher, &services, &choices.gate, &choices.search);
    // A plugin that crashes as it ends has not kept its word either.
    let ended = if located.is_ok() { matcher.finish() } else { Ok(()) };
    // What the matcher said comes before why it failed.
    timings.insert("localize".to_owned(), json!(console.finish(&stage)));
    let located = located?;
    ended?;
    let result = document::located(&located, matcher.info(), crs, (&prior, &timings));
    if console.is_json() {
        console.document(&result)?;
    } else {
        summary(&located, console)?;
    }
    let written = write(options, &located, &capture, truth, &result);
    delivered(if located.is_reliable() { 0 } else { UNRELIABLE }, written, console)
}

/// Writes the files that were named.
fn write(
    options: &Localize,
    located: &Located,
    capture: &Capture,
    truth: Option<Pose>,
    result: &Value,
) -> Result<(), Failure> {
    if let Some(path) = &options.heatmap {
        let picture = heat_map(&HeatMap {
            heat: &located.localization.heat,
            prior: capture.prior.pose,
            estimate: located.localization.pose,
            truth,
            covariance: located.localization.covariance,
            score: located.localization.score,
            title: &title(&options.capture, &options.matcher),
        })?;
        write_file(path, &picture)?;
    }
    options.out.as_ref().map_or(Ok(()), |path| write_file(path, &serde_json::to_vec_pretty(result)?))
}

fn title(capture: &Path, matcher: &str) -> String {
    let directory = capture.parent().and_then(Path::file_name).unwrap_or_default();
    format!("{} {matcher}", directory.to_string_lossy())
}

/// The result in a few lines.
pub fn summary(located: &Located, console: &mut Console<'_>) -> Result<(), Failure> {
    let localization = &located.localization;
    console.line(format_args!("pose       {}", pose_text(&localization.pose)))?;
    let [e, n, yaw] = [0, 1, 2].map(|axis| localization.covariance[axis][axis].max(0.0).sqrt());
    console.line(format_args!("1 sigma    {e:.2} m east, {n:.2} m north, {:.2}° heading", yaw.to_degrees()))?;
    let (candidates, skipped) = (localization.candidates, localization.skipped);
    console.line(format_args!(
        "score      {:.3} of {candidates} candidates, {skipped} inside buildings",
        localization.score
    ))?;
    if located.is_reliable() {
        return console.line("reliable   yes");
    }
    console.line(format_args!("reliable   no: {}", located.reasons.join("; ")))
}

/// A pose for people.
pub fn pose_text(pose: &Pose) -> String {
    let [e, n, h]: [f64; 3] = pose.position.into();
    let yaw = pose.yaw_rad.to_degrees().rem_euclid(360.0);
    let (pitch, roll) = (pose.pitch_rad.to_degrees(), pose.roll_rad.to_degrees());
    format!("E {e:.2} N {n:.2} H {h:.2} m, heading {yaw:.2}°, pitch {pitch:.2}°, roll {roll:.2}°")
}
