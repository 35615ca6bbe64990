//! A capture as its files say it, before the map helps with its height.

use super::fix::Fix;
use super::ground::ground_near;
use super::load::{Labelling, parse_time, read_file};
use super::prior::{HEIGHT_SIGMA_M, PriorInput, RoughHeight, RoughPrior, rough_prior};
use super::{
    Capture, CaptureError, ExifError, LabelledPhoto, NmeaLog, PriorOrigin, PriorReport, SentenceCounts, read_exif,
};
use crate::crs::Crs;
use crate::render::Scene;
use jiff::Timestamp;
use resurvey_schema::{CaptureFile, ClassTable, GridPoint};
use std::path::{Path, PathBuf};

/// Height of a phone in the hand above the ground, metres.
const CAMERA_HEIGHT_M: f64 = 1.6;
/// Heights of land, metres: what is outside is no height that a receiver measured.
const LAND_M: std::ops::RangeInclusive<f64> = -500.0..=9000.0;

/// Where the position, height and heading of a prior come from, beside `capture.json`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PriorSource {
    /// `capture.json` alone.
    Capture,
    /// An NMEA log, at a time or else when the photo was taken.
    Nmea {
        /// The log.
        log: PathBuf,
        /// The time.
        at: Option<Timestamp>,
    },
    /// The EXIF of a photo.
    Photo(PathBuf),
}

impl PriorSource {
    /// A position that is nowhere on the map is a mistake of the file that says it.
    fn blamed_for(&self, error: CaptureError) -> CaptureError {
        match (self, error) {
            (Self::Nmea { log: path, .. } | Self::Photo(path), CaptureError::Position { source, .. }) => {
                CaptureError::Position { path: path.clone(), source }
            }
            (_, error) => error,
        }
    }
}

/// A capture whose height may still have to come from the ground of the map.
#[derive(Clone, Debug)]
pub struct RoughCapture {
    capture: Capture,
    height: RoughHeight,
    report: PriorReport,
    path: PathBuf,
}

impl RoughCapture {
    /// Reads the capture at `path`, its label image, and the file of `source`, for a map with `classes` in `crs`.
    pub fn read(path: &Path, source: &PriorSource, classes: &ClassTable, crs: Crs) -> Result<Self, CaptureError> {
        let file_and_text = read_file(path)?;
        Self::with(path, &file_and_text, source, crs, || Labelling::beside(path, &file_and_text.0, classes))
    }

    /// Reads the capture at `path`, whose labels a segmenter made of `photo`. The EXIF of the photo says the position
    /// where it has one, else `capture.json` does.
    pub fn read_labelled(
        path: &Path,
        photo: LabelledPhoto,
        classes: &ClassTable,
        crs: Crs,
    ) -> Result<Self, CaptureError> {
        let file_and_text = read_file(path)?;
        let photo_path = photo.path.clone();
        let labelling = || Labelling::made(photo, classes);
        let bytes =
            std::fs::read(&photo_path).map_err(|source| CaptureError::Io { path: photo_path.clone(), source })?;
        match read_exif(&bytes) {
            Err(reason @ (ExifError::Unreadable { .. } | ExifError::NoPosition { .. })) => {
                let mut rough = Self::with(path, &file_and_text, &PriorSource::Capture, crs, labelling)?;
                let note = format!("{}: no position: {reason}; it is that of capture.json", photo_path.display());
                rough.report.notes.push(note);
                Ok(rough)
            }
            _ => Self::with(path, &file_and_text, &PriorSource::Photo(photo_path), crs, labelling),
        }
    }

    fn with(
        path: &Path,
        file_and_text: &(CaptureFile, Vec<u8>),
        source: &PriorSource,
        crs: Crs,
        labelling: impl FnOnce() -> Result<Labelling, CaptureError>,
    ) -> Result<Self, CaptureError> {
        let file = &file_and_text.0;
        let stated_at = file.taken_at.as_deref().map(|time| parse_time(time, path)).transpose()?;
        let said = Said::read(source, stated_at, path)?;
        let taken_at = stated_at.or(said.fix.and_then(|(fix, _)| fix.taken_at));
        let fix = said.fix.as_ref().map(|(fix, origin)| (fix, *origin));
        let input = PriorInput { file: &file.prior, fix, crs, taken_at, path };
        let RoughPrior { prior, height, mut report } = rough_prior(&input).map_err(|error| source.blamed_for(error))?;
        report.sentences = said.sentences;
        report.notes.extend(said.sentences.filter(|counts| counts.skipped() > 0).map(|counts| skipped(&counts)));
        let capture = Capture::with_labels(path, file_and_text, (prior, taken_at), labelling()?)?;
        Ok(Self { capture, height, report, path: path.to_owned() })
    }

    /// Where the map is needed; its height may be a guess.
    pub fn position(&self) -> GridPoint {
        self.capture.prior.pose.position
    }

    /// The capture once its height is settled with `base`, the scene of the map around it without descriptors: a height
    /// that is missing, or that GNSS says with a 1σ of more than 2 m, becomes 1.6 m above the ground. Where the map has no
    /// ground a GNSS height stays, and a missing one is an error.
    pub fn settle(self, base: &Scene) -> Result<(Capture, PriorReport), CaptureError> {
        let Self { mut capture, height, mut report, path } = self;
        if height == RoughHeight::Known {
            return Ok((capture, report));
        }
        let prior = &mut capture.prior;
        let position = &mut prior.pose.position;
        let (sensed_m, sensed_sigma_m) = (position.height_m, prior.height_sigma_m);
        let from = report.height_from.name();
        match ground_near(base, *position, prior.position_sigma_m) {
            Some(ground) => {
                position.height_m = ground.height_m + CAMERA_HEIGHT_M;
                prior.height_sigma_m = HEIGHT_SIGMA_M.hypot(ground.spread_m);
                let ground = format!("{CAMERA_HEIGHT_M} m above the ground of the map at {:.1} m", ground.height_m);
                report.notes.push(if height == RoughHeight::Unknown {
                    format!("nobody says the height: taken {ground}")
                } else {
                    format!(
                        "height {sensed_m:.1} m of the {from} (1 sigma {sensed_sigma_m:.0} m) not used: taken {ground}"
                    )
                });
                report.height_from = PriorOrigin::Ground;
            }
            None if height != RoughHeight::Unknown && LAND_M.contains(&sensed_m) => {
                let is_sea_level = height == RoughHeight::Loose { is_sea_level: true };
                let datum = if is_sea_level { ", sea level taken for the map's datum" } else { "" };
                report.notes.push(format!(
                    "no ground of the map below: height {sensed_m:.1} m of the {from}, 1 sigma {sensed_sigma_m:.0} m{datum}"
                ));
            }
            None => {
                let (easting_m, northing_m) = (position.easting_m, position.northing_m);
                return Err(CaptureError::NoGround { path, easting_m, northing_m });
            }
        }
        Ok((capture, report))
    }

    /// The capture, whose height must be in its files.
    pub(super) fn settled_without_map(self) -> Result<Capture, CaptureError> {
        if self.height == RoughHeight::Known {
            return Ok(self.capture);
        }
        let expected = "a height in metres, because no map is at hand to take it from the ground";
        Err(CaptureError::Value { path: self.path, key: "prior.height", found: "missing".to_owned(), expected })
    }
}

fn skipped(counts: &SentenceCounts) -> String {
    format!(
        "NMEA log: {} sentences read, {} lines skipped ({} with a bad checksum, {} malformed, {} without a fix or value)",
        counts.used,
        counts.skipped(),
        counts.bad_checksum,
        counts.malformed,
        counts.empty
    )
}

/// What a source says.
struct Said {
    fix: Option<(Fix, PriorOrigin)>,
    sentences: Option<SentenceCounts>,
}

impl Said {
    fn read(source: &PriorSource, stated_at: Option<Timestamp>, capture: &Path) -> Result<Self, CaptureError> {
        let bytes =
            |path: &Path| std::fs::read(path).map_err(|source| CaptureError::Io { path: path.to_owned(), source });
        match source {
            PriorSource::Capture => Ok(Self { fix: None, sentences: None }),
            PriorSource::Photo(path) => {
                let fix = read_exif(&bytes(path)?);
                let fix = fix.map_err(|source| CaptureError::Photo { path: path.clone(), source })?;
                Ok(Self { fix: Some((fix, PriorOrigin::Photo)), sentences: None })
            }
            PriorSource::Nmea { log: path, at } => {
                let Some(at) = at.or(stated_at) else {
                    let (key, found) = ("taken_at", "missing".to_owned());
                    let expected = "the time of the photo, to find it in the NMEA log; or give --at-time";
                    return Err(CaptureError::Value { path: capture.to_owned(), key, found, expected });
                };
                let log = NmeaLog::parse(&bytes(path)?);
                let fix = log.fix_at(at);
                let fix = fix.map_err(|source| CaptureError::Nmea { path: path.clone(), source })?;
                Ok(Self { fix: Some((fix, PriorOrigin::Nmea)), sentences: Some(log.counts()) })
            }
        }
    }
}
