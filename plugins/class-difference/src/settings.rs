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
      "description": "default, or paper: Eq. 8 alone, 5 % of the image for every region" },
    "min_material_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.002,
      "description": "smallest region of a material class, share of the image" },
    "min_dynamic_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.001,
      "description": "smallest region of a dynamic class, share of the image" },
    "tolerance_sigmas": { "type": "number", "minimum": 0, "maximum": 10, "default": 2.0,
      "description": "how many standard deviations of the pose are tolerated" },
    "label_jitter_px": { "type": "number", "minimum": 0, "maximum": 50, "default": 4.0,
      "description": "how far contours of the photo's labels wander where the matcher does not say, px" },
    "map_tolerance_m": { "type": "number", "minimum": 0, "maximum": 5, "default": 0.25,
      "description": "how far walls of the map are off where the matcher does not say, m" },
    "max_tolerance_px": { "type": "integer", "minimum": 0, "maximum": 200, "default": 32,
      "description": "upper bound of all tolerances together, px" },
    "min_radius_px": { "type": "number", "minimum": 0, "maximum": 200, "default": 4.0,
      "description": "radius of the largest disk inside a region, at least, px" },
    "max_hole_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.1,
      "description": "largest hole that is filled, share of its region" },
    "min_sure_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.75,
      "description": "share of a material region's pixels that no pose error explains, at least" },
    "still_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.75,
      "description": "a descriptor is still there when the photo shows its class on this share of its pixels" },
    "removal_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.7,
      "description": "a descriptor is gone when the photo shows what is behind on this share of its pixels" }
  }
}"#;

/// Whether to follow the paper to the letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// All that this plugin knows.
    Default,
    /// Eq. 8 and the paper's size limit.
    Paper,
}

/// The settings; [`SCHEMA`] says what each means.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Settings {
    pub profile: Profile,
    pub min_material_share: f64,
    pub min_dynamic_share: f64,
    pub tolerance_sigmas: f64,
    pub label_jitter_px: f64,
    pub map_tolerance_m: f64,
    pub max_tolerance_px: u8,
    pub min_radius_px: f64,
    pub max_hole_share: f64,
    pub min_sure_share: f64,
    pub still_share: f64,
    pub removal_share: f64,
}

impl Settings {
    /// The settings for one photo: how far its labels wander and walls stand off the map is what the matcher found, where
    /// it says so.
    pub fn for_photo(&self, estimate: &PoseEstimate) -> Self {
        let Some(alignment) = &estimate.alignment else { return self.clone() };
        let label_jitter_px = self.tolerance_sigmas * alignment.label_sigma_px;
        let map_tolerance_m = self.tolerance_sigmas * alignment.map_sigma_m;
        Self { label_jitter_px, map_tolerance_m, ..self.clone() }
    }
}
