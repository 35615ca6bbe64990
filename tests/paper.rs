//! The paper's equations through detector and estimator together, on analytic scenes: a wall at a known distance, a
//! photo from one pose and a view from another. The oracles are geometry, not earlier results.
#![allow(clippy::panic)]

use resurvey_class_difference::ClassDifference;
use resurvey_descriptors::Descriptors;
use resurvey_plugin::schema::{ClassId, Descriptor, GridPoint, MaterialDescriptor, Pose, Proposal};
use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene};
use resurvey_plugin::{Detector, Estimator, Plugin, PoseEstimate};
use serde_json::{Value, json};

const STONE: ClassId = ClassId(0);
const BANNER: ClassId = ClassId(3);
const CHAIR: ClassId = ClassId(5);
const OTHERS: ClassId = ClassId(8);
/// The banner of these scenes: 6 m by 4 m, its lower edge 1 m above the camera's ground.
const BANNER_M2: f64 = 24.0;

/// A plugin with the defaults of its own schema, in a profile.
fn plugin<P: Plugin>(profile: &str) -> P {
    let schema: Value = serde_json::from_str(P::SETTINGS).expect("a schema is JSON");
    let properties = schema["properties"].as_object().expect("a schema has properties");
    let mut settings: Value = properties.iter().map(|(key, value)| (key.clone(), value["default"].clone())).collect();
    settings["profile"] = json!(profile);
    P::create(serde_json::from_value(settings).expect("defaults are settings")).expect("defaults are allowed")
}

fn pose(east: f64, north: f64, yaw_deg: f64) -> Pose {
    let position = GridPoint::new(835_000.0 + east, 817_000.0 + north, 5.6);
    Pose { position, yaw_rad: yaw_deg.to_radians(), pitch_rad: 0.0, roll_rad: 0.0 }
}

/// A stone wall 10 m north of the origin on level ground at 4 m.
fn surveyed() -> ToyScene {
    let mut scene = ToyScene { ground: Some((4.0, OTHERS)), ..ToyScene::default() };
    scene.add_wall([834_900.0, 817_010.0], [835_100.0, 817_010.0], [4.0, 40.0], Paint::Plain(STONE));
    scene
}

fn with_banner() -> ToyScene {
    let mut scene = surveyed();
    scene.add_wall([834_997.0, 817_010.0 - 1e-6], [835_003.0, 817_010.0 - 1e-6], [5.0, 9.0], Paint::Plain(BANNER));
    scene
}

fn with_chair(east: f64, north: f64) -> ToyScene {
    let mut scene = surveyed();
    scene.add_box(GridPoint::new(835_000.0 + east, 817_000.0 + north, 4.0), [0.5, 0.5, 0.9], CHAIR);
    scene
}

/// What the plugins propose when the photo was taken at `taken` and `believed` is taken for its pose.
fn proposals(real: ToyScene, taken: Pose, believed: Pose, profile: &str) -> Vec<Proposal> {
    let camera = ToyCamera::intrinsics(960, 720, 120.0);
    let host = ToyHost::new(surveyed(), camera);
    let photo = ToyHost::new(real, camera).labels(&taken);
    let estimate = PoseEstimate {
        pose: believed,
        covariance: [[0.0; 3]; 3],
        height_sigma_m: 0.0,
        tilt_sigma_rad: 0.0,
        alignment: None,
    };
    let capture = host.capture(photo, estimate);
    let comparison = capture.comparison();
    let regions = plugin::<ClassDifference>(profile).detect(&host, &comparison).expect("detects");
    plugin::<Descriptors>(profile).estimate(&host, &comparison, &regions).expect("estimates")
}

fn placed(proposals: &[Proposal]) -> &Descriptor {
    match proposals {
        [Proposal::Place { descriptor, .. }] => descriptor,
        other => panic!("expected one descriptor to place, found {other:?}"),
    }
}

fn rectangle(proposals: &[Proposal]) -> &MaterialDescriptor {
    match placed(proposals) {
        Descriptor::Material(rectangle) => rectangle,
        Descriptor::Dynamic(object) => panic!("expected a rectangle, found {object:?}"),
    }
}

/// Area of an upright rectangle on a wall that runs east, m².
fn area_m2(rectangle: &MaterialDescriptor) -> f64 {
    let [bottom_left, bottom_right, _, top_left] = rectangle.corners;
    bottom_left.plan_distance_m(&bottom_right) * (top_left.height_m - bottom_left.height_m)
}

#[test]
fn eq_8_a_region_is_where_class_names_differ_whatever_their_numbers() {
    let camera = ToyCamera::intrinsics(960, 720, 120.0);
    let host = ToyHost::new(surveyed(), camera);
    let at = pose(0.0, 2.0, 0.0);
    let photo = ToyHost::new(with_banner(), camera).labels(&at);
    let banner_px = photo.iter().filter(|&&label| label == BANNER.0).count();
    let estimate =
        PoseEstimate { pose: at, covariance: [[0.0; 3]; 3], height_sigma_m: 0.0, tilt_sigma_rad: 0.0, alignment: None };
    let capture = host.capture(photo, estimate);
    let regions = plugin::<ClassDifference>("paper").detect(&host, &capture.comparison()).unwrap();
    assert_eq!(regions.len(), 1);
    assert_eq!((regions[0].class_before, regions[0].class_after), (STONE, BANNER));
    // f² · area / range²: 346.41² · 24 / 8² = 45 000 px.
    assert_eq!(regions[0].pixels as usize, banner_px);
    assert!((f64::from(regions[0].pixels) - 45_000.0).abs() < 450.0, "{} px", regions[0].pixels);
}

#[test]
fn eq_15_a_banner_comes_back_with_its_corners_and_area() {
    for profile in ["default", "paper"] {
        let found = proposals(with_banner(), pose(1.0, 2.0, -5.0), pose(1.0, 2.0, -5.0), profile);
        let rectangle = rectangle(&found);
        assert_eq!(rectangle.class, BANNER);
        let expected = [(-3.0, 5.0), (3.0, 5.0), (3.0, 9.0), (-3.0, 9.0)];
        for (corner, (east, height)) in rectangle.corners.iter().zip(expected) {
            let truth = GridPoint::new(835_000.0 + east, 817_010.0, height);
            // A pixel is 2.9 cm at 10 m.
            assert!(corner.plan_distance_m(&truth) < 0.06, "{profile}: {corner:?} is not {truth:?}");
            assert!((corner.height_m - height).abs() < 0.06, "{profile}: {corner:?} is not {truth:?}");
        }
        assert!((area_m2(rectangle) / BANNER_M2 - 1.0).abs() < 0.02, "{profile}: {} m²", area_m2(rectangle));
    }
}

#[test]
fn eq_16_a_chair_is_placed_where_it_stands() {
    let at = pose(0.0, 0.0, 0.0);
    let found = proposals(with_chair(0.6, 4.0), at, at, "default");
    let anchor = placed(&found).anchor();
    let truth = GridPoint::new(835_000.6, 817_004.0, 4.0);
    assert!(anchor.plan_distance_m(&truth) < 0.15, "{anchor:?}");
    assert!((anchor.height_m - 4.0).abs() < 1e-3, "{anchor:?}");
}

/// Table V: what a pose error does to the result. Seen from `range` and believed to be taken from `range + e`, a flat
/// target looks (1 + e/z)² as large (the paper calls the growth logarithmic).
#[test]
fn table_5_backing_off_from_a_wall_scales_the_area_with_the_square() {
    for error_m in [-1.0, -0.5, 0.5, 1.0, 2.0] {
        let (taken, believed) = (pose(0.0, 2.0, 0.0), pose(0.0, 2.0 - error_m, 0.0));
        let found = proposals(with_banner(), taken, believed, "default");
        let scale = (1.0 + error_m / 8.0_f64).powi(2);
        let measured = area_m2(rectangle(&found)) / BANNER_M2;
        assert!((measured / scale - 1.0).abs() < 0.02, "{error_m} m: scaled by {measured:.3}, expected {scale:.3}");
    }
}

#[test]
fn table_5_on_level_ground_a_pose_error_moves_an_object_by_exactly_as_much() {
    let taken = pose(0.0, 0.0, 0.0);
    let anchor = |believed| placed(&proposals(with_chair(0.3, 4.0), taken, believed, "default")).anchor();
    let unmoved = anchor(taken);
    for (east, north) in [(1.0, 0.0), (0.0, 1.0), (-0.7, 0.4), (0.0, -2.0)] {
        let moved = anchor(pose(east, north, 0.0));
        let shift = (moved.easting_m - unmoved.easting_m, moved.northing_m - unmoved.northing_m);
        assert!((shift.0 - east).hypot(shift.1 - north) < 0.02, "moved by {shift:?}, expected {:?}", (east, north));
    }
}
