//! Whether a matcher's covariance is honest: normalised estimation error squared (Bar-Shalom, Li & Kirubarajan, 2001,
//! §5.4). Over easting, northing and heading it is distributed as χ² with three degrees of freedom, if it is.

use super::pose_error::PoseError;
use super::statistics::{mean, median};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// 95 % of χ² with three degrees of freedom.
const CHI_SQUARE_3_95: f64 = 7.814_727_903_251_179;

/// eᵀ C⁻¹ e over easting, northing (m) and heading (rad); `None` where `covariance` has no inverse that is a covariance.
pub fn nees(error: &PoseError, covariance: &[[f64; 3]; 3]) -> Option<f64> {
    let factor = Matrix3::from_fn(|row, column| covariance[row][column]).cholesky()?;
    let error = Vector3::new(error.east_m, error.north_m, error.yaw_rad);
    let squared = error.dot(&factor.solve(&error));
    squared.is_finite().then_some(squared)
}

/// How the errors of many answers compare with their covariances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Consistency {
    /// Answers with a covariance that can be inverted.
    pub answers: usize,
    /// Mean; 3 is expected, more means too sure.
    pub mean: f64,
    /// Median; 2.37 is expected.
    pub median: f64,
    /// Share within the 95 % ellipsoid (at most 7.81); 0.95 is expected.
    pub within_95: f64,
}

impl Consistency {
    /// Of these normalised errors; `None` when there are none.
    pub fn of(normalised: &[f64]) -> Option<Self> {
        let inside = normalised.iter().filter(|squared| **squared <= CHI_SQUARE_3_95).count();
        Some(Self {
            answers: normalised.len(),
            mean: mean(normalised)?,
            median: median(normalised)?,
            within_95: inside as f64 / normalised.len() as f64,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(east_m: f64, north_m: f64, yaw_rad: f64) -> PoseError {
        PoseError { east_m, north_m, up_m: 0.0, yaw_rad }
    }

    #[test]
    fn one_sigma_along_each_axis_makes_three() {
        let covariance = [[0.04, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 1e-4]];
        let squared = nees(&error(0.2, -0.5, 0.01), &covariance).unwrap();
        assert!((squared - 3.0).abs() < 1e-9, "{squared}");
    }

    #[test]
    fn correlation_counts() {
        // Inverse of [[2, 1], [1, 2]] is [[2, −1], [−1, 2]]/3: along (1, 1) 2/3, along (1, −1) 2.
        let covariance = [[2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 0.0, 1.0]];
        assert!((nees(&error(1.0, 1.0, 0.0), &covariance).unwrap() - 2.0 / 3.0).abs() < 1e-12);
        assert!((nees(&error(1.0, -1.0, 0.0), &covariance).unwrap() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_covariance_has_no_normalised_error() {
        assert_eq!(nees(&error(0.0, 0.0, 0.0), &[[0.0; 3]; 3]), None);
        let saddle = [[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(nees(&error(1.0, 0.0, 0.0), &saddle), None);
        assert_eq!(nees(&error(1.0, 0.0, 0.0), &[[f64::NAN; 3]; 3]), None);
    }

    #[test]
    fn consistency_counts_what_lies_within_the_ellipsoid() {
        let found = Consistency::of(&[1.0, 2.0, 3.0, 14.0]).unwrap();
        assert!((found.mean - 5.0).abs() < 1e-12 && (found.median - 2.5).abs() < 1e-12);
        assert!((found.within_95 - 0.75).abs() < 1e-12 && found.answers == 4);
        assert_eq!(Consistency::of(&[]), None);
    }
}
