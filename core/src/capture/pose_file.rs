//! A pose from a JSON file: the output of `localize`, or any document with a `pose`.

use super::CaptureError;
use resurvey_schema::Pose;
use serde::Deserialize;
use std::path::Path;

#[derive(Deserialize)]
#[serde(untagged)]
enum PoseDocument {
    Within { pose: Pose },
    Bare(Pose),
}

/// The pose in `path`: either the document itself or its `pose`.
pub fn read_pose(path: &Path) -> Result<Pose, CaptureError> {
    let text = std::fs::read(path).map_err(|source| CaptureError::Io { path: path.to_owned(), source })?;
    let form = |reason: String| CaptureError::Form { path: path.to_owned(), reason };
    let document: serde_json::Value = serde_json::from_slice(&text).map_err(|error| form(error.to_string()))?;
    let pose = match serde_json::from_value(document) {
        Ok(PoseDocument::Within { pose } | PoseDocument::Bare(pose)) => pose,
        Err(_) => {
            let keys = "\"easting\", \"northing\", \"height\", \"yaw_deg\", \"pitch_deg\", \"roll_deg\"";
            return Err(form(format!("expected an object with {keys}, or with such an object as \"pose\"")));
        }
    };
    let angles = [pose.yaw_rad, pose.pitch_rad, pose.roll_rad];
    if pose.position.is_finite() && angles.iter().all(|angle| angle.is_finite()) {
        Ok(pose)
    } else {
        Err(form("expected finite numbers in the pose".to_owned()))
    }
}
