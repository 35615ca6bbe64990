//! How an error of the pose spreads into what is measured: the pose is moved by one standard deviation along each of
//! its independent directions, and the changes of the result are added in squares.

use nalgebra::{Matrix3, Rotation3, SymmetricEigen, Unit, Vector3};
use resurvey_plugin::PoseEstimate;

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
    let covariance = Matrix3::from_fn(|row, column| estimate.covariance[row][column]);
    let (height_m, tilt_rad) = (estimate.height_sigma_m, estimate.tilt_sigma_rad);
    if !covariance.iter().all(|x| x.is_finite()) || !height_m.is_finite() || !tilt_rad.is_finite() {
        return None;
    }
    // Yaw is clockwise, a rotation about the vertical is not.
    let about = |axis: Unit<Vector3<f64>>, angle_rad: f64| Rotation3::from_axis_angle(&axis, angle_rad);
    let eigen = SymmetricEigen::new((covariance + covariance.transpose()) / 2.0);
    let mut nudges: Vec<Nudge> = (0..3)
        .map(|axis| eigen.eigenvectors.column(axis) * eigen.eigenvalues[axis].max(0.0).sqrt())
        .map(|step| Nudge { offset: Vector3::new(step[0], step[1], 0.0), turn: about(Vector3::z_axis(), -step[2]) })
        .collect();
    nudges.push(Nudge { offset: Vector3::z() * height_m, ..Nudge::none() });
    for axis in [Vector3::x_axis(), Vector3::y_axis()] {
        nudges.push(Nudge { turn: about(axis, tilt_rad), ..Nudge::none() });
    }
    Some(nudges)
}

/// 1σ of the position, metres, in its worst direction, and of the attitude, radians.
pub fn pose_sigmas(estimate: &PoseEstimate) -> (f64, f64) {
    let [[ee, en, _], [_, nn, _], [_, _, yaw]] = estimate.covariance;
    let plan = (ee + nn) / 2.0 + ((ee - nn) / 2.0).hypot(en);
    (plan.max(0.0).sqrt().max(estimate.height_sigma_m), yaw.max(0.0).sqrt().max(estimate.tilt_sigma_rad))
}
