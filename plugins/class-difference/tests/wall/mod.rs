//! A wall of the toy world, and the detector on it.
#![allow(dead_code, reason = "each test file uses a part")]

use resurvey_class_difference::ClassDifference;
use resurvey_class_difference::settings::{SCHEMA, Settings};
use resurvey_plugin::schema::{ChangeRegion, ClassId, GridPoint, Pose};
use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene};
use resurvey_plugin::{Detector, Plugin, PoseEstimate};

pub const STONE: ClassId = ClassId(0);
pub const GLASS: ClassId = ClassId(1);
pub const BANNER: ClassId = ClassId(3);
pub const CHAIR: ClassId = ClassId(5);
pub const FOLIAGE: ClassId = ClassId(7);
pub const OTHERS: ClassId = ClassId(8);
pub const WIDTH: usize = 960;

/// A stone wall with a glass stripe, 10 m ahead, sky above and ground below.
pub fn wall() -> ToyScene {
    let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
    let stripe = Paint::Texels { columns: 1, rows: 3, classes: vec![STONE, GLASS, STONE] };
    scene.add_wall([-40.0, 10.0], [40.0, 10.0], [0.0, 6.0], stripe);
    scene
}

pub fn pose() -> Pose {
    Pose { position: GridPoint::new(0.0, 0.0, 1.6), yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 }
}

pub fn host(scene: ToyScene) -> ToyHost {
    ToyHost::new(scene, ToyCamera::intrinsics(WIDTH as u32, 720, 120.0))
}

pub fn settings(changes: &[(&str, serde_json::Value)]) -> Settings {
    let schema: serde_json::Value = serde_json::from_str(SCHEMA).expect("the schema is JSON");
    let properties = schema["properties"].as_object().expect("the schema has properties");
    let mut values: serde_json::Map<_, _> =
        properties.iter().map(|(name, property)| (name.clone(), property["default"].clone())).collect();
    values.extend(changes.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
    serde_json::from_value(values.into()).expect("the defaults are settings")
}

pub fn regions_with(
    map: ToyScene,
    photo: Vec<u8>,
    at: Pose,
    changes: &[(&str, serde_json::Value)],
) -> Vec<ChangeRegion> {
    let host = host(map);
    let estimate = PoseEstimate {
        pose: at,
        covariance: [[0.0025, 0.0, 0.0], [0.0, 0.0025, 0.0], [0.0, 0.0, 1e-6]],
        height_sigma_m: 0.05,
        tilt_sigma_rad: 1e-3,
        alignment: None,
    };
    let capture = host.capture(photo, estimate);
    let mut detector = ClassDifference::create(settings(changes)).expect("the defaults are accepted");
    detector.detect(&host, &capture.comparison()).expect("the toy host answers")
}

pub fn regions(map: ToyScene, photo: Vec<u8>) -> Vec<ChangeRegion> {
    regions_with(map, photo, pose(), &[])
}
