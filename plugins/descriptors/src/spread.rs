//! How an error of the pose spreads into what is measured: the pose is moved by one standard deviation along each of
//! its independent directions, and the changes of the result are added in squares.

use nalgebra::{Matrix6, Rotation3, SymmetricEigen, Unit, Vector3};
use resurvey_plugin::PoseEstimate;
use resurvey_plugin::schema::Pose;

/// A pose moved by a little.
#[derive(Clone, Copy, Debug)]
pub struct Nudge {
    /// Offset from the estimated position, E, N, H, metres.
    pub offset: Vector3<f64>,
    /// Turn of every ray.
    pub turn: Rotation3<f64>,
}

impl Nudge {
    /// The estimated pose itself.
    pub fn none() -> Self {
        Self { offset: Vector3::zeros(), turn: Rotation3::identity() }
    }
}

/// The estimated pose moved by 1σ along each independent direction; `None` when a sigma is not finite.
pub fn nudges(estimate: &PoseEstimate) -> Option<Vec<Nudge>> {
    let covariance = covariance(estimate);
    if !covariance.iter().all(|x| x.is_finite()) {
        return None;
    }
    let Pose { yaw_rad, pitch_rad, .. } = estimate.pose;
    let right = Unit::new_normalize(Vector3::new(yaw_rad.cos(), -yaw_rad.sin(), 0.0));
    let ahead = Vector3::new(yaw_rad.sin() * pitch_rad.cos(), yaw_rad.cos() * pitch_rad.cos(), pitch_rad.sin());
    let about = |axis: &Unit<Vector3<f64>>, angle_rad: f64| Rotation3::from_axis_angle(axis, angle_rad);
    let eigen = SymmetricEigen::new((covariance + covariance.transpose()) / 2.0);
    let moved = |axis: usize| {
        let step = eigen.eigenvectors.column(axis) * eigen.eigenvalues[axis].max(0.0).sqrt();
        // Yaw is clockwise, a rotation about the vertical is not.
        let turn =
            about(&Vector3::z_axis(), -step[2]) * about(&right, step[4]) * about(&Unit::new_normalize(ahead), step[5]);
        Nudge { offset: Vector3::new(step[0], step[1], step[3]), turn }
    };
    Some((0..6).map(moved).collect())
}

/// Over easting, northing, yaw, height, pitch, roll: the matcher's own, or what is known of each alone.
fn covariance(estimate: &PoseEstimate) -> Matrix6<f64> {
    if let Some(alignment) = &estimate.alignment {
        return Matrix6::from_fn(|row, column| alignment.covariance[row][column]);
    }
    let mut covariance = Matrix6::zeros();
    for (row, values) in estimate.covariance.iter().enumerate() {
        values.iter().enumerate().for_each(|(column, value)| covariance[(row, column)] = *value);
    }
    covariance[(3, 3)] = estimate.height_sigma_m.powi(2);
    covariance[(4, 4)] = estimate.tilt_sigma_rad.powi(2);
    covariance[(5, 5)] = estimate.tilt_sigma_rad.powi(2);
    covariance
}

/// 1σ of the position, metres, in its worst direction, and of the attitude, radians.
pub fn pose_sigmas(estimate: &PoseEstimate) -> (f64, f64) {
    let c = covariance(estimate);
    let plan_m2 = (c[(0, 0)] + c[(1, 1)]) / 2.0 + ((c[(0, 0)] - c[(1, 1)]) / 2.0).hypot(c[(0, 1)]);
    let angle_rad2 = c[(2, 2)].max(c[(4, 4)]).max(c[(5, 5)]);
    (plan_m2.max(c[(3, 3)]).max(0.0).sqrt(), angle_rad2.max(0.0).sqrt())
}
