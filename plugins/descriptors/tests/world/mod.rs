//! A street in the toy world: a façade of stone with glass windows 20 m north of the camera, a pavement before it.
// Each test file uses a part of it, and a helper of tests may panic.
#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use resurvey_class_difference::ClassDifference;
use resurvey_descriptors::Descriptors;
use resurvey_plugin::schema::{
    ChangeRegion, ClassId, Descriptor, DynamicDescriptor, GridPoint, Intrinsics, MaterialDescriptor, Pose, Proposal,
    Rejection,
};
use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene};
use resurvey_plugin::{Detector, Estimator, Plugin, PoseEstimate};

pub const STONE: ClassId = ClassId(0);
pub const GLASS: ClassId = ClassId(1);
pub const METAL: ClassId = ClassId(2);
pub const BANNER: ClassId = ClassId(3);
pub const PEDESTRIAN: ClassId = ClassId(4);
pub const CHAIR: ClassId = ClassId(5);
pub const FOLIAGE: ClassId = ClassId(7);
pub const OTHERS: ClassId = ClassId(8);

/// Easting and northing of the camera; of the size of real ones, so that precision counts.
pub const ORIGIN: [f64; 2] = [836_000.0, 818_000.0];
/// Distance of the façade, metres.
pub const FACADE_M: f64 = 20.0;

pub fn at(east_m: f64, north_m: f64, height_m: f64) -> GridPoint {
    GridPoint::new(ORIGIN[0] + east_m, ORIGIN[1] + north_m, height_m)
}

/// Windows of 1.5 × 1.5 m every 3 m on stone: a wall of 60 × 24 m.
fn windows() -> Paint {
    let (columns, rows) = (40, 16);
    let is_window = |texel: usize| texel % columns % 2 == 1 && texel / columns % 2 == 1;
    let classes = (0..columns * rows).map(|texel| if is_window(texel) { GLASS } else { STONE }).collect();
    Paint::Texels { columns, rows, classes }
}

pub fn street() -> ToyScene {
    let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
    let plan = |east_m: f64, north_m: f64| [ORIGIN[0] + east_m, ORIGIN[1] + north_m];
    scene.add_wall(plan(-30.0, FACADE_M), plan(30.0, FACADE_M), [0.0, 24.0], windows());
    scene.add_wall(plan(-30.0, 5.0), plan(-30.0, FACADE_M), [0.0, 15.0], Paint::Plain(METAL));
    scene
}

pub fn banner(centre: GridPoint, width_m: f64, height_m: f64) -> Descriptor {
    let corner = |right: f64, up: f64| {
        let (east_m, height_m) = (right * width_m / 2.0, up * height_m / 2.0);
        GridPoint::new(centre.easting_m + east_m, centre.northing_m, centre.height_m + height_m)
    };
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    Descriptor::Material(MaterialDescriptor { class: BANNER, corners, normal: [0.0, -1.0, 0.0], sigma: None })
}

pub fn object(class: ClassId, position: GridPoint) -> Descriptor {
    let size_m = if class == CHAIR { [0.5, 0.5, 0.9] } else { [0.5, 0.5, 1.7] };
    Descriptor::Dynamic(DynamicDescriptor { class, position, size_m, yaw_rad: None, sigma: None })
}

pub fn camera() -> Intrinsics {
    ToyCamera::intrinsics(960, 720, 120.0)
}

/// Eye height, looking north and a little up.
pub fn pose() -> Pose {
    Pose { position: at(0.0, 0.0, 1.6), yaw_rad: 0.0, pitch_rad: 0.05, roll_rad: 0.0 }
}

/// `pose` with 1σ of `position_m` and `angle_deg`.
pub fn estimate(pose: Pose, position_m: f64, angle_deg: f64) -> PoseEstimate {
    let (variance_m2, angle_rad) = (position_m * position_m, angle_deg.to_radians());
    PoseEstimate {
        pose,
        covariance: [[variance_m2, 0.0, 0.0], [0.0, variance_m2, 0.0], [0.0, 0.0, angle_rad * angle_rad]],
        height_sigma_m: position_m / 2.0,
        tilt_sigma_rad: angle_rad,
        alignment: None,
    }
}

/// A pose that is known as well as a surveyor knows it.
pub fn known(pose: Pose) -> PoseEstimate {
    estimate(pose, 0.02, 0.02)
}

/// `map` with `added` on it.
pub fn with(mut scene: ToyScene, added: &[Descriptor]) -> ToyScene {
    for descriptor in added {
        scene.add_descriptor(descriptor.clone());
    }
    scene
}

/// Labels of a photo of `world` at `pose`.
pub fn photo(world: ToyScene, pose: &Pose) -> Vec<u8> {
    ToyHost::new(world, camera()).labels(pose)
}

/// The defaults of a settings schema with `changes` on them.
pub fn settings<P: Plugin>(changes: &[(&str, serde_json::Value)]) -> P::Settings {
    let schema: serde_json::Value = serde_json::from_str(P::SETTINGS).unwrap();
    let properties = schema["properties"].as_object().unwrap();
    let mut values: serde_json::Map<_, _> =
        properties.iter().map(|(name, property)| (name.clone(), property["default"].clone())).collect();
    for (name, value) in changes {
        assert!(values.insert((*name).to_owned(), value.clone()).is_some(), "no setting {name}");
    }
    serde_json::from_value(values.into()).unwrap()
}

/// Regions and proposals for `photo` against `map`, with default settings.
pub fn update(map: ToyScene, photo: Vec<u8>, estimate: PoseEstimate) -> (Vec<ChangeRegion>, Vec<Proposal>) {
    update_with(map, photo, estimate, &[], &[])
}

pub fn update_with(
    map: ToyScene,
    photo: Vec<u8>,
    estimate: PoseEstimate,
    detector: &[(&str, serde_json::Value)],
    estimator: &[(&str, serde_json::Value)],
) -> (Vec<ChangeRegion>, Vec<Proposal>) {
    let host = ToyHost::new(map, camera());
    let capture = host.capture(photo, estimate);
    let mut detector = ClassDifference::create(settings::<ClassDifference>(detector)).unwrap();
    let mut estimator = Descriptors::create(settings::<Descriptors>(estimator)).unwrap();
    let regions = detector.detect(&host, &capture.comparison()).unwrap();
    let proposals = estimator.estimate(&host, &capture.comparison(), &regions).unwrap();
    (regions, proposals)
}

/// The descriptors placed.
pub fn placed(proposals: &[Proposal]) -> Vec<&Descriptor> {
    proposals
        .iter()
        .filter_map(|proposal| match proposal {
            Proposal::Place { descriptor, .. } => Some(descriptor),
            _ => None,
        })
        .collect()
}

/// The rejections.
pub fn rejected(proposals: &[Proposal]) -> Vec<&Rejection> {
    proposals
        .iter()
        .filter_map(|proposal| match proposal {
            Proposal::Reject { rejection, .. } => Some(rejection),
            _ => None,
        })
        .collect()
}

/// The one material descriptor placed.
pub fn the_banner(proposals: &[Proposal]) -> &MaterialDescriptor {
    match placed(proposals)[..] {
        [Descriptor::Material(banner)] => banner,
        _ => panic!("expected one banner, found {proposals:?}"),
    }
}

/// Width, height and area of a rectangle, from its corners.
pub fn measures(banner: &MaterialDescriptor) -> [f64; 3] {
    let [a, b, _, d] = banner.corners;
    let width_m = a.plan_distance_m(&b).hypot(b.height_m - a.height_m);
    let height_m = a.plan_distance_m(&d).hypot(d.height_m - a.height_m);
    [width_m, height_m, width_m * height_m]
}

/// Distance in space, metres.
pub fn distance_m(a: &GridPoint, b: &GridPoint) -> f64 {
    a.plan_distance_m(b).hypot(a.height_m - b.height_m)
}
