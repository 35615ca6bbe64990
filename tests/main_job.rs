//! The whole job through the binary, on invented places with known truth: import, localize, update, and update again.

#[path = "common/mod.rs"]
mod common;
#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

use common::{Place, path};
use serde_json::Value;
use synthetic::{ChangeKind, NoiseLevel, Scene, SceneKind, Truth};

/// Distance in plan, metres, and difference in heading, degrees.
fn pose_error(localization: &Value, truth: &Truth) -> (f64, f64) {
    let number = |key: &str| localization["pose"][key].as_f64().expect("a pose has six numbers");
    let (e, n) = (number("easting") - truth.position[0], number("northing") - truth.position[1]);
    let turn = number("yaw_deg") - truth.attitude_deg[0];
    (e.hypot(n), ((turn + 180.0).rem_euclid(360.0) - 180.0).abs())
}

fn plan_distance_m(at: &Value, truth: [f64; 3]) -> f64 {
    let number = |index: usize| at[index].as_f64().expect("a position has three numbers");
    (number(0) - truth[0]).hypot(number(1) - truth[1])
}

#[test]
fn a_new_banner_is_placed_where_it_hangs_and_only_once() {
    for suffix in ["3ds", "glb"] {
        let place = Place::new(Scene::new(SceneKind::Street, 7), suffix);
        let (case, capture) = place.capture(ChangeKind::Banner, NoiseLevel::LIGHT, 7);
        let first = place.run("update", &[path(&capture)]);
        assert_eq!(first.code, 0, "{suffix}: {}", first.messages);
        let (metres, degrees) = pose_error(&first.json["localization"], &case.truth);
        assert!(metres < 1.0 && degrees < 1.0, "{suffix}: pose {metres:.2} m and {degrees:.2}° off");
        let changes = first.json["changes"].as_array().unwrap();
        assert_eq!(changes.len(), 1, "{suffix}: {changes:?}");
        let truth = &case.truth.changes[0];
        assert_eq!((changes[0]["op"].as_str(), changes[0]["class"].as_str()), (Some("add"), Some("banner")));
        let off_m = plan_distance_m(&changes[0]["after"]["centre"], truth.position.unwrap());
        assert!(off_m < 0.6, "{suffix}: centre {off_m:.2} m off");
        let true_m2 = case.truth.json["changes"][0]["width_m"].as_f64().unwrap()
            * case.truth.json["changes"][0]["height_m"].as_f64().unwrap();
        let area = changes[0]["after"]["area_m2"].as_f64().unwrap() / true_m2;
        assert!((area - 1.0).abs() < 0.15, "{suffix}: area {:.1} % off", 100.0 * (area - 1.0));

        let second = place.run("update", &[path(&capture)]);
        assert!([0, 20].contains(&second.code), "{suffix}: {}", second.messages);
        assert_eq!(second.json["changes"].as_array().map(Vec::len), Some(0), "{suffix}: {}", second.json);
        assert_eq!(place.run("fsck", &[]).json["ok"], true);
    }
}

#[test]
fn a_chair_that_is_gone_leaves_the_map_and_the_other_stays() {
    let place = Place::new(Scene::new(SceneKind::Hall, 3), "3ds");
    let (case, capture) = place.capture(ChangeKind::ChairRemoved, NoiseLevel::LIGHT, 3);
    let answer = place.run("update", &[path(&capture)]);
    assert_eq!(answer.code, 0, "{}", answer.messages);
    let changes = answer.json["changes"].as_array().unwrap();
    assert_eq!(changes.len(), 1, "{changes:?}");
    assert_eq!(changes[0]["op"], "remove");
    let gone = case.truth.changes[0].position.unwrap();
    assert!(plan_distance_m(&changes[0]["before"]["position"], gone) < 1e-3, "the wrong chair was removed");

    let [e, n, _] = gone;
    let around = format!("{},{},{},{}", e - 5.0, n - 5.0, e + 5.0, n + 5.0);
    let chairs = |at: &str| {
        let answer = place.run("query", &["--bbox", &around, "--class", "chair", "--at", at]);
        answer.json["features"].as_array().map(Vec::len)
    };
    assert_eq!((chairs("1"), chairs("2"), chairs("head")), (Some(0), Some(2), Some(1)));
}

#[test]
fn a_photo_from_another_pose_of_what_has_changed_changes_nothing() {
    for (scene, change) in [(SceneKind::Street, ChangeKind::Banner), (SceneKind::Hall, ChangeKind::ChairRemoved)] {
        let place = Place::new(Scene::new(scene, 7), "3ds");
        let (_, [first, second]) = place.two_photos(change, NoiseLevel::LIGHT, 9);
        let found = place.run("update", &[path(&first)]);
        assert_eq!(found.json["changes"].as_array().map(Vec::len), Some(1), "{}", found.json);
        let again = place.run("update", &[path(&second)]);
        assert_eq!(again.code, 20, "{change:?}: {}", again.messages);
        assert_eq!(again.json["changes"].as_array().map(Vec::len), Some(0), "{}", again.json);
    }
}

#[test]
fn a_chair_that_was_moved_is_one_modification() {
    let place = Place::new(Scene::new(SceneKind::Hall, 7), "3ds");
    let (case, capture) = place.capture(ChangeKind::ChairMoved, NoiseLevel::LIGHT, 7_000_023);
    let answer = place.run("update", &[path(&capture)]);
    assert_eq!(answer.code, 0, "{}", answer.messages);
    let changes = answer.json["changes"].as_array().unwrap();
    assert_eq!(changes.len(), 1, "{changes:?}");
    assert_eq!((changes[0]["op"].as_str(), changes[0]["class"].as_str()), (Some("modify"), Some("chair")));
    let off_m = plan_distance_m(&changes[0]["after"]["position"], case.truth.changes[0].position.unwrap());
    assert!(off_m < 0.3, "{off_m:.2} m off");
    let chairs = place.run("query", &["--class", "chair"]);
    assert_eq!(chairs.json["features"].as_array().map(Vec::len), Some(1), "{}", chairs.json);
}

#[test]
fn a_photo_of_an_unchanged_place_changes_nothing() {
    let place = Place::new(Scene::new(SceneKind::Street, 7), "3ds");
    let (_, capture) = place.capture(ChangeKind::None, NoiseLevel::LIGHT, 8);
    let answer = place.run("update", &[path(&capture)]);
    assert!([20, 22].contains(&answer.code), "exit {}: {}", answer.code, answer.messages);
    assert_eq!(answer.json["changes"].as_array().map(Vec::len), Some(0), "{}", answer.json);
}

#[test]
fn the_pose_comes_with_a_heat_map() {
    let place = Place::new(Scene::new(SceneKind::Hall, 3), "glb");
    let (case, capture) = place.capture(ChangeKind::None, NoiseLevel::LIGHT, 5);
    let heat = place.path("heat.png");
    let answer = place.run("localize", &[path(&capture), "--heatmap", path(&heat)]);
    assert_eq!(answer.code, 0, "{}", answer.messages);
    let (metres, degrees) = pose_error(&answer.json, &case.truth);
    assert!(metres < 1.0 && degrees < 2.0, "pose {metres:.2} m and {degrees:.2}° off");
    let bytes = std::fs::read(&heat).unwrap();
    let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    // 40 m to each side of the prior in steps of 1 m at most.
    assert!(reader.info().width >= 80 && reader.info().height >= 80, "{:?}", reader.info());
}
