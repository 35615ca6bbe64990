//! The reliability gate: only a pose that passes may change the map (Lee & Hsu, §5.2).

use crate::version::Gate;
use resurvey_schema::Localization;

/// Limits of the gate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GateLimits {
    /// Lowest score, 0–1.
    pub min_score: f64,
    /// Largest 1σ of the position along its worst direction in plan, metres.
    pub max_position_sigma_m: f64,
    /// Largest 1σ of the heading, degrees.
    pub max_yaw_sigma_deg: f64,
    /// Largest likelihood of another place over that of the best, 0–1.
    pub max_runner_up_ratio: f64,
    /// Largest 1σ of the contours' residuals after alignment, pixels; for matchers that tell.
    pub max_label_sigma_px: f64,
}

impl Default for GateLimits {
    /// Chosen on generated captures (`docs/accuracy.md`): aligned poses under field noise that are right within 1 m score
    /// down to 0.74, because walls that stand elsewhere cost overlap; what tells a missed place is the ratio: a search
    /// whose circle did not hold the true place came to 0.79 and 0.041. Of 142 aligned poses right within 1 m, the residuals
    /// of 98 % scatter by less than 7.3 px; one that was 4.4 m off passed all else with 9.1 px.
    fn default() -> Self {
        Self {
            min_score: 0.7,
            max_position_sigma_m: 1.0,
            max_yaw_sigma_deg: 2.0,
            max_runner_up_ratio: 0.02,
            max_label_sigma_px: 8.0,
        }
    }
}

/// The names of the limits as `--set gate.NAME=VALUE` has them.
pub const GATE_KEYS: [&str; 5] =
    ["min_score", "max_position_sigma_m", "max_yaw_sigma_deg", "max_runner_up_ratio", "max_label_sigma_px"];

impl GateLimits {
    /// Sets the limit called `key`; `false` when there is none of that name.
    pub fn set(&mut self, key: &str, value: f64) -> bool {
        match key {
            "min_score" => self.min_score = value,
            "max_position_sigma_m" => self.max_position_sigma_m = value,
            "max_yaw_sigma_deg" => self.max_yaw_sigma_deg = value,
            "max_runner_up_ratio" => self.max_runner_up_ratio = value,
            "max_label_sigma_px" => self.max_label_sigma_px = value,
            _ => return false,
        }
        true
    }

    /// What each limit measures on `localization`; the pose is reliable when all pass.
    pub fn measure(&self, localization: &Localization) -> Vec<Gate> {
        let covariance = &localization.covariance;
        let position_sigma_m = worst_plan_variance(covariance).max(0.0).sqrt();
        let yaw_sigma_deg = covariance[2][2].max(0.0).sqrt().to_degrees();
        let runner_up = localization.runner_up.map_or(0.0, |other| other.score_ratio);
        let at_most = |name: &str, measured: f64, limit: f64, unit: &str| Gate {
            name: name.to_owned(),
            measured,
            limit,
            unit: unit.to_owned(),
            passed: measured <= limit,
        };
        let mut gates = vec![
            Gate {
                name: "score".to_owned(),
                measured: localization.score,
                limit: self.min_score,
                unit: "ratio".to_owned(),
                passed: localization.score >= self.min_score,
            },
            at_most("position-sigma", position_sigma_m, self.max_position_sigma_m, "m"),
            at_most("yaw-sigma", yaw_sigma_deg, self.max_yaw_sigma_deg, "deg"),
            at_most("runner-up", runner_up, self.max_runner_up_ratio, "ratio"),
        ];
        if let Some(alignment) = &localization.alignment {
            gates.push(at_most("label-sigma", alignment.label_sigma_px, self.max_label_sigma_px, "px"));
        }
        gates
    }
}

/// In words why `gate` failed; `None` when it passed.
pub fn reason(gate: &Gate, localization: &Localization) -> Option<String> {
    let Gate { name, measured, limit, unit, passed } = gate;
    if *passed {
        return None;
    }
    Some(match (name.as_str(), localization.runner_up) {
        ("runner-up", Some(other)) => format!(
            "ambiguous: a place {:.1} m away is {measured:.2} times as likely; the limit is {limit}",
            other.distance_m
        ),
        ("score", _) => format!("score is {measured:.3}; at least {limit} is needed"),
        _ => format!("{name} is {measured:.2} {unit}; the limit is {limit} {unit}"),
    })
}

/// Larger eigenvalue of the upper left 2 × 2 block.
fn worst_plan_variance(covariance: &[[f64; 3]; 3]) -> f64 {
    let (a, b, c) = (covariance[0][0], covariance[0][1], covariance[1][1]);
    (a + c) / 2.0 + (((a - c) / 2.0).powi(2) + b * b).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_schema::{Alignment, GridPoint, Pose, RunnerUp};

    fn localization() -> Localization {
        let position = GridPoint::new(835_600.0, 817_800.0, 6.0);
        Localization {
            pose: Pose { position, yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 },
            score: 0.9,
            covariance: [[0.5, 0.4, 0.0], [0.4, 0.5, 0.0], [0.0, 0.0, 1e-4]],
            alignment: None,
            runner_up: Some(RunnerUp { distance_m: 12.0, score_ratio: 0.01 }),
            candidates: 1,
            skipped: 0,
            heat: Vec::new(),
        }
    }

    fn failed(localization: &Localization) -> Vec<String> {
        GateLimits::default().measure(localization).iter().filter_map(|gate| reason(gate, localization)).collect()
    }

    #[test]
    fn a_sharp_single_peak_is_reliable() {
        assert_eq!(failed(&localization()), Vec::<String>::new());
    }

    #[test]
    fn the_worst_direction_counts_not_an_axis() {
        let stretched =
            Localization { covariance: [[0.8, 0.7, 0.0], [0.7, 0.8, 0.0], [0.0, 0.0, 1e-4]], ..localization() };
        // Eigenvalue 1.5 m² along the diagonal, though both axes are below 1 m².
        assert_eq!(failed(&stretched), ["position-sigma is 1.22 m; the limit is 1 m"]);
    }

    #[test]
    fn a_search_that_missed_the_true_place_is_not_reliable() {
        // Measured: street of seed 7, prior 123 m from the camera with a stated 1 sigma of 15 m.
        let runner_up = Some(RunnerUp { distance_m: 12.0, score_ratio: 0.041 });
        let found = failed(&Localization { score: 0.79, runner_up, ..localization() });
        assert_eq!(found, ["ambiguous: a place 12.0 m away is 0.04 times as likely; the limit is 0.02"]);
    }

    #[test]
    fn contours_that_do_not_fit_after_alignment_are_not_reliable() {
        let alignment = Alignment { covariance: [[0.0; 6]; 6], map_sigma_m: 0.25, label_sigma_px: 9.1 };
        let found = failed(&Localization { alignment: Some(alignment), ..localization() });
        assert_eq!(found, ["label-sigma is 9.10 px; the limit is 8 px"]);
    }

    #[test]
    fn a_second_place_as_likely_as_the_first_is_ambiguous() {
        let runner_up = Some(RunnerUp { distance_m: 12.0, score_ratio: 0.7 });
        let found = failed(&Localization { runner_up, ..localization() });
        assert_eq!(found, ["ambiguous: a place 12.0 m away is 0.70 times as likely; the limit is 0.02"]);
    }
}
