//! One possible answer.

use resurvey_plugin::Prior;
use resurvey_plugin::schema::Pose;

/// A pose with what speaks for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// The pose.
    pub pose: Pose,
    /// Likeness of photo and view, 0–1.
    pub score: f64,
    /// Log of likelihood times prior, up to a constant.
    pub log_posterior: f64,
}

/// Difference of two angles, −π…π.
pub fn angle_between(a_rad: f64, b_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (a_rad - b_rad + PI).rem_euclid(TAU) - PI
}

/// Log density of `pose` under the prior's normal errors, up to a constant.
pub fn log_prior(prior: &Prior, pose: &Pose) -> f64 {
    let square = |error: f64, sigma: f64| if sigma > 0.0 { (error / sigma).powi(2) } else { 0.0 };
    let at = &prior.pose;
    let plan_m = pose.position.plan_distance_m(&at.position);
    -0.5 * (square(plan_m, prior.position_sigma_m)
        + square(pose.position.height_m - at.position.height_m, prior.height_sigma_m)
        + square(angle_between(pose.yaw_rad, at.yaw_rad), prior.yaw_sigma_rad)
        + square(pose.pitch_rad - at.pitch_rad, prior.tilt_sigma_rad)
        + square(pose.roll_rad - at.roll_rad, prior.tilt_sigma_rad))
}
