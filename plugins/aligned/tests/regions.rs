//! What stands a little elsewhere than on the map is no change, and what is new beside it is.

use resurvey_aligned::Aligned;
use resurvey_aligned::settings::{SCHEMA, Settings};
use resurvey_plugin::schema::{ChangeRegion, ClassId, Descriptor, GridPoint, MaterialDescriptor, Pose};
use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene};
use resurvey_plugin::{Detector, Error, Host, Plugin, PoseEstimate};

const STONE: ClassId = ClassId(0);
const GLASS: ClassId = ClassId(1);
const METAL: ClassId = ClassId(2);
const BANNER: ClassId = ClassId(3);
const OTHERS: ClassId = ClassId(8);
const SIZE: [u32; 2] = [960, 720];
/// How far from the map things stand, metres.
const OFF_M: f64 = 0.3;
/// Range of the wall, metres.
const WALL_M: f64 = 10.0;

/// A stone wall with windows 10 m ahead, moved by `off_m` along itself.
fn wall(off_m: f64) -> ToyScene {
    let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
    let (columns, rows) = (20, 5);
    let is_window = |column: usize, row: usize| column % 4 == 1 && row == 3;
    let classes = (0..rows * columns)
        .map(|texel| if is_window(texel % columns, texel / columns) { GLASS } else { STONE })
        .collect();
    let paint = Paint::Texels { columns, rows, classes };
    scene.add_wall([-20.0 + off_m, WALL_M], [20.0 + off_m, WALL_M], [0.0, 6.0], paint);
    scene
}

/// A banner on that wall: left and right, bottom and top, metres.
fn banner([left, right]: [f64; 2], [low, high]: [f64; 2]) -> Descriptor {
    let corner = |e: f64, h: f64| GridPoint::new(e, WALL_M, h);
    let corners = [corner(left, low), corner(right, low), corner(right, high), corner(left, high)];
    Descriptor::Material(MaterialDescriptor { class: BANNER, corners, normal: [0.0, -1.0, 0.0], sigma: None })
}

fn host(scene: ToyScene) -> ToyHost {
    ToyHost::new(scene, ToyCamera::intrinsics(SIZE[0], SIZE[1], 120.0))
}

fn pose() -> Pose {
    Pose { position: GridPoint::new(0.0, 0.0, 1.6), yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 }
}

fn estimate() -> PoseEstimate {
    PoseEstimate {
        pose: pose(),
        covariance: [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 1e-6]],
        height_sigma_m: 0.05,
        tilt_sigma_rad: 1e-3,
        alignment: None,
    }
}

fn detector(changes: &[(&str, serde_json::Value)]) -> Aligned {
    let schema: serde_json::Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
    let properties = schema["properties"].as_object().expect("the schema has properties");
    let mut values: serde_json::Map<_, _> =
        properties.iter().map(|(name, property)| (name.clone(), property["default"].clone())).collect();
    values.extend(changes.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
    let settings: Settings = serde_json::from_value(values.into()).expect("the defaults are settings");
    Aligned::create(settings).expect("the defaults are accepted")
}

/// Regions in the photo of `world` beside the view of `map`; walls of the map are off by at most 0.5 m.
fn regions(map: ToyScene, world: ToyScene) -> Vec<ChangeRegion> {
    let host = host(map);
    let capture = host.capture(self::host(world).labels(&pose()), estimate());
    let mut detector = detector(&[("map_tolerance_m", 0.5.into())]);
    detector.detect(&host, &capture.comparison()).expect("the toy host answers")
}

/// Pixels of the image that show the rectangle on the wall.
fn pixels([left, right]: [f64; 2], [low, high]: [f64; 2]) -> [f64; 4] {
    let corners = [GridPoint::new(left, WALL_M, high), GridPoint::new(right, WALL_M, low)];
    let at = host(wall(0.0)).project(&pose(), &corners).expect("the toy host answers");
    let [from, to] = [at[0], at[1]].map(|at| at.expect("it is ahead"));
    [from[0], from[1], to[0], to[1]]
}

#[test]
fn an_unchanged_photo_has_no_region() {
    assert_eq!(regions(wall(0.0), wall(0.0)), []);
}

#[test]
fn a_wall_that_stands_off_the_map_is_no_change() {
    assert_eq!(regions(wall(0.0), wall(OFF_M)), []);
    assert_eq!(regions(wall(0.0), wall(-OFF_M)), []);
}

#[test]
fn a_new_banner_close_to_an_old_one_on_a_wall_off_the_map_is_found_with_its_edges() {
    let (mut map, mut world) = (wall(0.0), wall(OFF_M));
    let heights_m = [0.6, 1.8];
    let at = |left: f64, right: f64| [left + OFF_M, right + OFF_M];
    map.add_descriptor(banner([-2.0, -0.5], heights_m));
    world.add_descriptor(banner(at(-2.0, -0.5), heights_m));
    let new = at(-0.2, 1.2);
    world.add_descriptor(banner(new, heights_m));
    let found = regions(map, world);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].class_before, found[0].class_after), (STONE, BANNER));
    let bounds = found[0].bounds;
    let edges = [bounds.left, bounds.top, bounds.right, bounds.bottom].map(f64::from);
    let expected = pixels(new, heights_m);
    assert!(
        edges.iter().zip(expected).all(|(edge, expected)| (edge - expected).abs() <= 1.0),
        "{edges:?} {expected:?}"
    );
}

#[test]
fn a_walled_up_window_is_found_although_the_wall_has_its_class_all_around() {
    let mut world = wall(OFF_M);
    let Paint::Texels { classes, .. } = &mut world.rectangles[0].paint else { unreachable!("the wall has texels") };
    let window = 3 * 20 + 9;
    assert_eq!(classes[window], GLASS);
    classes[window] = STONE;
    let found = regions(wall(0.0), world);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].class_before, found[0].class_after), (GLASS, STONE));
    let expected = pixels([-2.0 + OFF_M, OFF_M], [3.6, 4.8]);
    let bounds = found[0].bounds;
    let edges = [bounds.left, bounds.top, bounds.right, bounds.bottom].map(f64::from);
    assert!(
        edges.iter().zip(expected).all(|(edge, expected)| (edge - expected).abs() <= 2.0),
        "{edges:?} {expected:?}"
    );
}

#[test]
fn a_displaced_pillar_with_nothing_new_is_no_change() {
    let with_pillar = |east_m: f64| {
        let mut scene = wall(0.0);
        scene.add_box(GridPoint::new(east_m, 6.0, 0.0), [0.8, 0.8, 5.0], METAL);
        scene
    };
    assert_eq!(regions(with_pillar(1.0), with_pillar(1.0 + OFF_M)), []);
    assert_eq!(regions(with_pillar(1.0), with_pillar(1.0 - OFF_M)), []);
}

#[test]
fn a_banner_that_is_gone_is_one_region_of_the_view() {
    let mut map = wall(0.0);
    map.add_descriptor(banner([-1.8, 1.6], [0.5, 2.0]));
    let found = regions(map, wall(0.0));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].class_before, found[0].class_after), (BANNER, STONE));
}

#[test]
fn images_of_different_size_are_an_error() {
    let host = host(wall(0.0));
    let capture = host.capture(host.labels(&pose()), estimate());
    let mut comparison = capture.comparison();
    let small = [0u8; 4];
    comparison.photo = resurvey_plugin::ImageRef::new(&small, 2, 2, 2).expect("2×2 pixels");
    let Error(text) = detector(&[]).detect(&host, &comparison).expect_err("sizes differ");
    assert!(text.contains("2×2") && text.contains("960×720"), "{text}");
    let mut comparison = capture.comparison();
    let point = [[0.0f32; 3]];
    comparison.view.points = resurvey_plugin::ImageRef::new(&point, 1, 1, 1).expect("1×1 points");
    let Error(text) = detector(&[]).detect(&host, &comparison).expect_err("sizes differ");
    assert!(text.contains("1×1") && text.contains("960×720"), "{text}");
}

#[test]
fn a_covariance_of_nan_and_a_single_pixel_are_survived() {
    let nan = PoseEstimate { covariance: [[f64::NAN; 3]; 3], height_sigma_m: f64::NAN, ..estimate() };
    let whole = host(wall(0.0));
    let capture = whole.capture(whole.labels(&pose()), nan);
    assert_eq!(detector(&[]).detect(&whole, &capture.comparison()), Ok(Vec::new()));
    let host = ToyHost::new(wall(0.0), ToyCamera::intrinsics(1, 1, 120.0));
    for class in [BANNER, STONE, ClassId::VOID] {
        let capture = host.capture(vec![class.0], nan);
        let found = detector(&[]).detect(&host, &capture.comparison()).expect("the toy host answers");
        assert!(found.len() <= 1);
    }
}
