//! `eval`: the same numbers as the other commands give, against the truth; wrong suites are refused by name.

use crate::bench::{Run, resurvey, street, text};
use crate::synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, SceneKind, write_case, write_map};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// A search that is quick, around the prior of captures whose prior was put 3 m and 4° off.
pub const QUICK: &str = "semantic:radius_m=5,yaw_range_deg=8,modes=4";

/// Two captures: the street's new banner, and a hall that lost a chair the map knew.
pub fn suite() -> &'static Path {
    static SUITE: OnceLock<PathBuf> = OnceLock::new();
    SUITE.get_or_init(|| {
        let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("evaluate");
        let _ = std::fs::remove_dir_all(&directory);
        let (hall, name) = (Scene::new(SceneKind::Hall, 7), "hall-chair-removed".to_owned());
        let (change, noise) = (ChangeKind::ChairRemoved, NoiseLevel::IDEAL);
        let case = Case::new(&hall, CaseSpec { name, change, noise, seed: 3, grid_prior: false }).unwrap();
        for (scene, case) in [(&street().scene, &street().case), (&hall, &case)] {
            write_map(scene, &directory).unwrap();
            let capture = write_case(case, &directory).unwrap().join("capture.json");
            edit(&capture, |document| {
                let [e, n, h] = case.truth.position;
                let near = json!({
                    "easting": e + 1.8, "northing": n - 2.4, "height": h, "height_datum": "hkpd",
                    "yaw_deg": case.truth.attitude_deg[0] + 4.0, "pitch_deg": case.truth.attitude_deg[1],
                    "roll_deg": case.truth.attitude_deg[2], "position_sigma_m": 3.0, "yaw_sigma_deg": 4.0,
                });
                document["prior"] = near;
            });
        }
        directory
    })
}

/// A copy of the suite that a test may change.
pub fn copy() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (path, bytes) in files(suite()) {
        let path = directory.path().join(path);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    directory
}

/// Every file below `directory` with its bytes.
fn files(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut left = vec![directory.to_owned()];
    while let Some(folder) = left.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                left.push(path);
            } else {
                found.insert(path.strip_prefix(directory).unwrap().to_owned(), std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Changes a JSON file.
pub fn edit(path: &Path, change: impl FnOnce(&mut Value)) {
    let mut document: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    change(&mut document);
    std::fs::write(path, document.to_string()).unwrap();
}

pub fn eval(cases: &Path, arguments: &[&str]) -> Run {
    let words: Vec<&str> = ["eval", text(cases)].into_iter().chain(arguments.iter().copied()).collect();
    resurvey(&words)
}

pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("expected a number, found {value}"))
}

/// The answer of matcher `index` on the capture called `name`.
pub fn answer<'a>(document: &'a Value, name: &str, index: usize) -> &'a Value {
    let captures = document["captures"].as_array().unwrap();
    let capture = captures.iter().find(|capture| capture["capture"] == name).unwrap();
    &capture["answers"][index]
}

#[test]
fn poses_and_changes_are_those_of_update_and_errors_those_of_the_truth() {
    let before = files(suite());
    let document = eval(suite(), &["--matcher", "prior", "--matcher", QUICK, "--updates", "--json"]).ok().json();
    assert_eq!(files(suite()), before, "the user's files changed");
    // What `update` itself makes of the banner, on a map of its own.
    let directory = tempfile::tempdir().unwrap();
    let map = directory.path().join("map.rsv");
    std::fs::copy(street().path("plain.rsv"), &map).unwrap();
    let capture = suite().join("capture/capture.json");
    let settings =
        ["semantic.radius_m=5", "semantic.yaw_range_deg=8", "semantic.modes=4"].map(|setting| ["--set", setting]);
    let words = ["update", text(&map), text(&capture), "--json"];
    let updated = resurvey(&[&words, settings.as_flattened()].concat()).ok().json();
    let banner = answer(&document, "capture", 1);
    assert_eq!(banner["pose"], updated["localization"]["pose"]);
    assert_eq!(banner["covariance"], updated["localization"]["covariance"]);
    assert_eq!(banner["update"]["changes"][0]["after"], updated["changes"][0]["after"]);
    // Against the truth, computed here from the two files.
    let truth = &street().case.truth;
    let pose = &updated["localization"]["pose"];
    let off_m = (number(&pose["easting"]) - truth.position[0]).hypot(number(&pose["northing"]) - truth.position[1]);
    assert!((number(&banner["error"]["position_m"]) - off_m).abs() < 1e-9 && off_m < 1.0);
    let centre = &updated["changes"][0]["after"]["centre"];
    let at = truth.changes[0].position.unwrap();
    let placed_off_m = (number(&centre[0]) - at[0]).hypot(number(&centre[1]) - at[1]);
    let found = &banner["update"]["expected"][0]["found"];
    assert!((number(&found["position_off_m"]) - placed_off_m).abs() < 1e-6, "{found} {placed_off_m}");
    assert_eq!(banner["update"]["second_run"], 0);
    // The hall's chair was on the map before, and went.
    let chair = answer(&document, "hall-chair-removed", 1);
    assert_eq!(chair["update"]["changes"][0]["op"], "remove");
    assert!(chair["update"]["expected"][0]["found"]["position_off_m"].is_null());
    // The prior was put 3 m and 4° off.
    let prior = &answer(&document, "hall-chair-removed", 0)["error"];
    assert!((number(&prior["position_m"]) - 3.0).abs() < 1e-6 && (number(&prior["yaw_deg"]) - 4.0).abs() < 1e-6);
    check_summaries(&document);
}

fn check_summaries(document: &Value) {
    let groups = document["groups"].as_array().unwrap();
    let names: Vec<&str> = groups.iter().map(|group| group["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["all", "ideal", "light", "hall", "street", "banner", "chair_removed"]);
    let [prior, semantic] = [0, 1].map(|index| &groups[0]["summaries"][index]);
    assert_eq!((&prior["captures"], &prior["recall_2m_2deg"]["value"]), (&json!(2), &json!(0.0)));
    assert_eq!((&prior["recall_5m_5deg"]["value"], &prior["coverage"]["value"]), (&json!(1.0), &json!(0.0)));
    // e²/σ² is 1 in plan and 1 in heading.
    assert!((number(&prior["nees"]["mean"]) - 2.0).abs() < 1e-6, "{}", prior["nees"]);
    assert_eq!(semantic["recall_1m_1deg"]["value"], 1.0);
    assert_eq!(semantic["changes"]["material"], json!({ "found": 1, "expected": 1 }));
    assert_eq!(semantic["changes"]["dynamic"], json!({ "found": 1, "expected": 1 }));
    assert_eq!(semantic["changes"]["not_idempotent"], 0);
    assert_eq!(semantic["changes"]["material_added"], json!({ "found": 1, "expected": 1 }));
    assert_eq!(semantic["changes"]["dynamic_removed"], json!({ "found": 1, "expected": 1 }));
    assert_eq!(
        (&semantic["changes"]["missed"], &prior["changes"]["missed"]),
        (&json!({}), &json!({"pose-not-reliable": 2}))
    );
    assert_eq!(semantic["changes"]["false_of_committed"]["of"], 2);
    assert_eq!(semantic["changes"]["position_within_2_sigma"]["of"], 1);
    let difference = &groups[0]["differences"][0];
    assert_eq!((&difference["matcher"], &groups[0]["above"]), (&json!("prior"), &json!(QUICK)));
    assert_eq!((&difference["nearer"]["value"], &difference["recall_1m_1deg"]["value"]), (&json!(0.0), &json!(-1.0)));
}

#[test]
fn tables_and_lines_say_who_is_wrong_and_called_reliable() {
    let suite = copy();
    edit(&suite.path().join("capture/capture.json"), |document| {
        document["prior"]["easting"] = json!(number(&document["prior"]["easting"]) + 20.0);
        document["prior"]["position_sigma_m"] = json!(0.5);
        document["prior"]["yaw_sigma_deg"] = json!(1.0);
    });
    let csv = suite.path().join("rows.csv");
    let run = eval(suite.path(), &["--matcher", "prior", "--table", "--csv", text(&csv)]).ok();
    // 21.8 m east, 2.4 m south.
    assert!(run.out.contains("wrong but reliable: prior, capture: 21.93 m, 4.0°"), "{}", run.out);
    for words in ["Table II", "21.93 / 4.0", "coverage %", "noise ideal: 1", "scene street: 1", "1 of 1", "Wilson"] {
        assert!(run.out.contains(words), "no {words:?} in {}", run.out);
    }
    let rows: Vec<String> = std::fs::read_to_string(&csv).unwrap().lines().map(str::to_owned).collect();
    assert_eq!(rows.len(), 3);
    assert!(rows[0].starts_with("capture,scene,noise,kind,matcher,position_m,yaw_deg"), "{}", rows[0]);
    assert!(rows[1].starts_with("capture,street,light,banner,prior,21.93"), "{}", rows[1]);
    let only = eval(suite.path(), &["--matcher", "prior", "--only", "hall", "--limit", "1", "--json"]).ok().json();
    assert_eq!(only["captures"].as_array().unwrap().len(), 1);
    assert_eq!(only["captures"][0]["capture"], "hall-chair-removed");
}

#[test]
fn a_single_capture_finds_its_map_beside_or_where_it_is_told() {
    let suite = copy();
    let capture = suite.path().join("capture");
    eval(&capture, &["--matcher", "prior"]).ok();
    let elsewhere = tempfile::tempdir().unwrap();
    std::fs::rename(suite.path().join("maps"), elsewhere.path().join("models")).unwrap();
    let words = ["street", "expected a directory", "--maps"];
    eval(&capture, &["--matcher", "prior"]).refused(10, &words);
    let maps = elsewhere.path().join("models");
    // Without the 3DS the GLB does.
    std::fs::remove_file(maps.join("street/street.3ds")).unwrap();
    eval(&capture, &["--matcher", "prior", "--maps", text(&maps)]).ok();
    std::fs::remove_file(maps.join("street/street.glb")).unwrap();
    eval(&capture, &["--matcher", "prior", "--maps", text(&maps)]).refused(10, &["street.3ds or street.glb"]);
}

#[test]
fn a_capture_without_an_answer_is_infinitely_wrong_and_listed_with_the_reason() {
    let suite = copy();
    std::fs::write(suite.path().join("capture/labels.png"), b"no picture").unwrap();
    let run = eval(suite.path(), &["--matcher", "prior", "--updates"]).ok();
    assert!(run.out.contains("no answer: prior, capture: ") && run.out.contains("labels.png"), "{}", run.out);
    let document = eval(suite.path(), &["--matcher", "prior", "--json"]).ok().json();
    let broken = answer(&document, "capture", 0);
    assert!(broken["error"].is_null() && broken["problem"].as_str().unwrap().contains("labels.png"), "{broken}");
    let summary = &document["groups"][0]["summaries"][0];
    assert_eq!((&summary["captures"], &summary["answered"]), (&json!(2), &json!(1)));
    assert_eq!(summary["recall_5m_5deg"]["value"], 0.5);
    assert!(summary["median_m"]["value"].is_null() && (number(&summary["mean_m"]["value"]) - 3.0).abs() < 1e-6);
}

#[test]
fn a_matcher_that_fails_is_listed_with_its_own_words_and_the_others_go_on() {
    let suite = copy();
    let house = street().scene.world.blocks.iter().find(|block| block.top - block.bottom > 10.0).unwrap();
    let mean = |axis: usize| house.corners().iter().map(|corner| corner[axis]).sum::<f64>() / 4.0;
    let [easting, northing, height] = street().scene.grid([mean(0), mean(1), house.bottom + 1.6]);
    edit(&suite.path().join("capture/capture.json"), |document| {
        for (key, value) in [("easting", easting), ("northing", northing), ("height", height)] {
            document["prior"][key] = json!(value);
        }
    });
    let matchers = ["--matcher", "semantic:radius_m=0", "--matcher", "prior"];
    let words = [&["--only", "capture", "--updates"][..], &matchers].concat();
    let run = eval(suite.path(), &words).ok();
    let said = "no answer: semantic:radius_m=0, capture: plugin semantic gave no answer";
    assert!(run.out.contains(said) && run.out.contains("inside buildings"), "{}", run.out);
    let document = eval(suite.path(), &[&words[..], &["--json"]].concat()).ok().json();
    let [failed, prior] = [0, 1].map(|index| answer(&document, "capture", index));
    assert!(failed["error"].is_null() && failed["pose"].is_null() && prior["error"].is_object());
    assert_eq!(failed["update"]["expected"][0]["found"], Value::Null);
    assert_eq!(document["groups"][0]["differences"][0]["nearer"]["value"], 0.0);
}

#[test]
fn a_suite_that_is_none_is_refused_by_name_before_anything_runs() {
    let empty = tempfile::tempdir().unwrap();
    eval(empty.path(), &[]).refused(10, &[text(empty.path()), "truth.json", "found none"]);
    eval(Path::new("/nowhere/cases"), &[]).refused(10, &["/nowhere/cases"]);
    eval(suite(), &["--only", "winter"]).refused(10, &["\"winter\"", "none"]);
    let truth_without = |change: fn(&mut Value), words: &[&str]| {
        let suite = copy();
        edit(&suite.path().join("capture/truth.json"), change);
        eval(suite.path(), &["--matcher", "prior"]).refused(10, &[&["truth.json: "], words].concat());
    };
    truth_without(|truth| drop(truth.as_object_mut().unwrap().remove("pose")), &["missing field `pose`"]);
    truth_without(|truth| truth["pose"]["yaw_deg"] = json!("north"), &["expected f64"]);
    truth_without(|truth| truth["scene"] = json!("../street"), &["\"../street\"", "name of a directory"]);
    truth_without(|truth| truth["scene"] = json!("harbour"), &["harbour", "--maps"]);
    truth_without(|truth| truth["changes"][0]["position"] = json!(null), &["changes[0]"]);
    for (file, contents, word) in [
        ("maps/street/map.json", "{}", "origin"),
        ("maps/street/map.json", "", "map.json"),
        ("maps/street/street.3ds", "no model", "street.3ds"),
        ("capture/truth.json", "{", "truth.json"),
        ("hall-chair-removed/base.changes.jsonl", "{}", "base.changes.jsonl"),
    ] {
        let suite = copy();
        std::fs::write(suite.path().join(file), contents).unwrap();
        eval(suite.path(), &["--matcher", "prior"]).refused(10, &[word]);
    }
}

#[test]
fn matchers_and_settings_that_cannot_be_are_refused_with_what_can() {
    let refused = |words: &[&str], code: u8, expected: &[&str]| eval(suite(), words).refused(code, expected);
    let twins = eval(suite(), &["--only", "hall", "--matcher", "skyline", "--matcher", "skyline:sky_class=6"]).ok();
    assert!(
        twins.err.contains("skyline and skyline:sky_class=6 are one plugin with the same settings"),
        "{}",
        twins.err
    );
    refused(&["--matcher", "magic"], 11, &["magic", "edges, palette, pixel, semantic, silhouette, skyline"]);
    refused(&["--updates", "--detector", "magic"], 11, &["magic", "class-difference"]);
    refused(&["--matcher", "descriptors"], 12, &["descriptors", "matcher"]);
    refused(&["--matcher", "semantic:dice"], 2, &["NAME:KEY=VALUE", "\"dice\""]);
    refused(&["--matcher", "semantic:dice=7"], 2, &["dice", "from -1 to 1"]);
    refused(&["--matcher", "semantic:luck=1"], 2, &["luck", "known are"]);
    refused(&["--matcher", "prior:radius_m=5"], 2, &["prior has no settings"]);
    refused(&["--set", "gate.luck=1"], 2, &["gate has no setting"]);
    refused(&["--set", "magic.luck=1"], 2, &["does not use \"magic\""]);
    refused(&["--limit", "0"], 2, &["--limit"]);
    refused(&["--detector", "class-difference"], 2, &["--updates"]);
    refused(&["--updates", "--detector", "class-difference:luck"], 2, &["--detector", "NAME:KEY=VALUE"]);
    refused(&["--updates", "--estimator", "descriptors:luck=1"], 2, &["luck", "known are"]);
    refused(&["--updates", "--detector", "descriptors"], 12, &["descriptors", "detector"]);
    refused(&["--jobs", "0"], 2, &["--jobs"]);
    refused(&["--csv", text(&street().path("plain.rsv")), "--matcher", "prior"], 10, &["found a map"]);
    resurvey(&["eval"]).refused(2, &["<CASES>"]);
}

/// The project's captures, or `None` with a note when they are missing.
fn shared_cases() -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared"));
    let cases = std::env::var_os("RESURVEY_SHARED").map_or(beside, PathBuf::from).join("cases");
    if !cases.exists() {
        eprintln!("SKIPPED: {} is missing (set RESURVEY_SHARED)", cases.display());
        return None;
    }
    Some(cases)
}

#[test]
fn the_priors_of_the_shared_captures_are_as_far_off_as_their_makers_say() {
    let Some(cases) = shared_cases() else { return };
    let document = eval(&cases, &["--matcher", "prior", "--json"]).ok().json();
    let captures = document["captures"].as_array().unwrap();
    assert_eq!(captures.len(), 13);
    for capture in captures {
        let name = capture["capture"].as_str().unwrap();
        let truth = std::fs::read(cases.join(name).join("truth.json")).unwrap();
        let truth: Value = serde_json::from_slice(&truth).unwrap();
        let (stated, found) = (&truth["prior_error"], &capture["prior"]);
        let position_m = number(&found["position_m"]) - number(&stated["position_m"]);
        let yaw_deg = number(&found["yaw_deg"]) - number(&stated["yaw_deg"]);
        // The capture has nine digits of a degree and three of a heading.
        assert!(position_m.abs() < 0.01 && yaw_deg.abs() < 0.01, "{name}: {found} for {stated}");
    }
    let count = |name: &str| {
        let groups = document["groups"].as_array().unwrap();
        let group = groups.iter().find(|group| group["name"] == name).unwrap();
        group["summaries"][0]["captures"].as_u64().unwrap()
    };
    assert_eq!([count("all"), count("ideal"), count("light"), count("field")], [13, 1, 10, 2]);
}
