//! Why a capture could not be read.

use super::{ExifError, NmeaError};
use crate::camera::CameraError;
use crate::crs::CrsError;
use crate::image::ImageError;
use std::path::PathBuf;

/// Why a capture, its labels or a pose could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// The file could not be opened or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not JSON, or not of the form that is documented.
    #[error("{}: {reason}", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// What was expected and found, with line and column.
        reason: String,
    },
    /// A value that cannot be.
    #[error("{}: {key} is {found}; expected {expected}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Key, with dots.
        key: &'static str,
        /// What it is.
        found: String,
        /// What it may be.
        expected: &'static str,
    },
    /// The camera cannot be.
    #[error("{}: camera: {source}", path.display())]
    Camera {
        /// The file.
        path: PathBuf,
        /// Why.
        source: CameraError,
    },
    /// The prior is nowhere on the map.
    #[error("{}: prior: {source}", path.display())]
    Position {
        /// The file.
        path: PathBuf,
        /// Why.
        source: CrsError,
    },
    /// The EXIF of a photo says nothing about where it was taken.
    #[error("{}: {source}", path.display())]
    Photo {
        /// The photo.
        path: PathBuf,
        /// Why.
        source: ExifError,
    },
    /// An NMEA log says nothing about the time.
    #[error("{}: {source}", path.display())]
    Nmea {
        /// The log.
        path: PathBuf,
        /// Why.
        source: NmeaError,
    },
    /// A height that should come from the ground, where there is none.
    #[error(
        "{}: expected prior.height, or ground of the map at {easting_m:.0}, {northing_m:.0} to take it from; found neither",
        path.display()
    )]
    NoGround {
        /// The capture.
        path: PathBuf,
        /// Easting, metres.
        easting_m: f64,
        /// Northing, metres.
        northing_m: f64,
    },
    /// The label image cannot be read.
    #[error(transparent)]
    Labels(#[from] ImageError),
    /// The photo cannot become one of the camera's size.
    #[error(
        "{}: the photo is {}×{} px upright, the camera of {} {}×{} px; expected the same aspect ratio and no fewer pixels",
        photo.display(), found.0, found.1, capture.display(), expected.0, expected.1
    )]
    PhotoSize {
        /// The photo.
        photo: PathBuf,
        /// The capture.
        capture: PathBuf,
        /// Columns and rows of the photo.
        found: (u32, u32),
        /// Columns and rows of the camera.
        expected: (u32, u32),
    },
    /// Nobody says what the photo shows.
    #[error(
        "{}: expected labels, the path of a label image, or a photo and a segmenter that makes them; found neither",
        capture.display()
    )]
    NoLabels {
        /// The capture.
        capture: PathBuf,
    },
    /// The label image has another size than the camera.
    #[error(
        "{}: the label image is {}×{} px, the camera of {} is {}×{} px",
        labels.display(), found.0, found.1, capture.display(), expected.0, expected.1
    )]
    Size {
        /// The label image.
        labels: PathBuf,
        /// The capture.
        capture: PathBuf,
        /// Columns and rows of the image.
        found: (u32, u32),
        /// Columns and rows of the camera.
        expected: (u32, u32),
    },
}
