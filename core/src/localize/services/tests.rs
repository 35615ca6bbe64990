use super::*;
use crate::camera::Camera;
use crate::image::Raster;
use crate::localize::Silent;
use crate::mesh::{Mesh, Object, Surface};
use crate::version::Digest;
use resurvey_schema::service::{ClassSet, Prior};
use resurvey_schema::{CameraModel, ClassId, Intrinsics};

const ORIGIN: GridPoint = GridPoint::new(836_000.0, 818_000.0, 4.0);
/// Finite numbers that nobody means.
const EXTREMES: [f64; 12] = [0.0, -0.0, 5e-324, -1e-300, 1.0, -1.0, 1e9, -4e18, 1e19, 1e300, f64::MAX, f64::MIN];

fn quad(corners: [[f32; 3]; 4]) -> Object {
    let mesh = Mesh {
        origin: ORIGIN,
        vertices: corners.to_vec(),
        uvs: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_surfaces: vec![0, 0],
        surfaces: vec![Surface::Class(ClassId(0))],
    };
    Object { name: "quad".to_owned(), mesh }
}

/// The ground, and the four walls of a block 10 m north of the origin, 6 m high.
fn world() -> World {
    let plan = [[-5.0, 10.0], [5.0, 10.0], [5.0, 20.0], [-5.0, 20.0]];
    let walls = (0..4).map(|side| {
        let ([a, b], [c, d]) = (plan[side], plan[(side + 1) % 4]);
        quad([[a, b, 0.0], [c, d, 0.0], [c, d, 6.0], [a, b, 6.0]])
    });
    let ground = quad([[-50.0, -50.0, 0.0], [50.0, -50.0, 0.0], [50.0, 50.0, 0.0], [-50.0, 50.0, 0.0]]);
    let objects: Vec<Object> = walls.chain([ground]).collect();
    let with_ids: Vec<(u64, &Object)> = (1..).zip(&objects).collect();
    World::new(ORIGIN, &with_ids, Vec::new(), ClassTable::default())
}

fn pose() -> Pose {
    let position = GridPoint { height_m: ORIGIN.height_m + 1.6, ..ORIGIN };
    Pose { position, yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 }
}

fn capture() -> Capture {
    let (width, height) = (40, 30);
    let distortion = [0.01, 0.0, 0.0, 0.0, 0.0];
    let intrinsics =
        Intrinsics { model: CameraModel::Brown, width, height, fx: 20.0, fy: 20.0, cx: 20.0, cy: 15.0, distortion };
    let sigma = 1.0;
    let prior = Prior {
        pose: pose(),
        position_sigma_m: sigma,
        height_sigma_m: sigma,
        yaw_sigma_rad: sigma,
        tilt_sigma_rad: sigma,
    };
    Capture {
        labels: Raster::filled(width, height, 0),
        label_bytes: Vec::new(),
        camera: Camera::new(intrinsics).unwrap(),
        prior,
        taken_at: None,
        digest: Digest::of(&[]),
    }
}

fn with_services<T>(test: impl FnOnce(&SceneServices<'_>) -> T) -> T {
    let (world, capture) = (world(), capture());
    test(&SceneServices::new(&world, &capture, Crs::Hk1980, &Silent))
}

fn comparing(stride: u32, boundary_tolerance_px: f64) -> CompareRequest {
    CompareRequest {
        stride,
        boundary_tolerance_px,
        ignored_in_photo: ClassSet::default(),
        ignored_in_view: ClassSet::default(),
    }
}

fn panorama(columns: u32, yaw_count: u32) -> PanoramaRequest {
    PanoramaRequest {
        pitch_rad: 0.0,
        roll_rad: 0.0,
        first_yaw_rad: 0.0,
        yaw_step_columns: 1,
        yaw_count,
        columns,
        ignored_in_photo: ClassSet::default(),
        ignored_in_view: ClassSet::default(),
    }
}

/// Poses with one number replaced.
fn odd_poses(value: f64) -> Vec<Pose> {
    let numbers: [f64; 6] = pose().into();
    (0..6)
        .map(|at| {
            let mut odd = numbers;
            odd[at] = value;
            odd.into()
        })
        .collect()
}

#[test]
fn every_finite_argument_of_a_service_is_answered_or_refused() {
    with_services(|services| {
        let mut counts = vec![ClassCounts::default(); services.classes_count()];
        for value in EXTREMES {
            for pose in odd_poses(value) {
                let _ = services.render(1, true, &[pose], &mut |_| {});
                let _ = services.compare_views(&comparing(1, 2.0), &[pose], &mut counts);
                let _ = services.compare_panoramas(&panorama(360, 1), &[pose.position], &mut counts);
                let _ = services.pixel_rays(&pose, &[[value, 3.0], [3.0, value]]);
                let _ = services.project(&pose, &[pose.position, pose.position]);
                let _ = services.inside_solid(&[pose.position]);
                let _ = services.cast_rays(pose.position, &[[0.0, 1.0, 0.0]], value, true);
                let _ = services.descriptors_near(pose.position, value);
                let _ = services.ground_height(pose.position);
                let _ = services.wgs84_from_grid(pose.position);
                let [latitude_deg, longitude_deg, ellipsoidal_height_m]: [f64; 3] = pose.position.into();
                let _ = services.grid_from_wgs84(Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m });
            }
            for direction in [[value, 1.0, 0.0], [0.0, value, value], [value; 3]] {
                let _ = services.cast_rays(ORIGIN, &[direction], 100.0, false);
            }
            let _ = services.compare_views(&comparing(1, value), &[pose()], &mut counts);
            for (yaw, pitch, roll) in [(value, 0.0, 0.0), (0.0, value, 0.0), (0.0, 0.0, value)] {
                let odd = PanoramaRequest { first_yaw_rad: yaw, pitch_rad: pitch, roll_rad: roll, ..panorama(360, 1) };
                let _ = services.compare_panoramas(&odd, &[pose().position], &mut counts);
            }
        }
        for stride in [0, 1, 30, 31, u32::MAX] {
            let _ = services.render(stride, true, &[pose()], &mut |_| {});
            let _ = services.compare_views(&comparing(stride, 1.0), &[pose()], &mut counts);
        }
        for (columns, yaws, step) in [(4, 4, u32::MAX), (7200, 0, 0), (7200, u32::MAX, 1), (u32::MAX, 1, 1)] {
            let odd = PanoramaRequest { yaw_step_columns: step, ..panorama(columns, yaws) };
            let _ = services.compare_panoramas(&odd, &[], &mut []);
        }
    });
}

#[test]
fn what_would_overflow_or_fill_the_memory_is_refused_by_name() {
    with_services(|services| {
        let mut counts = vec![ClassCounts::default(); services.classes_count()];
        let mut said = |tolerance_px| {
            let refused = services.compare_views(&comparing(2, tolerance_px), &[pose()], &mut counts);
            refused.unwrap_err().to_string()
        };
        assert_eq!(said(1e12), "boundary tolerance is 1000000000000 px at stride 2; expected 0 to 200");
        assert!(said(1e300).ends_with("px at stride 2; expected 0 to 200"));
        let panorama = services.compare_panoramas(&panorama(360, 361), &[], &mut []).unwrap_err();
        assert_eq!(panorama.to_string(), "yaw_count is 361; expected at most one a column, 360");
        let odd = GridPoint { easting_m: 1e300, ..ORIGIN };
        let far = services.inside_solid(&[odd]).unwrap_err().to_string();
        assert!(far.starts_with("position: expected at most 1000000000 m from zero, found 1"), "{far}");
    });
}

#[test]
fn no_more_is_kept_ready_than_a_search_uses_however_many_ways_are_asked_for() {
    with_services(|services| {
        let heights = || (0..100).map(|step| f64::from(step) * 0.1);
        let at = |height_m: f64| GridPoint {
            northing_m: ORIGIN.northing_m + 15.0,
            height_m: ORIGIN.height_m + height_m,
            ..ORIGIN
        };
        // The block is 6 m high; below the ground there is none.
        let inside = services.inside_solid(&heights().map(at).collect::<Vec<_>>()).unwrap();
        assert_eq!(inside, heights().map(|height_m| height_m < 6.0).collect::<Vec<_>>());
        let mut counts = vec![ClassCounts::default(); services.classes_count()];
        for step in 1..20 {
            services.compare_views(&comparing(1, f64::from(step)), &[pose()], &mut counts).unwrap();
            let request = PanoramaRequest { pitch_rad: f64::from(step) * 0.01, ..panorama(60, 1) };
            services.compare_panoramas(&request, &[pose().position], &mut counts).unwrap();
        }
        let kept = [
            services.solids.lock().unwrap().len(),
            services.view_photos.lock().unwrap().len(),
            services.position_photos.lock().unwrap().len(),
        ];
        assert_eq!(kept, [MOST_KEPT; 3]);
    });
}
