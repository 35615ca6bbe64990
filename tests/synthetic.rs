//! The invented captures are judges, so they are judged first: by analytic scenes, by the conventions written down once
//! more, and by their own repetition.

#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

use serde_json::Value;
use std::collections::BTreeSet;
use synthetic::model::Model;
use synthetic::world::class;
use synthetic::{
    Case, CaseSpec, ChangeKind, Changes, NoiseLevel, Scene, SceneKind, Suite, TrueChange, every_suite, full_suite,
    three_ds,
};

fn spec(kind: SceneKind, change: ChangeKind, noise: NoiseLevel, seed: u64) -> CaseSpec {
    CaseSpec { name: format!("{}-{}", kind.name(), change.name()), change, noise, seed, grid_prior: true }
}

fn case(kind: SceneKind, change: ChangeKind, noise: NoiseLevel, seed: u64) -> Case {
    Case::new(&Scene::new(kind, 4), spec(kind, change, noise, seed)).expect("a pose shows the change")
}

/// An ideal capture of the hall with a second photo.
fn twice(change: ChangeKind, seed: u64) -> Case {
    let ideal = spec(SceneKind::Hall, change, NoiseLevel::IDEAL, seed);
    Case::with_second(&Scene::new(SceneKind::Hall, 4), ideal).expect("a pose shows the change")
}

/// Three numbers of a JSON array.
fn point(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|i| value[i].as_f64().expect("a number"))
}

fn apart_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// First and last column (`axis` 0) or row (1) of an object on the ground, whose sides are 0.5 m and run along the grid.
fn span(case: &Case, foot: [f64; 3], height_m: f64, axis: usize) -> [f64; 2] {
    let capture = serde_json::to_value(&case.capture).expect("a capture is JSON");
    let corners = (0..8).map(|i| {
        let by = |bit: u32| if i & bit == 0 { -0.25 } else { 0.25 };
        [foot[0] + by(1), foot[1] + by(2), foot[2] + if i & 4 == 0 { 0.0 } else { height_m }]
    });
    let pixels: Vec<f64> = corners.map(|corner| pixel(&capture, &case.truth.json["pose"], corner)[axis]).collect();
    [pixels.iter().copied().fold(f64::INFINITY, f64::min), pixels.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
}

fn label(case: &Case, at: [f64; 3]) -> u8 {
    let capture = serde_json::to_value(&case.capture).expect("a capture is JSON");
    let [u, v] = pixel(&capture, &case.truth.json["pose"], at);
    case.labels[v as usize * case.width + u as usize]
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

#[test]
fn what_was_made_before_the_hard_kinds_is_made_the_same() {
    // FNV-1a of the labels that the generator wrote before it knew a second photo or a hard kind:
    // generate_cases --scene hall (or street) --noise light --count 7 --seed 4.
    let digest = |scene: SceneKind, index: usize| {
        let (seed, noise) = (4, NoiseLevel::LIGHT);
        let suite = Suite { scene, seed, capture_seed: seed, count: 7, noise, changes: Changes::InTurn };
        let scene = Scene::new(scene, seed);
        let case = Case::new(&scene, suite.specs(&scene).remove(index)).unwrap();
        let mix = |hash: u64, label: &u8| (hash ^ u64::from(*label)).wrapping_mul(0x0100_0000_01b3);
        case.labels.iter().fold(0xcbf2_9ce4_8422_2325, mix)
    };
    assert_eq!(digest(SceneKind::Hall, 0), 0x000e_6f8c_397c_10c3);
    assert_eq!(digest(SceneKind::Street, 3), 0x11f0_24d9_6717_bcf2);
}

#[test]
fn a_second_photo_shows_the_same_change_from_another_pose() {
    for (kind, change) in [(SceneKind::Hall, ChangeKind::TwoChairs), (SceneKind::Street, ChangeKind::Pedestrian)] {
        let case = Case::with_second(&Scene::new(kind, 4), spec(kind, change, NoiseLevel::LIGHT, 3)).unwrap();
        let second = case.second.as_ref().expect("a pose near by shows it");
        assert_eq!(case.truth.changes, second.truth.changes);
        let count = |key: &str| second.truth.json[key].as_u64().unwrap();
        assert!(count("change_px") > 0 && count("change_visible_px") * 10 >= count("change_px") * 8, "{kind:?}");
        assert!((2.99..8.01).contains(&apart_m(case.truth.position, second.truth.position)));
        assert_ne!(case.truth.json["prior_error"], second.truth.json["prior_error"], "each has a prior of its own");
        assert_ne!(case.capture.taken_at, second.capture.taken_at);
        assert_eq!(Case { second: None, ..case.clone() }, Case::new(&Scene::new(kind, 4), case.spec.clone()).unwrap());
    }
}

#[test]
fn a_change_of_what_the_map_knew_is_one_change_that_says_what_it_replaces() {
    let of = |kind: ChangeKind| {
        let case = case(SceneKind::Hall, kind, NoiseLevel::IDEAL, 1);
        assert_eq!((case.base_changes.len(), case.truth.changes.len()), (2, 1), "a header and what the map knew");
        let change = case.truth.changes[0].clone();
        assert_eq!(change.op, "add");
        let before = change.json["replaces"].clone();
        assert_eq!(before, case.truth.json["base_descriptors"][0]);
        (change, before)
    };
    let size = |json: &Value, key: &str| json[key].as_f64().unwrap();
    let ratios = |change: &TrueChange, before: &Value| {
        ["width_m", "height_m"].map(|key| size(&change.json, key) / size(before, key))
    };
    let (grown, before) = of(ChangeKind::BannerGrown);
    let [wide, tall] = ratios(&grown, &before);
    assert!((1.3..=1.6).contains(&(wide * tall)) && (wide - 1.0).abs().min((tall - 1.0).abs()) < 1e-3);
    assert_eq!((grown.class.as_str(), &before["class"]), ("banner", &Value::from("banner")));
    let (replaced, before) = of(ChangeKind::BannerReplaced);
    assert!(ratios(&replaced, &before).iter().all(|ratio| (ratio - 1.0).abs() <= 0.041));
    assert!(replaced.class != "banner" && before["class"] == "banner");
    let (moved, before) = of(ChangeKind::ChairMoved);
    assert!((0.399..1.501).contains(&apart_m(moved.position.unwrap(), point(&before["position"]))));
}

#[test]
fn two_that_touch_share_columns_of_the_photo() {
    for (kind, class, height_m) in [(SceneKind::Hall, class::CHAIR, 0.9), (SceneKind::Street, class::PEDESTRIAN, 1.7)] {
        let case = case(kind, ChangeKind::Touching, NoiseLevel::IDEAL, 2);
        let feet: Vec<[f64; 3]> = case.truth.changes.iter().map(|change| change.position.unwrap()).collect();
        assert!((0.5..0.87).contains(&apart_m(feet[0], feet[1])), "0.5 to 0.7 m abreast, up to 0.5 m deeper");
        let [a, b] = [0, 1].map(|i| span(&case, feet[i], height_m, 0));
        assert!(a[0] < b[1] && b[0] < a[1], "{kind:?}: columns {a:?} and {b:?}");
        let [left, _, right, _] = bounds(&case, class);
        assert!((left - a[0].min(b[0])).abs() < 1.5 && (right - a[1].max(b[1])).abs() < 1.5, "nothing else hides them");
    }
}

#[test]
fn what_the_border_cuts_is_no_change_until_a_photo_shows_it_whole() {
    let case = twice(ChangeKind::CutByBorder, 1);
    assert!(case.truth.changes.is_empty() && case.base_changes.is_empty());
    let cut = &case.truth.json["unmeasurable"][0];
    let foot = point(&cut["position"]);
    let ([left, right], [_, bottom]) = (span(&case, foot, 0.9, 0), span(&case, foot, 0.9, 1));
    assert!(left < 0.0 || right > 960.0 || bottom > 720.0, "columns {left} to {right}, rows to {bottom}");
    assert!((0.1..=0.6).contains(&cut["outside_share"].as_f64().unwrap()));
    let seen = bounds(&case, class::CHAIR);
    assert!(seen[0] < 0.5 || seen[2] > 959.5 || seen[3] > 719.5, "it reaches the border: {seen:?}");
    let whole = case.second.unwrap().truth;
    assert_eq!((whole.changes[0].op, whole.changes[0].position), ("add", Some(foot)));
    assert_eq!(whole.json["unmeasurable"], Value::Null);
}

#[test]
fn a_banner_cut_by_the_border_is_no_change() {
    let case = case(SceneKind::Hall, ChangeKind::BannerCut, NoiseLevel::IDEAL, 1);
    let capture = serde_json::to_value(&case.capture).unwrap();
    let corners = case.truth.json["unmeasurable"][0]["corners"].as_array().unwrap();
    let pixels = corners.iter().map(|corner| pixel(&capture, &case.truth.json["pose"], point(corner)));
    let is_held = |[u, v]: [f64; 2]| (0.0..960.0).contains(&u) && (0.0..720.0).contains(&v);
    let held = pixels.filter(|pixel| is_held(*pixel)).count();
    assert!((1..4).contains(&held) && case.truth.changes.is_empty(), "{held} corners in the image");
}

#[test]
fn a_hidden_chair_shows_less_than_a_tenth_and_is_no_change() {
    let chair = |seed: u64| {
        let case = case(SceneKind::Hall, ChangeKind::Hidden, NoiseLevel::IDEAL, seed);
        (case.truth.json["hidden"][0]["class"] == "chair").then_some(case)
    };
    let case = (0..8).find_map(chair).expect("every other hidden thing is a chair");
    let foot = point(&case.truth.json["hidden"][0]["position"]);
    let [[left, right], [top, bottom]] = [0, 1].map(|axis| span(&case, foot, 0.9, axis));
    let seen = case.labels.iter().filter(|&&label| label == class::CHAIR).count() as f64;
    // A box fills at least half of its bounds.
    assert!(seen < 0.05 * (right - left) * (bottom - top), "{seen} px");
    assert!(case.truth.changes.is_empty() && case.truth.json["change_px"] == 0);
    assert_eq!(case.base_changes.len(), 2, "the map knows it");
}

#[test]
fn a_known_banner_and_a_known_chair_are_seen_where_the_map_has_them() {
    let case = case(SceneKind::Hall, ChangeKind::Known, NoiseLevel::IDEAL, 1);
    assert!(case.truth.changes.is_empty() && case.truth.json["change_px"] == 0);
    let known = case.truth.json["base_descriptors"].as_array().unwrap();
    let [e, n, h] = point(&known[1]["position"]);
    let seen = [point(&known[0]["position"]), [e, n, h + 0.45]].map(|at| label(&case, at));
    assert_eq!(seen, [class::BANNER, class::CHAIR]);
}

#[test]
fn several_changes_are_all_in_one_photo() {
    let case = case(SceneKind::Hall, ChangeKind::Several, NoiseLevel::IDEAL, 1);
    let is = |change: &TrueChange| format!("{} {}", change.op, change.class);
    let changes: Vec<String> = case.truth.changes.iter().map(is).collect();
    assert_eq!(changes, ["add banner", "add chair", "remove banner"]);
    let middles = [0, 2].map(|i| label(&case, case.truth.changes[i].position.unwrap()));
    assert_eq!(middles[0], class::BANNER);
    assert_ne!(middles[1], class::BANNER);
}

#[test]
fn every_suite_has_every_kind_that_suits_in_each_place_at_both_noises() {
    for suite in every_suite(1, 1) {
        let scene = Scene::new(suite.scene, suite.seed);
        let kinds: Vec<ChangeKind> = suite.specs(&scene).iter().map(|spec| spec.change).collect();
        assert_eq!(kinds, ChangeKind::every(&scene));
        assert!(ChangeKind::HARD.iter().all(|kind| kinds.contains(kind)));
    }
    let names: BTreeSet<String> = every_suite(1, 1)
        .iter()
        .flat_map(|suite| suite.specs(&Scene::new(suite.scene, 1)))
        .map(|spec| spec.name)
        .collect();
    assert_eq!(names.len(), 2 * (3 * 14 + 13));
}
