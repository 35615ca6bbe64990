//! What a VPS matcher answers.

use crate::position::Pose;

/// The second-best place, more than 5 m from the best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunnerUp {
    /// Distance in plan from the best pose, metres.
    pub distance_m: f64,
    /// Its likelihood over that of the best, 0–1; near 1 the answer is ambiguous.
    pub score_ratio: f64,
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
    /// The strongest other mode, if any was seen.
    pub runner_up: Option<RunnerUp>,
    /// Candidate poses that were scored.
    pub candidates: u64,
    /// Candidate poses left out because they lie inside a solid building.
    pub skipped: u64,
    /// Best score at each candidate position, for the heat map: easting m, northing m, score.
    pub heat: Vec<[f64; 3]>,
}
