//! Reading `capture.json` and the label image beside it, or the labels that a segmenter made of a photo.

use super::{CaptureError, LabelledPhoto, PriorSource, RoughCapture};
use crate::camera::Camera;
use crate::crs::Crs;
use crate::image::{ImageError, LabelImage, LabelReading, read_labels, write_label_png};
use crate::version::Digest;
use jiff::Timestamp;
use resurvey_schema::capture::FORMAT;
use resurvey_schema::service::Prior;
use resurvey_schema::{CaptureFile, ClassTable, GridPoint, Pose};
use std::path::{Path, PathBuf};

/// A labelled photo with its camera and prior, all checked.
#[derive(Clone, Debug)]
pub struct Capture {
    /// Class per pixel, of the camera's size; 255 is void.
    pub labels: LabelImage,
    /// The label image as it was read, or a PNG of what a segmenter made, for the evidence.
    pub label_bytes: Vec<u8>,
    /// The camera.
    pub camera: Camera,
    /// The rough pose in the map frame.
    pub prior: Prior,
    /// When the photo was taken.
    pub taken_at: Option<Timestamp>,
    /// Digest over `capture.json` and the file that the labels come from: the label image, or the photo that a
    /// segmenter read (whichever segmenter that was).
    pub digest: Digest,
}

impl Capture {
    /// Digest of what the photo shows, its size and classes: the same for one photo in two files, or with two priors.
    pub fn photo_digest(&self) -> Digest {
        let size = [self.labels.width(), self.labels.height()].map(u32::to_le_bytes).concat();
        Digest::of(&[&size, self.labels.values()].concat())
    }

    /// Reads `path` and the label image that it names, for a map with `classes` in `crs`. The whole prior must be in the
    /// file; [`RoughCapture`] also reads others.
    pub fn read(path: &Path, classes: &ClassTable, crs: Crs) -> Result<Self, CaptureError> {
        RoughCapture::read(path, &PriorSource::Capture, classes, crs)?.settled_without_map()
    }

    /// The digest of the capture at `path`, whose labels a segmenter makes of `photo`, or else come from the file that the
    /// capture names.
    pub fn digest_of(path: &Path, photo: Option<&Path>) -> Result<Digest, CaptureError> {
        let (file, text) = read_file(path)?;
        let source = photo.map_or_else(|| label_path(path, &file), |photo| Ok(photo.to_owned()))?;
        let bytes = std::fs::read(&source).map_err(|error| CaptureError::Io { path: source, source: error })?;
        Ok(digest(&text, Digest::of(&bytes)))
    }

    /// The labels and camera of `path`, with a prior that says nothing: somebody else knows it.
    pub fn labelled(path: &Path, classes: &ClassTable) -> Result<Self, CaptureError> {
        let file_and_text = read_file(path)?;
        let labelling = Labelling::beside(path, &file_and_text.0, classes)?;
        Self::with_labels(path, &file_and_text, (UNKNOWN, None), labelling)
    }

    /// The capture of `file`, whose text is `text`, with its labels, prior and time.
    pub(super) fn with_labels(
        path: &Path,
        (file, text): &(CaptureFile, Vec<u8>),
        (prior, taken_at): (Prior, Option<Timestamp>),
        labelling: Labelling,
    ) -> Result<Self, CaptureError> {
        let camera =
            Camera::from_file(&file.camera).map_err(|source| CaptureError::Camera { path: path.to_owned(), source })?;
        let Labelling { path: label_path, labels, label_bytes, digest } = labelling;
        let (found, expected) = ((labels.width(), labels.height()), (camera.width(), camera.height()));
        if found != expected {
            return Err(CaptureError::Size { labels: label_path, capture: path.to_owned(), found, expected });
        }
        let digest = self::digest(text, digest);
        Ok(Self { labels, label_bytes, camera, prior, taken_at, digest })
    }
}

/// The labels of a capture, wherever they come from.
pub(super) struct Labelling {
    /// The file that they come from.
    path: PathBuf,
    labels: LabelImage,
    label_bytes: Vec<u8>,
    /// Of the file.
    digest: Digest,
}

impl Labelling {
    /// The label image that `file`, read from `capture`, names.
    pub(super) fn beside(capture: &Path, file: &CaptureFile, classes: &ClassTable) -> Result<Self, CaptureError> {
        let path = label_path(capture, file)?;
        let label_bytes = std::fs::read(&path).map_err(|source| CaptureError::Io { path: path.clone(), source })?;
        let labels = read_labels(&label_bytes, classes, &LabelReading::default())
            .map_err(|source| ImageError::InFile { path: path.clone(), source: Box::new(source) })?;
        Ok(Self { path, labels, digest: Digest::of(&label_bytes), label_bytes })
    }

    /// The labels that a segmenter made.
    pub(super) fn made(photo: LabelledPhoto, classes: &ClassTable) -> Result<Self, CaptureError> {
        let LabelledPhoto { path, labels, digest } = photo;
        let label_bytes = write_label_png(&labels, classes)?;
        Ok(Self { path, labels, label_bytes, digest })
    }
}

/// The label image that `file`, read from `capture`, names.
fn label_path(capture: &Path, file: &CaptureFile) -> Result<PathBuf, CaptureError> {
    let name = file.labels.as_ref().ok_or_else(|| CaptureError::NoLabels { capture: capture.to_owned() })?;
    Ok(capture.parent().unwrap_or(Path::new("")).join(name))
}

/// The digest of a capture, over `capture.json` and the digest of the file that the labels come from.
fn digest(text: &[u8], labels: Digest) -> Digest {
    Digest::of(&[Digest::of(text).0, labels.0].concat())
}

const UNKNOWN: Prior = Prior {
    pose: Pose { position: GridPoint::new(0.0, 0.0, 0.0), yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 },
    position_sigma_m: f64::INFINITY,
    height_sigma_m: f64::INFINITY,
    yaw_sigma_rad: f64::INFINITY,
    tilt_sigma_rad: f64::INFINITY,
};

/// `capture.json` and its text.
pub(super) fn read_file(path: &Path) -> Result<(CaptureFile, Vec<u8>), CaptureError> {
    let text = std::fs::read(path).map_err(|source| CaptureError::Io { path: path.to_owned(), source })?;
    let file: CaptureFile = serde_json::from_slice(&text)
        .map_err(|error| CaptureError::Form { path: path.to_owned(), reason: error.to_string() })?;
    if file.format != FORMAT {
        let reason = format!("format is {:?}; expected {FORMAT:?}", file.format);
        return Err(CaptureError::Form { path: path.to_owned(), reason });
    }
    Ok((file, text))
}

/// The time of a capture.
pub(super) fn parse_time(time: &str, path: &Path) -> Result<Timestamp, CaptureError> {
    time.parse().map_err(|_| CaptureError::Value {
        path: path.to_owned(),
        key: "taken_at",
        found: format!("{time:?}"),
        expected: "a time with its zone, such as \"2026-06-01T10:33:00+08:00\"",
    })
}
