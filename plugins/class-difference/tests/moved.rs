//! What a map that is a little off makes of a photo in which nothing changed, and descriptors among it.

mod wall;

use resurvey_plugin::schema::{
    Alignment, ChangeRegion, ClassId, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor,
};
use resurvey_plugin::toy::{Paint, ToyScene};
use resurvey_plugin::{Detector, Plugin, PoseEstimate};
use wall::{BANNER, CHAIR, GLASS, OTHERS, STONE, host, pose, settings, wall};

const METAL: ClassId = ClassId(2);

/// A pillar of stone 0.6 m wide and 3 m from the camera, its left edge at `left_m`, before the glass stripe.
fn pillar(mut scene: ToyScene, left_m: f64) -> ToyScene {
    scene.add_wall([left_m, 3.0], [left_m + 0.6, 3.0], [0.0, 5.0], Paint::Plain(STONE));
    scene
}

/// Regions of the photo that `world` gives against `map`, whose walls stand off by `map_sigma_m` (1σ).
fn regions(map: ToyScene, world: ToyScene, map_sigma_m: f64) -> Vec<ChangeRegion> {
    let labels = host(world).labels(&pose());
    let host = host(map);
    let mut covariance = [[0.0; 6]; 6];
    (0..6).for_each(|axis| covariance[axis][axis] = if axis == 0 || axis == 1 || axis == 3 { 0.0025 } else { 1e-6 });
    let estimate = PoseEstimate {
        pose: pose(),
        covariance: [[0.0025, 0.0, 0.0], [0.0, 0.0025, 0.0], [0.0, 0.0, 1e-6]],
        height_sigma_m: 0.05,
        tilt_sigma_rad: 1e-3,
        alignment: Some(Alignment { covariance, map_sigma_m, label_sigma_px: 2.0 }),
    };
    let capture = host.capture(labels, estimate);
    let mut detector = resurvey_class_difference::ClassDifference::create(settings(&[])).expect("accepted");
    detector.detect(&host, &capture.comparison()).expect("the toy host answers")
}

#[test]
fn glass_that_a_displaced_pillar_uncovers_is_no_change() {
    // A window all of which the pillar hides on the map: its class is nowhere near in the view.
    let window = |mut scene: ToyScene| {
        scene.add_wall([-0.9, 9.95], [0.9, 9.95], [2.1, 3.9], Paint::Plain(METAL));
        scene
    };
    let (map, world) = (pillar(window(wall()), -0.3), pillar(window(wall()), 0.15));
    assert_eq!(regions(map.clone(), world.clone(), 0.25), []);
    assert!(!regions(map, world, 0.01).is_empty(), "where the map is known to be exact, metal on the pillar is new");
}

#[test]
fn a_banner_on_a_pillar_that_may_stand_elsewhere_is_found() {
    let map = pillar(wall(), -0.3);
    let mut world = map.clone();
    world.add_wall([-0.25, 2.99], [0.25, 2.99], [1.0, 2.0], Paint::Plain(BANNER));
    let found = regions(map, world, 0.25);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].class_after, BANNER);
}

#[test]
fn a_window_that_is_higher_than_on_the_map_is_no_change() {
    let window = |glass_m: f64| {
        let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
        scene.add_wall([-40.0, 10.0], [40.0, 10.0], [0.0, 6.0], Paint::Plain(STONE));
        scene.add_wall([-2.0, 9.99], [2.0, 9.99], [2.0, 2.0 + glass_m], Paint::Plain(GLASS));
        scene
    };
    // 0.8 m at 10 m are 28 px, of which two sigmas of the map explain 17.
    assert_eq!(regions(window(1.0), window(1.8), 0.25), []);
}

fn chair() -> Descriptor {
    let position = GridPoint::new(0.0, 4.0, 0.0);
    let size_m = [0.5, 0.5, 0.9];
    Descriptor::Dynamic(DynamicDescriptor { class: CHAIR, position, size_m, yaw_rad: None, sigma: None })
}

#[test]
fn a_chair_behind_a_van_of_the_ground_s_class_is_not_gone() {
    let mut map = wall();
    map.add_descriptor(chair());
    let mut van = map.clone();
    van.add_box(GridPoint::new(0.0, 3.0, 0.0), [2.0, 0.5, 1.9], OTHERS);
    assert_eq!(regions(map.clone(), van, 0.05), []);
    let gone = regions(map, wall(), 0.05);
    assert_eq!(gone.len(), 1, "without the van it is");
    assert_eq!(gone[0].class_before, CHAIR);
}

fn banner(east_m: [f64; 2]) -> MaterialDescriptor {
    let corner = |e: f64, h: f64| GridPoint::new(e, 10.0, h);
    let [left, right] = east_m;
    let corners = [corner(left, 2.2), corner(right, 2.2), corner(right, 3.8), corner(left, 3.8)];
    MaterialDescriptor { class: BANNER, corners, normal: [0.0, -1.0, 0.0], sigma: None }
}

#[test]
fn a_banner_that_grew_is_one_region_over_all_of_it() {
    let with = |east_m| {
        let mut scene = wall();
        scene.add_descriptor(Descriptor::Material(banner(east_m)));
        scene
    };
    let found = regions(with([-2.0, 1.0]), with([-2.0, 2.5]), 0.05);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].class_after, BANNER);
    // 4.5 m at 10 m with 346 px focal length; the whole banner, not the strip of 52 px.
    assert!((150..=160).contains(&found[0].bounds.width()), "{:?}", found[0].bounds);
}

#[test]
fn classes_of_no_table_are_survived() {
    let mut world = wall();
    world.add_wall([-2.0, 9.9], [2.0, 9.9], [1.0, 3.0], Paint::Plain(ClassId(200)));
    assert!(regions(wall(), world, 0.25).len() <= 1);
}
