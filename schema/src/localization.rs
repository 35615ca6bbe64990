//! What a VPS matcher answers.

use crate::position::Pose;
use serde::{Deserialize, Serialize};

/// The second-best place, where the matcher tells the two apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunnerUp {
    /// Distance in plan from the best pose, metres.
    pub distance_m: f64,
    /// Its likelihood over that of the best, 0–1; near 1 the answer is ambiguous.
    pub score_ratio: f64,
}

/// What aligning photo and view tells beyond the pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alignment {
    /// Covariance over easting, northing (m), yaw (rad), height (m), pitch and roll (rad); row-major, symmetric.
    pub covariance: [[f64; 6]; 6],
    /// 1σ by which walls stand off the map, metres.
    pub map_sigma_m: f64,
    /// 1σ by which contours of the labels wander, pixels.
    pub label_sigma_px: f64,
}

impl Alignment {
    /// The lower triangle of the covariance, row by row.
    pub fn lower_triangle(&self) -> [f64; 21] {
        let mut pairs = (0..6).flat_map(|row| (0..=row).map(move |column| (row, column)));
        std::array::from_fn(|_| pairs.next().map_or(0.0, |(row, column)| self.covariance[row][column]))
    }

    /// The symmetric matrix whose lower triangle, row by row, is `values`.
    pub fn from_lower_triangle(values: &[f64; 21], map_sigma_m: f64, label_sigma_px: f64) -> Self {
        let at = |row: usize, column: usize| {
            let (high, low) = (row.max(column), row.min(column));
            values[high * (high + 1) / 2 + low]
        };
        let covariance = std::array::from_fn(|row| std::array::from_fn(|column| at(row, column)));
        Self { covariance, map_sigma_m, label_sigma_px }
    }
}

/// A pose found by a matcher, with what the reliability gate needs. The gate itself is core's.
#[derive(Clone, Debug, PartialEq)]
pub struct Localization {
    /// The best pose.
    pub pose: Pose,
    /// The matcher's score of the best pose, 0–1, higher is better.
    pub score: f64,
    /// Covariance over easting (m), northing (m) and yaw (rad); row-major, symmetric.
    pub covariance: [[f64; 3]; 3],
    /// What the matcher knows beyond that; `None` when it did not align contours.
    pub alignment: Option<Alignment>,
    /// The strongest other mode, if any was seen.
    pub runner_up: Option<RunnerUp>,
    /// Candidate poses that were scored.
    pub candidates: u64,
    /// Candidate poses left out because they lie inside a solid building.
    pub skipped: u64,
    /// Best score at each candidate position, for the heat map: easting m, northing m, score.
    pub heat: Vec<[f64; 3]>,
}
