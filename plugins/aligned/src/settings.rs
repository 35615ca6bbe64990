//! What a user can set.

use resurvey_class_difference::settings::{Profile, Settings as Compared};
use serde::Deserialize;

/// JSON schema of [`Settings`].
pub const SCHEMA: &str = r#"{
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "left_over_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.25,
      "description": "share of the tolerance for pose and map that is left when a surface is aligned" },
    "min_fit_share": { "type": "number", "minimum": 0, "maximum": 1, "default": 0.75,
      "description": "a surface is aligned when the photo agrees with this share of its contours' surroundings" },
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

/// The settings; [`SCHEMA`] says what each means.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct Settings {
    pub left_over_share: f64,
    pub min_fit_share: f64,
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
    /// The settings that `class-difference` would have.
    pub fn compared(&self) -> Compared {
        Compared {
            profile: Profile::Default,
            min_material_share: self.min_material_share,
            min_dynamic_share: self.min_dynamic_share,
            tolerance_sigmas: self.tolerance_sigmas,
            label_jitter_px: self.label_jitter_px,
            map_tolerance_m: self.map_tolerance_m,
            max_tolerance_px: self.max_tolerance_px,
            min_radius_px: self.min_radius_px,
            max_hole_share: self.max_hole_share,
            min_sure_share: self.min_sure_share,
            still_share: self.still_share,
            removal_share: self.removal_share,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::SCHEMA;
    use serde_json::Value;

    #[test]
    fn a_setting_that_class_difference_has_too_is_the_same_there() {
        let properties = |schema: &str| serde_json::from_str::<Value>(schema).unwrap()["properties"].clone();
        let (own, other) = (properties(SCHEMA), properties(resurvey_class_difference::settings::SCHEMA));
        let shared: Vec<&String> = other.as_object().unwrap().keys().filter(|name| *name != "profile").collect();
        assert!(shared.len() > 5);
        for name in shared {
            assert_eq!(own[name], other[name], "{name}");
        }
    }
}
