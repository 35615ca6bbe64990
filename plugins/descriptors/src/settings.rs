//! What a user can set.

use resurvey_plugin::PoseEstimate;
use serde::Deserialize;

/// JSON schema of [`Settings`].
pub const SCHEMA: &str = r#"{
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "profile": { "type": "string", "enum": ["default", "paper"], "default": "default",
      "description": "default, or paper: support points, depth at the corner pixels, the lowest pixel, no size test" },
    "max_range_m": { "type": "number", "minimum": 0, "maximum": 1000, "default": 50.0,
      "description": "largest distance of a corner or a ground contact from the camera, m" },
    "max_position_sigma_m": { "type": "number", "minimum": 0, "maximum": 100, "default": 1.5,
      "description": "largest 1-sigma of the position of a rectangle, m" },
    "max_dynamic_sigma_m": { "type": "number", "minimum": 0, "maximum": 100, "default": 1.0,
      "description": "the same of an object on the ground; at twice as much it could be another, m" },
    "max_area_sigma_share": { "type": "number", "minimum": 0, "maximum": 10, "default": 0.3,
      "description": "largest 1-sigma of an area, share of the area" },
    "max_plane_distance_m": { "type": "number", "minimum": 0, "maximum": 10, "default": 0.1,
      "description": "largest distance of a region's points from their plane, m" },
    "max_plane_distance_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.02,
      "description": "the same as a share of the region's diagonal; the larger of both counts" },
    "plane_point_share": { "type": "number", "minimum": 0.5, "maximum": 1, "default": 0.9,
      "description": "share of a region's points that must lie on the plane" },
    "max_side_difference": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.1,
      "description": "largest difference of opposite sides, share of their mean" },
    "max_angle_difference_deg": { "type": "number", "minimum": 0, "maximum": 45, "default": 10.0,
      "description": "largest difference of an angle from 90 degrees, deg" },
    "min_fill": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.85,
      "description": "share of a rectangle that its region fills, and of the region that lies in it, at least" },
    "max_misfit": { "type": "number", "minimum": 0, "maximum": 100, "default": 3.0,
      "description": "largest 1-sigma of a contour about its rectangle, as a multiple of label_jitter_px" },
    "label_jitter_px": { "type": "number", "minimum": 0, "maximum": 50, "default": 2.0,
      "description": "1-sigma by which contours of the photo's labels wander where the matcher does not say, px" },
    "allow_partly_hidden": { "type": "boolean", "default": true,
      "description": "measure a rectangle of which something nearer hides a part" },
    "min_side_visible": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.5,
      "description": "smallest visible share of each side of a rectangle" },
    "regularise": { "type": "boolean", "default": true,
      "description": "make the measured quadrilateral a true rectangle, level where it is nearly level" },
    "max_level_angle_deg": { "type": "number", "minimum": 0, "maximum": 45, "default": 5.0,
      "description": "a rectangle on an upright wall that is tilted by less is level, deg" },
    "max_size_factor": { "type": "number", "minimum": 1, "maximum": 10, "default": 1.6,
      "description": "an object is at most this many times larger or smaller than its predefined size" }
  }
}"#;

/// Whether to follow the paper to the letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// All that this plugin knows.
    Default,
    /// The paper's algorithms, their errata aside.
    Paper,
}

/// The settings; [`SCHEMA`] says what each means.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Settings {
    pub profile: Profile,
    pub max_range_m: f64,
    pub max_position_sigma_m: f64,
    pub max_dynamic_sigma_m: f64,
    pub max_area_sigma_share: f64,
    pub max_plane_distance_m: f64,
    pub max_plane_distance_share: f64,
    pub plane_point_share: f64,
    pub max_side_difference: f64,
    pub max_angle_difference_deg: f64,
    pub min_fill: f64,
    pub max_misfit: f64,
    pub label_jitter_px: f64,
    pub allow_partly_hidden: bool,
    pub min_side_visible: f64,
    pub regularise: bool,
    pub max_level_angle_deg: f64,
    pub max_size_factor: f64,
}

impl Settings {
    /// The settings for one photo: how far its labels wander is what the matcher found, where it says so.
    pub fn for_photo(&self, estimate: &PoseEstimate) -> Self {
        let found = estimate.alignment.map(|alignment| alignment.label_sigma_px);
        Self { label_jitter_px: found.unwrap_or(self.label_jitter_px), ..self.clone() }
    }
}
