//! Reading a capture with its prior, wherever that is written, and the map around it.

use crate::args::PriorFrom;
use crate::console::Console;
use crate::failure::Failure;
use crate::segment::Segmenting;
use resurvey_core::capture::{Capture, PriorOrigin, PriorReport, PriorSource, RoughCapture};
use resurvey_core::crs::Crs;
use resurvey_core::localize::World;
use resurvey_core::store::Snapshot;
use resurvey_core::update::world_around;
use resurvey_schema::Pose;
use serde_json::{Value, json};
use std::path::Path;

/// A capture and the map around it.
pub struct Placed {
    /// The capture.
    pub capture: Capture,
    /// The map around its prior, or around the pose that was given.
    pub world: World,
    /// The `prior` of the result.
    pub prior: Value,
}

/// Reads the capture at `path`, with what `from` names and the labels that `segmenting` makes, if any, and the map around
/// `given` or else around its prior.
pub fn read_placed(
    path: &Path,
    (from, segmenting): (&PriorFrom, Option<&mut Segmenting>),
    given: Option<Pose>,
    (snapshot, crs): (&Snapshot<'_>, Crs),
    console: &mut Console<'_>,
) -> Result<Placed, Failure> {
    let classes = snapshot.classes();
    let rough = match segmenting {
        Some(segmenting) => {
            let photo = segmenting.segment(path, classes, console)?;
            RoughCapture::read_labelled(path, photo, classes, crs)?
        }
        None => RoughCapture::read(path, &source(from), classes, crs)?,
    };
    let world = world_around(snapshot, given.map_or(rough.position(), |pose| pose.position))?;
    let (capture, report) = rough.settle(world.scene(false))?;
    for note in &report.notes {
        console.message(&format!("prior: {note}"));
    }
    let prior = document(&capture, &report, from);
    Ok(Placed { capture, world, prior })
}

fn source(from: &PriorFrom) -> PriorSource {
    match (&from.nmea, &from.photo) {
        (Some(log), _) => PriorSource::Nmea { log: log.clone(), at: from.at_time },
        (None, Some(photo)) => PriorSource::Photo(photo.clone()),
        (None, None) => PriorSource::Capture,
    }
}

fn document(capture: &Capture, report: &PriorReport, from: &PriorFrom) -> Value {
    let prior = &capture.prior;
    let file = from.nmea.as_ref().or(from.photo.as_ref());
    json!({
        "pose": prior.pose,
        "position_sigma_m": prior.position_sigma_m,
        "height_sigma_m": prior.height_sigma_m,
        "yaw_sigma_deg": prior.yaw_sigma_rad.to_degrees(),
        "tilt_sigma_deg": prior.tilt_sigma_rad.to_degrees(),
        "source": report.position_from.name(),
        "file": file.map(|file| file.display().to_string()),
        "height_from": report.height_from.name(),
        "heading_from": report.heading_from.map(PriorOrigin::name),
        "sentences": report.sentences.map(|counts| json!({
            "used": counts.used,
            "skipped": counts.skipped(),
            "bad_checksum": counts.bad_checksum,
            "malformed": counts.malformed,
            "empty": counts.empty,
        })),
        "notes": report.notes,
    })
}
