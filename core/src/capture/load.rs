//! Reading `capture.json` and the label image beside it.

use super::{CaptureError, prior_from_file};
use crate::camera::Camera;
use crate::crs::Crs;
use crate::image::{ImageError, LabelImage, LabelReading, read_labels};
use crate::version::Digest;
use jiff::Timestamp;
use resurvey_schema::capture::FORMAT;
use resurvey_schema::service::Prior;
use resurvey_schema::{CaptureFile, ClassTable};
use std::path::Path;

/// A labelled photo with its camera and prior, all checked.
#[derive(Clone, Debug)]
pub struct Capture {
    /// Class per pixel, of the camera's size; 255 is void.
    pub labels: LabelImage,
    /// The label image as it was read, for the evidence.
    pub label_bytes: Vec<u8>,
    /// The camera.
    pub camera: Camera,
    /// The rough pose in the map frame.
    pub prior: Prior,
    /// When the photo was taken.
    pub taken_at: Option<Timestamp>,
    /// Digest over `capture.json` and the label image.
    pub digest: Digest,
}

impl Capture {
    /// Reads `path` and the label image that it names, for a map with `classes` in `crs`.
    pub fn read(path: &Path, classes: &ClassTable, crs: Crs) -> Result<Self, CaptureError> {
        let text = std::fs::read(path).map_err(|source| CaptureError::Io { path: path.to_owned(), source })?;
        let file: CaptureFile = serde_json::from_slice(&text)
            .map_err(|error| CaptureError::Form { path: path.to_owned(), reason: error.to_string() })?;
        if file.format != FORMAT {
            let reason = format!("format is {:?}; expected {FORMAT:?}", file.format);
            return Err(CaptureError::Form { path: path.to_owned(), reason });
        }
        let camera =
            Camera::from_file(&file.camera).map_err(|source| CaptureError::Camera { path: path.to_owned(), source })?;
        let prior = prior_from_file(&file.prior, crs, path)?;
        let taken_at = file.taken_at.as_deref().map(|time| parse_time(time, path)).transpose()?;
        let label_path = path.parent().unwrap_or(Path::new("")).join(&file.labels);
        let label_bytes =
            std::fs::read(&label_path).map_err(|source| CaptureError::Io { path: label_path.clone(), source })?;
        let labels = read_labels(&label_bytes, classes, &LabelReading::default())
            .map_err(|source| ImageError::InFile { path: label_path.clone(), source: Box::new(source) })?;
        let (found, expected) = ((labels.width(), labels.height()), (camera.width(), camera.height()));
        if found != expected {
            return Err(CaptureError::Size { labels: label_path, capture: path.to_owned(), found, expected });
        }
        let digest = Digest::of(&[Digest::of(&text).0, Digest::of(&label_bytes).0].concat());
        Ok(Self { labels, label_bytes, camera, prior, taken_at, digest })
    }
}

fn parse_time(time: &str, path: &Path) -> Result<Timestamp, CaptureError> {
    time.parse().map_err(|_| CaptureError::Value {
        path: path.to_owned(),
        key: "taken_at",
        found: format!("{time:?}"),
        expected: "a time with its zone, such as \"2026-06-01T10:33:00+08:00\"",
    })
}
