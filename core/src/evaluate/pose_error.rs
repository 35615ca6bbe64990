//! How far a pose is from the true one.

use resurvey_schema::Pose;
use serde::Serialize;
use std::f64::consts::{PI, TAU};

/// Error of a pose, found minus true.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoseError {
    /// East, metres.
    pub east_m: f64,
    /// North, metres.
    pub north_m: f64,
    /// Up, metres.
    pub up_m: f64,
    /// Clockwise, radians, −π to π.
    #[serde(skip)]
    pub yaw_rad: f64,
}

impl PoseError {
    /// The error of `found` where the camera was at `truth`.
    pub fn of(found: &Pose, truth: &Pose) -> Self {
        Self {
            east_m: found.position.easting_m - truth.position.easting_m,
            north_m: found.position.northing_m - truth.position.northing_m,
            up_m: found.position.height_m - truth.position.height_m,
            yaw_rad: (found.yaw_rad - truth.yaw_rad + PI).rem_euclid(TAU) - PI,
        }
    }

    /// Distance in plan, metres.
    pub fn position_m(&self) -> f64 {
        self.east_m.hypot(self.north_m)
    }

    /// Error of the heading, degrees clockwise.
    pub fn yaw_deg(&self) -> f64 {
        self.yaw_rad.to_degrees()
    }

    /// Whether position and heading are both within `level`.
    pub fn is_within(&self, level: Level) -> bool {
        self.position_m() <= level.position_m && self.yaw_deg().abs() <= level.yaw_deg
    }
}

/// A recall level: a limit for the position in plan together with one for the heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Metres.
    pub position_m: f64,
    /// Degrees.
    pub yaw_deg: f64,
}

impl Level {
    /// The three levels that recall is given at.
    pub const ALL: [Self; 3] = [Self::of(1.0), Self::of(2.0), Self::of(5.0)];

    /// As many metres as degrees.
    const fn of(limit: f64) -> Self {
        Self { position_m: limit, yaw_deg: limit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_schema::GridPoint;

    fn pose(easting_m: f64, northing_m: f64, yaw_deg: f64) -> Pose {
        let position = GridPoint::new(easting_m, northing_m, 6.0);
        Pose { position, yaw_rad: yaw_deg.to_radians(), pitch_rad: 0.0, roll_rad: 0.0 }
    }

    #[test]
    fn headings_on_both_sides_of_north_are_near_each_other() {
        for (found, truth, error_deg) in
            [(359.0, 1.0, -2.0), (1.0, 359.0, 2.0), (-179.0, 179.0, 2.0), (721.0, 0.0, 1.0)]
        {
            let error = PoseError::of(&pose(0.0, 0.0, found), &pose(0.0, 0.0, truth));
            assert!((error.yaw_deg() - error_deg).abs() < 1e-9, "{found} for {truth}: {}", error.yaw_deg());
        }
    }

    #[test]
    fn a_level_limits_position_and_heading_together() {
        let truth = pose(835_600.0, 817_800.0, 90.0);
        let error = |east_m, north_m, yaw_deg| {
            PoseError::of(&pose(835_600.0 + east_m, 817_800.0 + north_m, 90.0 + yaw_deg), &truth)
        };
        let within = |error: PoseError| Level::ALL.map(|level| error.is_within(level));
        assert!((error(3.0, -4.0, 0.0).position_m() - 5.0).abs() < 1e-9);
        assert_eq!(within(error(0.6, 0.6, -0.9)), [true, true, true]);
        assert_eq!(within(error(0.8, 0.8, 0.0)), [false, true, true]);
        assert_eq!(within(error(0.0, 0.0, -4.3)), [false, false, true]);
        assert_eq!(within(error(4.0, 4.0, 0.0)), [false, false, false]);
    }
}
