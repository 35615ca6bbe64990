//! Equidistant fisheye with a polynomial in the angle (Kannala & Brandt 2006), as OpenCV's `fisheye` module has it.

use nalgebra::Vector3;
use std::f64::consts::PI;

/// Distortion of the angle from the optical axis, with the angle up to which it can be inverted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fisheye {
    k: [f64; 4],
    max_angle_rad: f64,
}

impl Fisheye {
    /// The model of k1…k4.
    pub(super) fn new([k1, k2, k3, k4]: [f64; 4]) -> Self {
        let turning = super::model::first_descent(|angle| {
            let s = angle * angle;
            1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)))
        });
        Self { k: [k1, k2, k3, k4], max_angle_rad: turning.min(PI) }
    }

    /// Normalised image coordinates of a direction; `None` beyond the invertible angle. Directions behind the image
    /// plane (more than 90° off the axis) are seen.
    pub(super) fn project(&self, direction: Vector3<f64>) -> Option<[f64; 2]> {
        let across = direction.x.hypot(direction.y);
        let angle_rad = across.atan2(direction.z);
        if angle_rad >= self.max_angle_rad {
            return None;
        }
        if across < f64::MIN_POSITIVE {
            return Some([0.0, 0.0]);
        }
        let scale = self.distort(angle_rad) / across;
        Some([direction.x * scale, direction.y * scale])
    }

    /// Unit direction of normalised image coordinates; `None` outside the image circle.
    pub(super) fn direction(&self, [x, y]: [f64; 2]) -> Option<Vector3<f64>> {
        let distorted = x.hypot(y);
        if distorted < f64::MIN_POSITIVE {
            return Some(Vector3::z());
        }
        let angle_rad = super::model::invert_rising(|angle| self.distort(angle), distorted, self.max_angle_rad)?;
        let (sin, cos) = angle_rad.sin_cos();
        Some(Vector3::new(x / distorted * sin, y / distorted * sin, cos))
    }

    fn distort(&self, angle_rad: f64) -> f64 {
        let s = angle_rad * angle_rad;
        let [k1, k2, k3, k4] = self.k;
        angle_rad * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))))
    }
}
