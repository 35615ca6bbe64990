//! `log --by-plugin`, `revert --by-plugin` and `replay`: which build did what, undone at once, and done again.

use crate::bench::{Bench, street, text};
use crate::change_sets::chair;
use serde_json::{Value, json};

fn capture() -> String {
    text(&street().path("capture/capture.json")).to_owned()
}

/// SHA-256 of the detector that made version 2 of a bench with a banner.
fn detector(document: &Value) -> String {
    let used = document["plugins"].as_array().unwrap().iter().find(|used| used["kind"] == "detector").unwrap();
    used["sha256"].as_str().unwrap().to_owned()
}

fn versions(log: &Value) -> Vec<u64> {
    log["versions"].as_array().unwrap().iter().map(|record| record["version"].as_u64().unwrap()).collect()
}

#[test]
fn the_log_of_a_build_has_its_versions_alone() {
    let (bench, document) = Bench::with_banner();
    bench.apply(&[json!({"op": "add", "after": chair()})]);
    let sha256 = detector(&document);
    for build in [sha256.as_str(), &sha256[..8], "class-difference", "class-difference@0.1.0"] {
        assert_eq!(versions(&bench.json("log", &["--by-plugin", build])), [2], "{build}");
    }
    // What this map has never seen is not there, and what it has seen is listed.
    let recorded = format!("recorded are class-difference@0.1.0 ({}), descriptors@0.1.0 (", &sha256[..8]);
    for build in ["skyline", "class-difference@9", &"0".repeat(64)] {
        for command in ["log", "revert"] {
            bench.run(command, &["--by-plugin", build]).refused(11, &[&format!("no plugin {build} in"), &recorded]);
        }
    }
    Bench::with_empty_map().run("log", &["--by-plugin", "skyline"]).refused(11, &["recorded are no plugin at all"]);
    bench.run("log", &["--by-plugin", "@1"]).refused(2, &["NAME@VERSION"]);
}

#[test]
fn all_that_a_build_did_is_undone_at_once_and_nothing_else() {
    let (bench, document) = Bench::with_banner();
    bench.apply(&[json!({"op": "add", "after": chair()})]);
    let sha256 = detector(&document);
    let done = bench.json("revert", &["--by-plugin", &sha256]);
    let expected = json!([{"reverts": 2, "version": 4, "added": 0, "modified": 0, "removed": 1}]);
    assert_eq!((&done["versions_by_plugin"], &done["reverted"]), (&json!([2]), &expected));
    let classes: Vec<Value> = bench.json("query", &["--class", "banner", "--class", "chair"])["features"]
        .as_array()
        .unwrap()
        .iter()
        .map(|feature| feature["class"].clone())
        .collect();
    assert_eq!(classes, ["chair"]);
    assert_eq!(bench.run("revert", &["--by-plugin", &sha256]).code, 20);
    assert_eq!(bench.head(), 4);
}

#[test]
fn where_others_built_on_it_nothing_is_undone() {
    let (bench, document) = Bench::with_banner();
    let made = &document["changes"][0];
    let mut after = made["after"].clone();
    after["sigma_m"] = json!(0.01);
    bench.apply(&[json!({"op": "modify", "fid": made["fid"], "before": made["after"], "after": after})]);
    let fid = format!("feature {}", made["fid"]);
    bench.run("revert", &["--by-plugin", &detector(&document)]).refused(21, &[&fid, "version 3"]);
    assert_eq!(bench.head(), 3);
    bench.run("revert", &["2", "--by-plugin", "semantic"]).refused(2, &["--by-plugin"]);
    bench.run("revert", &[]).refused(2, &["--by-plugin"]);
}

#[test]
fn a_version_is_replayed_from_what_the_map_kept() {
    let bench = Bench::with_street();
    bench.json("update", &[&capture(), "--keep-labels"]);
    let before = std::fs::read(bench.path("map.rsv")).unwrap();
    let replay = bench.json("replay", &["2"]);
    assert_eq!((&replay["same"], &replay["version"], &replay["base_version"]), (&json!(true), &json!(2), &json!(1)));
    let kinds: Vec<_> = replay["plugins"].as_array().unwrap().iter().map(|build| build["kind"].clone()).collect();
    assert_eq!(kinds, ["matcher", "detector", "estimator"]);
    assert_eq!((&replay["pose"]["given"], &replay["pose"]["distance_m"]), (&json!(false), &json!(0.0)));
    assert_eq!(replay["pose"]["recorded_score"], replay["pose"]["found_score"]);
    assert_eq!((&replay["changes"]["missing"], &replay["changes"]["new"]), (&json!([]), &json!([])));
    assert_eq!(std::fs::read(bench.path("map.rsv")).unwrap(), before);
}

#[test]
fn without_labels_in_the_map_the_capture_is_needed_and_must_be_the_one() {
    let (bench, _) = Bench::with_banner();
    bench.refuses("replay", &["2"], 11, &["did not keep the label image", "--capture"]);
    bench.refuses("replay", &["1"], 11, &["version 1 is of kind import"]);
    bench.refuses("replay", &["7"], 11, &["no version 7"]);
    let replay = bench.json("replay", &["2", "--capture", &capture()]);
    assert_eq!((&replay["same"], &replay["pose"]["given"]), (&json!(true), &json!(true)));
    let lines = bench.run("replay", &["2", "--capture", &capture()]).ok().out;
    assert!(lines.starts_with("version 2, observation 1: the same\n"), "{lines}");
    // The same picture with another camera is another capture.
    let other = std::fs::read_to_string(capture()).unwrap().replace("\"prior\"", " \"prior\"");
    let labels = street().path("capture/labels.png");
    bench.file("labels.png", std::fs::read(labels).unwrap());
    let other = bench.file("capture.json", other);
    bench.refuses("replay", &["2", "--capture", &other], 10, &["not what was seen", "capture.json"]);
}
