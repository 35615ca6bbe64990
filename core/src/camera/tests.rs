//! What the camera promises, against OpenCV and by construction.

use super::{Camera, CameraError};
use nalgebra::Vector3;
use proptest::prelude::*;
use resurvey_schema::{CameraFile, CameraModel, Intrinsics};

fn file(model: &str) -> CameraFile {
    CameraFile {
        model: model.to_owned(),
        width: 960,
        height: 720,
        fx: None,
        fy: None,
        cx: None,
        cy: None,
        distortion: None,
        diagonal_fov_deg: None,
    }
}

fn brown() -> Camera {
    let (fx, fy, cx, cy) = (Some(760.5), Some(755.25), Some(512.25), Some(383.5));
    let distortion = Some(vec![-0.31, 0.12, 0.0013, -0.0007, -0.021]);
    Camera::from_file(&CameraFile { fx, fy, cx, cy, distortion, ..file("brown") }).unwrap()
}

fn fisheye() -> Camera {
    let (fx, fy, cx, cy) = (Some(310.0), Some(309.0), Some(480.5), Some(360.25));
    let distortion = Some(vec![-0.0123, 0.0045, -0.0021, 0.0004]);
    Camera::from_file(&CameraFile { fx, fy, cx, cy, distortion, ..file("fisheye") }).unwrap()
}

fn assert_projects(camera: &Camera, point: [f64; 3], expected: [f64; 2]) {
    let found = camera.project(Vector3::from(point)).unwrap();
    let off_px = (found[0] - expected[0]).hypot(found[1] - expected[1]);
    assert!(off_px < 1e-9, "{point:?}: found {found:?}, expected {expected:?}");
}

fn assert_sees(camera: &Camera, [u, v]: [f64; 2], [x, y]: [f64; 2], tolerance_rad: f64) {
    let found = camera.ray(u, v).unwrap();
    let expected = Vector3::new(x, y, 1.0).normalize();
    assert!((found - expected).norm() < tolerance_rad, "({u}, {v}): found {found:?}, expected {expected:?}");
}

#[test]
fn a_diagonal_of_120_degrees_at_960_x_720_has_a_focal_length_of_346_41_px() {
    let camera = Camera::from_file(&CameraFile { diagonal_fov_deg: Some(120.0), ..file("pinhole") }).unwrap();
    let Intrinsics { fx, fy, cx, cy, .. } = camera.intrinsics();
    assert!((fx - 346.410_162).abs() < 1e-6 && (fy - fx).abs() < 1e-12);
    assert!((cx - 480.0).abs() < 1e-12 && (cy - 360.0).abs() < 1e-12);
    let corner = camera.ray(960.0, 720.0).unwrap();
    assert!((corner.z.acos().to_degrees() - 60.0).abs() < 1e-9);
}

// OpenCV 5.0.0: cv2.projectPoints(P, 0, 0, K, D) and cv2.undistortPoints(uv, K, D, criteria (3, 200, 1e-14)) with
// K = [[760.5, 0, 512.25], [0, 755.25, 383.5], [0, 0, 1]], D = [-0.31, 0.12, 0.0013, -0.0007, -0.021].
#[test]
fn brown_projection_agrees_with_opencv() {
    assert_projects(&brown(), [0.1, -0.2, 1.0], [587.067_029_868_750_1, 234.895_140_756_250_02]);
    assert_projects(&brown(), [0.5, 0.4, 1.0], [851.201_298_084_750_1, 653.365_071_733_9]);
    assert_projects(&brown(), [-0.6, 0.3, 1.0], [108.410_183_587_5, 584.348_853_165_625]);
    assert_projects(&brown(), [1.2, -0.9, 2.5], [841.092_350_328_96, 138.781_538_136_64]);
    assert_projects(&brown(), [0.0, 0.0, 3.0], [512.25, 383.5]);
}

#[test]
fn brown_rays_agree_with_opencv() {
    assert_sees(&brown(), [100.5, 80.25], [-0.639_655_600_440_875, -0.475_742_020_245_717_3], 1e-8);
    assert_sees(&brown(), [900.0, 700.0], [0.597_821_670_314_615_2, 0.490_049_705_350_045_3], 1e-8);
    assert_sees(&brown(), [300.0, 400.0], [-0.285_968_774_508_820_4, 0.022_280_327_521_181_95], 1e-8);
}

// OpenCV 5.0.0: cv2.fisheye.projectPoints and cv2.fisheye.undistortPoints with K = [[310, 0, 480.5], [0, 309, 360.25],
// [0, 0, 1]], D = [-0.0123, 0.0045, -0.0021, 0.0004].
#[test]
fn fisheye_projection_agrees_with_opencv() {
    assert_projects(&fisheye(), [0.1, -0.2, 1.0], [510.980_460_416_742_3, 299.485_727_298_236_3]);
    assert_projects(&fisheye(), [0.5, 0.4, 1.0], [617.872_858_956_233_4, 469.793_776_561_228_7]);
    assert_projects(&fisheye(), [-3.0, 1.3, 1.0], [123.312_676_427_600_37, 514.531_879_439_820_4]);
    assert_projects(&fisheye(), [1.2, -0.9, 0.5], [785.975_862_153_196, 131.882_157_890_312_33]);
    assert_projects(&fisheye(), [0.0, 5.0, 1.0], [480.5, 777.747_432_396_685_4]);
}

#[test]
fn fisheye_rays_agree_with_opencv() {
    assert_sees(&fisheye(), [100.5, 80.25], [-49.622_015_616_314_044, -36.681_919_225_822_34], 1e-8);
    assert_sees(&fisheye(), [512.25, 20.0], [0.190_716_024_014_565, -2.050_429_317_126_243], 1e-8);
    assert_sees(&fisheye(), [300.0, 400.0], [-0.666_088_234_620_839, 0.147_161_736_476_621], 1e-8);
}

#[test]
fn points_behind_the_camera_are_not_projected() {
    assert_eq!(brown().project(Vector3::new(0.1, 0.1, -1.0)), None);
    assert_eq!(brown().project(Vector3::new(0.1, 0.1, 0.0)), None);
    assert_eq!(brown().project(Vector3::new(f64::NAN, 0.1, 1.0)), None);
}

#[test]
fn a_fisheye_sees_behind_its_image_plane() {
    let seen = fisheye().project(Vector3::new(1.0, 0.0, -0.2)).unwrap();
    let back = fisheye().ray(seen[0], seen[1]).unwrap();
    assert!((back - Vector3::new(1.0, 0.0, -0.2).normalize()).norm() < 1e-9);
}

#[test]
fn beyond_the_turn_of_the_polynomial_nothing_is_projected() {
    // With k1 = −0.3 alone r·(1 − 0.3 r²) turns at r = 1/√0.9 = 1.0541.
    let (fx, fy, cx, cy) = (Some(500.0), Some(500.0), Some(480.0), Some(360.0));
    let distortion = Some(vec![-0.3, 0.0, 0.0, 0.0]);
    let camera = Camera::from_file(&CameraFile { fx, fy, cx, cy, distortion, ..file("brown") }).unwrap();
    assert!(camera.project(Vector3::new(1.053, 0.0, 1.0)).is_some());
    assert_eq!(camera.project(Vector3::new(1.055, 0.0, 1.0)), None);
    // The turn shows at 500 · 0.7027 = 351.36 px from the centre; nothing is seen further out.
    assert!(camera.ray(480.0 + 351.0, 360.0).is_some());
    assert_eq!(camera.ray(480.0 + 352.0, 360.0), None);
}

#[test]
fn unusable_cameras_are_refused_with_what_was_found() {
    let refused = |file: CameraFile| Camera::from_file(&file).unwrap_err().to_string();
    let fov = |deg| CameraFile { diagonal_fov_deg: Some(deg), ..file("pinhole") };
    assert!(refused(file("omni")).contains("found \"omni\""));
    assert!(refused(CameraFile { width: 0, ..fov(90.0) }).contains("found 0 x 720"));
    assert!(refused(CameraFile { width: 20_000, ..fov(90.0) }).contains("found 20000 x 720"));
    assert!(refused(CameraFile { width: 16_384, height: 16_384, ..fov(90.0) }).contains("found 16384 x 16384"));
    assert!(refused(fov(180.0)).contains("between 0 and 180, found 180"));
    assert!(refused(fov(f64::NAN)).contains("found NaN"));
    assert!(refused(file("pinhole")).contains("found none of them"));
    assert!(refused(CameraFile { fx: Some(1.0), ..fov(90.0) }).contains("found fx, diagonal_fov_deg"));
    let focal = |fx| CameraFile { fx: Some(fx), fy: Some(1.0), cx: Some(0.0), cy: Some(0.0), ..file("pinhole") };
    assert!(refused(focal(0.0)).contains("camera.fx"));
    assert!(refused(focal(f64::INFINITY)).contains("camera.fx"));
    assert!(refused(CameraFile { distortion: Some(vec![0.1]), ..fov(90.0) }).contains("expected none"));
    assert!(
        refused(CameraFile { model: "brown".into(), distortion: Some(vec![0.1; 3]), ..fov(90.0) })
            .contains("3 numbers")
    );
    assert!(
        refused(CameraFile { model: "fisheye".into(), distortion: Some(vec![0.1; 5]), ..fov(90.0) })
            .contains("5 numbers")
    );
    let nan = CameraFile { model: "brown".into(), distortion: Some(vec![f64::NAN; 5]), ..fov(90.0) };
    assert!(matches!(Camera::from_file(&nan), Err(CameraError::Number { field: "distortion", .. })));
}

proptest! {
    #[test]
    fn a_subsampled_pixel_has_the_ray_of_its_full_size_pixel(
        (width, height, stride) in (1_u32..70, 1_u32..70, 1_u32..200),
        model in 0_usize..3,
    ) {
        let model = [CameraModel::Pinhole, CameraModel::Brown, CameraModel::Fisheye][model];
        let full = Camera::new(Intrinsics {
            model, width, height, fx: 55.0, fy: 57.0, cx: 20.3, cy: 31.9, distortion: [0.01, 0.002, 0.001, -0.001, 0.0],
        }).unwrap();
        let small = full.subsampled(stride);
        prop_assert!(small.width() >= 1 && small.height() >= 1);
        let stride = if stride / 2 < width.min(height) { stride } else { 2 * width.min(height) - 1 };
        for (i, j) in [(0, 0), (small.width() - 1, small.height() - 1)] {
            let (u, v) = (i * stride + stride / 2, j * stride + stride / 2);
            prop_assert!(u < width && v < height);
            let expected = full.ray(f64::from(u) + 0.5, f64::from(v) + 0.5);
            let found = small.ray(f64::from(i) + 0.5, f64::from(j) + 0.5);
            match (found, expected) {
                (Some(found), Some(expected)) => prop_assert!((found - expected).norm() < 1e-12),
                (found, expected) => prop_assert_eq!(found, expected),
            }
        }
        prop_assert!((small.width() * stride + stride / 2) >= width);
    }

    #[test]
    fn projecting_a_ray_gives_its_pixel_back(u in 0.0..960.0, v in 0.0..720.0, which in 0_usize..3) {
        let pinhole = Camera::from_file(&CameraFile { diagonal_fov_deg: Some(120.0), ..file("pinhole") }).unwrap();
        let camera = [pinhole, brown(), fisheye()][which];
        if let Some(ray) = camera.ray(u, v) {
            prop_assert!((ray.norm() - 1.0).abs() < 1e-12);
            let [found_u, found_v] = camera.project(ray * 3.0).unwrap();
            prop_assert!((found_u - u).abs() < 1e-6 && (found_v - v).abs() < 1e-6);
        }
    }

    #[test]
    fn no_distortion_makes_the_camera_panic(d in proptest::collection::vec(-1e6..1e6_f64, 5), u in -1e4..1e4, v in -1e4..1e4) {
        let distortion: [f64; 5] = d.try_into().unwrap();
        for model in [CameraModel::Brown, CameraModel::Fisheye] {
            let camera = Camera::new(Intrinsics {
                model, width: 9, height: 9, fx: 5.0, fy: 5.0, cx: 4.0, cy: 4.0, distortion,
            }).unwrap();
            if let Some(ray) = camera.ray(u, v) {
                prop_assert!((ray.norm() - 1.0).abs() < 1e-9);
            }
        }
    }
}
