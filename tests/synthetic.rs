//! The invented captures are judges, so they are judged first: by analytic scenes, by the conventions written down once
//! more, and by their own repetition.

#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

use serde_json::Value;
use std::collections::BTreeSet;
use synthetic::model::Model;
use synthetic::world::class;
use synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, SceneKind, full_suite, three_ds};

fn case(kind: SceneKind, change: ChangeKind, noise: NoiseLevel, seed: u64) -> Case {
    let name = format!("{}-{}", kind.name(), change.name());
    Case::new(&Scene::new(kind, 4), CaseSpec { name, change, noise, seed, grid_prior: true })
        .expect("a pose shows the change")
}

/// Pixel of a grid point by the formulas of the conventions, from the numbers in the files alone.
fn pixel(capture: &Value, pose: &Value, point: [f64; 3]) -> [f64; 2] {
    let number = |value: &Value, key: &str| value[key].as_f64().expect("a number");
    let [yaw, pitch, roll] = ["yaw_deg", "pitch_deg", "roll_deg"].map(|key| number(pose, key).to_radians());
    let offset = [0, 1, 2].map(|i| point[i] - number(pose, ["easting", "northing", "height"][i]));
    let forward = [yaw.sin() * pitch.cos(), yaw.cos() * pitch.cos(), pitch.sin()];
    let right0 = [yaw.cos(), -yaw.sin(), 0.0];
    let down0 = [
        forward[1] * right0[2] - forward[2] * right0[1],
        forward[2] * right0[0] - forward[0] * right0[2],
        forward[0] * right0[1] - forward[1] * right0[0],
    ];
    let along = |axis: [f64; 3]| offset.iter().zip(axis).map(|(a, b)| a * b).sum::<f64>();
    let (x0, y0, z) = (along(right0), along(down0), along(forward));
    let (x, y) = (roll.cos() * x0 + roll.sin() * y0, roll.cos() * y0 - roll.sin() * x0);
    let camera = &capture["camera"];
    [number(camera, "fx") * x / z + number(camera, "cx"), number(camera, "fy") * y / z + number(camera, "cy")]
}

/// Pixels of a class as left, top, right, bottom of their bounds.
fn bounds(case: &Case, class: u8) -> [f64; 4] {
    let at = case.labels.iter().enumerate().filter(|&(_, &label)| label == class);
    let pixels: Vec<[f64; 2]> = at.map(|(i, _)| [(i % case.width) as f64, (i / case.width) as f64]).collect();
    assert!(!pixels.is_empty(), "class {class} is not in the photo");
    let least = |axis: usize| pixels.iter().map(|pixel| pixel[axis]).fold(f64::INFINITY, f64::min);
    let most = |axis: usize| pixels.iter().map(|pixel| pixel[axis] + 1.0).fold(0.0, f64::max);
    [least(0), least(1), most(0), most(1)]
}

#[test]
fn a_true_banner_is_where_the_photo_shows_it() {
    let mut checked = 0;
    let places = (0..8).map(|seed| (SceneKind::Street, seed)).chain((0..5).map(|seed| (SceneKind::Hall, seed)));
    for (kind, seed) in places {
        let case = case(kind, ChangeKind::Banner, NoiseLevel::IDEAL, seed);
        let capture = serde_json::to_value(&case.capture).unwrap();
        let corners = case.truth.changes[0].corners.unwrap();
        let pixels = corners.map(|corner| pixel(&capture, &case.truth.json["pose"], corner));
        let low = |axis: usize| pixels.iter().map(|pixel| pixel[axis]).fold(f64::INFINITY, f64::min);
        let high = |axis: usize| pixels.iter().map(|pixel| pixel[axis]).fold(0.0, f64::max);
        // Hoardings of the map have the same class: judged where the new banner is the only one.
        let banner_px = case.labels.iter().filter(|&&label| label == class::BANNER).count();
        if case.truth.json["change_px"] != banner_px {
            continue;
        }
        checked += 1;
        let [left, top, right, bottom] = bounds(&case, class::BANNER);
        for (found, expected) in [(left, low(0)), (top, low(1)), (right, high(0)), (bottom, high(1))] {
            assert!((found - expected).abs() < 1.5, "{kind:?} {seed}: found {found} px, expected {expected} px");
        }
    }
    assert!(checked >= 5, "only {checked} photos show no other banner");
}

#[test]
fn corners_of_a_banner_go_round_from_bottom_left_as_seen_from_outside() {
    for (kind, seed) in [(SceneKind::Street, 1), (SceneKind::Street, 2), (SceneKind::Alley, 1), (SceneKind::Hall, 1)] {
        let case = case(kind, ChangeKind::Banner, NoiseLevel::IDEAL, seed);
        let capture = serde_json::to_value(&case.capture).unwrap();
        let corners = case.truth.changes[0].corners.unwrap();
        let [a, b, c, d] = corners.map(|corner| pixel(&capture, &case.truth.json["pose"], corner));
        assert!(a[0] < b[0] && d[0] < c[0] && a[1] > d[1] && b[1] > c[1], "{kind:?}: {a:?} {b:?} {c:?} {d:?}");
        assert!((corners[0][2] - corners[1][2]).abs() < 1e-9 && corners[3][2] > corners[0][2]);
    }
}

#[test]
fn a_pedestrian_stands_on_the_ground_where_the_photo_shows_it() {
    let case = case(SceneKind::Street, ChangeKind::Pedestrian, NoiseLevel::IDEAL, 3);
    let capture = serde_json::to_value(&case.capture).unwrap();
    let [e, n, h] = case.truth.changes[0].position.unwrap();
    assert!((h - 4.2).abs() < 1e-9, "the street lies at 4.2 m");
    let [left, top, right, bottom] = bounds(&case, class::PEDESTRIAN);
    let at = |height: f64| pixel(&capture, &case.truth.json["pose"], [e, n, height]);
    assert!(left < at(h)[0] && at(h)[0] < right);
    assert!(top < at(h + 1.69)[1] && at(h + 0.01)[1] < bottom);
}

#[test]
fn the_same_seed_gives_the_same_capture_and_another_seed_another() {
    let first = case(SceneKind::Hall, ChangeKind::TwoChairs, NoiseLevel::LIGHT, 5);
    assert_eq!(first, case(SceneKind::Hall, ChangeKind::TwoChairs, NoiseLevel::LIGHT, 5));
    assert_ne!(first.labels, case(SceneKind::Hall, ChangeKind::TwoChairs, NoiseLevel::LIGHT, 6).labels);
}

#[test]
fn priors_stay_inside_the_search() {
    for seed in 0..40 {
        let error = {
            let scene = Scene::new(SceneKind::Street, 4);
            let mut random = synthetic::random::Random::new(seed, "prior");
            synthetic::prior::PriorError::draw(&scene, &NoiseLevel::FIELD, &mut random)
        };
        assert!(error.offset_m[0].hypot(error.offset_m[1]) < 35.0 && error.yaw_deg.abs() < 35.0);
    }
}

#[test]
fn what_the_map_knew_and_the_photo_misses_is_in_the_base_changes() {
    let removed = case(SceneKind::Hall, ChangeKind::ChairRemoved, NoiseLevel::LIGHT, 2);
    assert_eq!(removed.base_changes.len(), 3, "a header and two chairs");
    assert_eq!(removed.truth.changes[0].op, "remove");
    assert!(removed.truth.json["change_px"].as_u64().unwrap() > 0);
    let none = case(SceneKind::Hall, ChangeKind::None, NoiseLevel::LIGHT, 2);
    assert!(none.base_changes.is_empty() && none.truth.changes.is_empty());
    assert_eq!(none.truth.json["change_px"], 0);
}

#[test]
fn the_model_holds_every_mapped_face_once() {
    for kind in SceneKind::ALL {
        let scene = Scene::new(kind, 4);
        let model = Model::new(&scene.world).unwrap();
        let blocks = scene.world.blocks.iter().filter(|block| block.mapped).count();
        let extra = if kind == SceneKind::Hall { 1 } else { 0 };
        // Four walls and a lid a block; the street's ground or the room's floor.
        let ground = usize::from(kind != SceneKind::Hall);
        assert_eq!(model.triangles(), 2 * (5 * blocks + extra + ground), "{kind:?}");
    }
}

#[test]
fn the_3ds_chunks_fill_the_file_exactly() {
    let model = Model::new(&Scene::new(SceneKind::Street, 4).world).unwrap();
    let bytes = three_ds::encode(&model);
    let chunk = |at: usize| {
        let id = u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let length = u32::from_le_bytes([bytes[at + 2], bytes[at + 3], bytes[at + 4], bytes[at + 5]]);
        (id, length as usize)
    };
    assert_eq!(chunk(0), (0x4d4d, bytes.len()));
    let mut at = 6 + chunk(6).1;
    assert_eq!(chunk(at).0, 0x3d3d);
    let end = at + chunk(at).1;
    at += 6;
    let mut objects = 0;
    while at < end {
        objects += usize::from(chunk(at).0 == 0x4000);
        at += chunk(at).1;
    }
    assert_eq!((at, end, objects), (bytes.len(), bytes.len(), model.parts.len()));
}

#[test]
fn half_of_the_full_suite_is_without_a_change_and_no_two_captures_are_one() {
    let suites = full_suite(1, 26);
    let specs: Vec<CaseSpec> =
        suites.iter().flat_map(|suite| suite.specs(&Scene::new(suite.scene, suite.seed))).collect();
    assert!(specs.len() >= 200, "{} captures", specs.len());
    let unchanged = specs.iter().filter(|spec| spec.change == ChangeKind::None).count();
    assert_eq!(2 * unchanged, specs.len());
    let names: BTreeSet<&str> = specs.iter().map(|spec| spec.name.as_str()).collect();
    assert_eq!(names.len(), specs.len(), "each has a directory of its own");
    let places = |spec: &CaseSpec| (spec.name.split('-').next().map(str::to_owned), spec.seed);
    let drawn: BTreeSet<_> = specs.iter().map(places).collect();
    assert_eq!(drawn.len(), specs.len(), "light and field do not show the same poses");
    for noise in ["light", "field"] {
        assert_eq!(specs.iter().filter(|spec| spec.noise.name == noise).count(), specs.len() / 2);
    }
}
