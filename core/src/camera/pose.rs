//! Poses as rotations between the map frame (E, N, H) and the camera frame (x right, y down, z forward).

use nalgebra::{Matrix3, Rotation3, Vector3};
use resurvey_schema::Pose;

/// Rotation that takes camera axes to E, N, H; its columns are right, down and forward.
pub fn world_from_camera(pose: &Pose) -> Rotation3<f64> {
    let (sin_yaw, cos_yaw) = pose.yaw_rad.sin_cos();
    let (sin_pitch, cos_pitch) = pose.pitch_rad.sin_cos();
    let (sin_roll, cos_roll) = pose.roll_rad.sin_cos();
    let forward = Vector3::new(sin_yaw * cos_pitch, cos_yaw * cos_pitch, sin_pitch);
    let level_right = Vector3::new(cos_yaw, -sin_yaw, 0.0);
    let level_down = forward.cross(&level_right);
    let right = level_right * cos_roll + level_down * sin_roll;
    let down = level_down * cos_roll - level_right * sin_roll;
    Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, down, forward]))
}

/// Rotation that takes E, N, H to camera axes.
pub fn camera_from_world(pose: &Pose) -> Rotation3<f64> {
    world_from_camera(pose).inverse()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use resurvey_schema::GridPoint;

    fn pose(yaw_deg: f64, pitch_deg: f64, roll_deg: f64) -> Pose {
        Pose {
            position: GridPoint::new(0.0, 0.0, 0.0),
            yaw_rad: yaw_deg.to_radians(),
            pitch_rad: pitch_deg.to_radians(),
            roll_rad: roll_deg.to_radians(),
        }
    }

    fn assert_near(found: Vector3<f64>, expected: [f64; 3]) {
        assert!((found - Vector3::from(expected)).norm() < 1e-12, "found {found:?}, expected {expected:?}");
    }

    #[test]
    fn a_level_camera_looking_north_has_east_on_its_right_and_down_below() {
        let rotation = world_from_camera(&pose(0.0, 0.0, 0.0));
        assert_near(rotation * Vector3::z(), [0.0, 1.0, 0.0]);
        assert_near(rotation * Vector3::x(), [1.0, 0.0, 0.0]);
        assert_near(rotation * Vector3::y(), [0.0, 0.0, -1.0]);
    }

    #[test]
    fn yaw_is_clockwise_pitch_is_up_and_roll_lowers_the_right_side() {
        assert_near(world_from_camera(&pose(90.0, 0.0, 0.0)) * Vector3::z(), [1.0, 0.0, 0.0]);
        let half = 0.5_f64.sqrt();
        assert_near(world_from_camera(&pose(0.0, 45.0, 0.0)) * Vector3::z(), [0.0, half, half]);
        assert_near(world_from_camera(&pose(0.0, 0.0, 90.0)) * Vector3::x(), [0.0, 0.0, -1.0]);
    }

    #[test]
    fn columns_are_the_written_formulas() {
        // conventions.md for yaw 30°, pitch 20°, roll 10°, evaluated by hand in numpy 2.2.
        let rotation = world_from_camera(&pose(30.0, 20.0, 10.0));
        assert_near(
            rotation * Vector3::z(),
            [0.469_846_310_392_954_2, 0.813_797_681_349_373_7, 0.342_020_143_325_668_7],
        );
        let (y, p, r) = (30_f64.to_radians(), 20_f64.to_radians(), 10_f64.to_radians());
        // down0 written out: forward × right0 = (sin p · sin y, sin p · cos y, −cos p).
        let down0 = [p.sin() * y.sin(), p.sin() * y.cos(), -p.cos()];
        let right0 = [y.cos(), -y.sin(), 0.0];
        assert_near(rotation * Vector3::x(), std::array::from_fn(|k| r.cos() * right0[k] + r.sin() * down0[k]));
        assert_near(rotation * Vector3::y(), std::array::from_fn(|k| -r.sin() * right0[k] + r.cos() * down0[k]));
    }

    proptest! {
        #[test]
        fn every_pose_is_a_proper_rotation(yaw in -720.0..720.0, pitch in -90.0..90.0, roll in -180.0..180.0) {
            let rotation = world_from_camera(&pose(yaw, pitch, roll));
            prop_assert!((rotation.matrix().determinant() - 1.0).abs() < 1e-12);
            let round_trip = camera_from_world(&pose(yaw, pitch, roll)) * rotation;
            prop_assert!((round_trip.matrix() - Matrix3::identity()).norm() < 1e-12);
        }
    }
}
