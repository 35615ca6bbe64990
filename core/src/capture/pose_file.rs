//! A pose from a JSON file: the output of `localize`, or any document with a `pose`.

use super::CaptureError;
use resurvey_schema::{Alignment, Pose};
use serde::Deserialize;
use std::path::Path;

/// A pose that is given, with how sure it is where the document says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenPose {
    /// The pose.
    pub pose: Pose,
    /// Covariance over easting (m), northing (m), yaw (rad); `None` is taken at its word.
    pub covariance: Option<[[f64; 3]; 3]>,
    /// What its matcher found out beyond that.
    pub alignment: Option<Alignment>,
}

#[derive(Deserialize)]
struct Within {
    pose: Pose,
    #[serde(default)]
    covariance: Option<[[f64; 3]; 3]>,
    #[serde(default)]
    alignment: Option<Alignment>,
}

/// The pose in `path`: either the document itself or its `pose`.
pub fn read_pose(path: &Path) -> Result<Pose, CaptureError> {
    read_given_pose(path).map(|given| given.pose)
}

/// The pose in `path` with its `covariance` and `alignment`, where it has them.
pub fn read_given_pose(path: &Path) -> Result<GivenPose, CaptureError> {
    let text = std::fs::read(path).map_err(|source| CaptureError::Io { path: path.to_owned(), source })?;
    let form = |reason: String| CaptureError::Form { path: path.to_owned(), reason };
    let document: serde_json::Value = serde_json::from_slice(&text).map_err(|error| form(error.to_string()))?;
    let given = if document.get("pose").is_some() {
        serde_json::from_value(document).map(|Within { pose, covariance, alignment }| GivenPose {
            pose,
            covariance,
            alignment,
        })
    } else {
        serde_json::from_value(document).map(|pose| GivenPose { pose, covariance: None, alignment: None })
    };
    let given = given.map_err(|error| {
        let keys = "\"easting\", \"northing\", \"height\", \"yaw_deg\", \"pitch_deg\", \"roll_deg\"";
        form(format!("expected an object with {keys}, or with such an object as \"pose\"; found {error}"))
    })?;
    let Pose { position, yaw_rad, pitch_rad, roll_rad } = given.pose;
    let is_finite = position.is_finite() && [yaw_rad, pitch_rad, roll_rad].iter().all(|angle| angle.is_finite());
    if !is_finite {
        return Err(form("expected finite numbers in the pose".to_owned()));
    }
    let variances = given.covariance.iter().flat_map(|matrix| (0..3).map(|axis| matrix[axis][axis]));
    let more = given.alignment.iter().flat_map(|alignment| (0..6).map(|axis| alignment.covariance[axis][axis]));
    match variances.chain(more).find(|variance| *variance < 0.0) {
        Some(variance) => {
            Err(form(format!("expected variances of at least 0 on the covariance's diagonal, found {variance}")))
        }
        None => Ok(given),
    }
}
