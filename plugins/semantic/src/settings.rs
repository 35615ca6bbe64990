//! Settings of the matcher; meaning, unit and default of each stand in `settings.schema.json`.

use serde::Deserialize;

/// Checked and completed by the host against `settings.schema.json`, which says what each one means.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[allow(missing_docs)]
pub struct Settings {
    pub profile: Profile,
    pub radius_m: f64,
    pub spacing_m: f64,
    pub yaw_range_deg: f64,
    pub yaw_step_deg: u32,
    pub widen: bool,
    pub exhaustive: bool,
    pub dice: f64,
    pub jaccard: f64,
    pub boundary_f1: f64,
    pub agreement: f64,
    pub boundary_tolerance_px: f64,
    pub class_weights: ClassWeights,
    pub ignore_dynamic: bool,
    pub ignore_foliage: bool,
    pub skip_inside: bool,
    pub refine: bool,
    pub modes: usize,
    pub evidence: f64,
    pub use_prior: bool,
}

/// Whose behaviour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// What is best on evidence.
    Default,
    /// What Lee & Hsu describe.
    Paper,
}

/// How much a class counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ClassWeights {
    /// By its area in the photo.
    Area,
    /// All the same.
    Equal,
}

impl Settings {
    /// The settings with the profile's choices put in; weights that are given stay.
    pub fn resolved(mut self) -> Self {
        let mut own = [1.0, 0.0, 0.0, 0.0];
        if self.profile == Profile::Paper {
            own = [1.0, 1.0, 1.0, 0.0];
            self.class_weights = ClassWeights::Equal;
            (self.ignore_dynamic, self.ignore_foliage, self.refine, self.use_prior) = (false, false, false, false);
            self.widen = false;
            self.modes = self.modes.max(100);
        }
        let weights = [&mut self.dice, &mut self.jaccard, &mut self.boundary_f1, &mut self.agreement];
        for (weight, own) in weights.into_iter().zip(own) {
            if *weight < 0.0 {
                *weight = own;
            }
        }
        self
    }

    /// Tolerance of the boundary counts, pixels; 0 where boundaries do not count.
    pub fn tolerance_px(&self) -> f64 {
        if self.boundary_f1 > 0.0 { self.boundary_tolerance_px } else { 0.0 }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The defaults of the schema, with what they stand for put in.
    pub(crate) fn defaults() -> Settings {
        as_in_the_schema().resolved()
    }

    fn as_in_the_schema() -> Settings {
        let schema: serde_json::Value = serde_json::from_str(include_str!("settings.schema.json")).unwrap();
        let properties = schema["properties"].as_object().unwrap();
        let values: serde_json::Map<_, _> =
            properties.iter().map(|(name, property)| (name.clone(), property["default"].clone())).collect();
        serde_json::from_value(values.into()).unwrap()
    }

    #[test]
    fn the_schema_and_the_settings_have_the_same_keys() {
        assert!(defaults().refine);
    }

    #[test]
    fn weights_that_are_given_win_over_the_profile() {
        let paper = Settings { profile: Profile::Paper, ..as_in_the_schema() };
        let weights = |settings: Settings| [settings.dice, settings.jaccard, settings.boundary_f1, settings.agreement];
        assert_eq!(weights(paper.clone().resolved()).map(|weight| weight > 0.5), [true, true, true, false]);
        let only = Settings { dice: 0.0, jaccard: 1.0, boundary_f1: 0.0, ..paper };
        assert_eq!(weights(only.resolved()).map(|weight| weight > 0.5), [false, true, false, false]);
    }
}
