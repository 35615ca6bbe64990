//! `eval --updates`: detectors side by side on one search, several captures at a time, and a second photo of a place.

use crate::bench::{street, text};
use crate::evaluate::{QUICK, answer, copy, edit, eval, number, suite};
use crate::synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, write_case, write_map};
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

const PAPER: &str = "class-difference:profile=paper";

/// Removes what is measured in seconds, and how many captures were worked on at a time.
fn without_times(document: &mut Value) {
    match document {
        Value::Object(fields) => {
            fields.retain(|key, _| !matches!(key.as_str(), "seconds" | "median_seconds" | "jobs"));
            fields.values_mut().for_each(without_times);
        }
        Value::Array(values) => values.iter_mut().for_each(without_times),
        _ => {}
    }
}

#[test]
fn detectors_share_one_search_and_any_number_of_jobs_gives_the_same() {
    let words = ["--matcher", QUICK, "--updates", "--detector", PAPER, "--detector", "class-difference", "--json"];
    let mut alone = eval(suite(), &[&words[..], &["--jobs", "1"]].concat()).ok().json();
    let mut together = eval(suite(), &[&words[..], &["--jobs", "3"]].concat()).ok().json();
    assert_eq!((&alone["jobs"], &together["jobs"]), (&json!(1), &json!(3)));
    let [paper, own] = [0, 1].map(|index| answer(&alone, "capture", index));
    assert_eq!(paper["seconds"], own["seconds"], "searched twice");
    assert_eq!((&paper["matcher"], &paper["detector"]), (&json!(QUICK), &json!(PAPER)));
    assert_eq!(paper["contender"], format!("{QUICK} + {PAPER}"));
    // The paper's filter of 5 % of the image does not see the banner.
    assert_eq!(paper["update"]["expected"][0]["why_missed"], "nothing-seen");
    assert!(paper["update"]["expected"][0]["found"].is_null() && own["update"]["expected"][0]["found"].is_object());
    let difference = &alone["groups"][0]["differences"][0]["changes"];
    assert_eq!(alone["groups"][0]["above"], format!("{QUICK} + class-difference"));
    let found = |index: usize| {
        let summary = &alone["groups"][0]["summaries"][index]["changes"];
        ["material", "dynamic"].map(|kind| number(&summary[kind]["found"])).iter().sum::<f64>()
    };
    assert!((number(&difference["found"]["value"]) - (found(0) - found(1)) / 2.0).abs() < 1e-12, "{difference}");
    assert_eq!((alone["plugins"].as_array().unwrap().len(), alone["matchers"].as_array().unwrap().len()), (3, 1));
    without_times(&mut alone);
    without_times(&mut together);
    assert_eq!(alone, together);
}

/// A capture that does not show the street's new banner, and `second`, which does.
fn late() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    let street = street();
    write_map(&street.scene, directory.path()).unwrap();
    let (name, change, noise) = ("late".to_owned(), ChangeKind::None, NoiseLevel::IDEAL);
    let unseen = Case::new(&street.scene, CaseSpec { name, change, noise, seed: 5, grid_prior: false }).unwrap();
    let late = write_case(&unseen, directory.path()).unwrap();
    std::fs::rename(write_case(&street.case, directory.path()).unwrap(), late.join("second")).unwrap();
    let banner = json!(street.case.truth.json["changes"]);
    edit(&late.join("truth.json"), |truth| {
        truth["changes"] = banner;
        truth["change_px"] = json!(900);
        truth["change_visible_px"] = json!(0);
    });
    near(&late, &unseen);
    near(&late.join("second"), &street.case);
    directory
}

/// Puts the prior of `case` 1.5 m beside the truth.
fn near(directory: &Path, case: &Case) {
    let ([e, n, h], [yaw, pitch, roll]) = (case.truth.position, case.truth.attitude_deg);
    edit(&directory.join("capture.json"), |document| {
        document["prior"] = json!({
            "easting": e + 1.2, "northing": n - 0.9, "height": h, "height_datum": "hkpd", "yaw_deg": yaw + 2.0,
            "pitch_deg": pitch, "roll_deg": roll, "position_sigma_m": 1.5, "yaw_sigma_deg": 2.0,
        });
    });
}

#[test]
fn a_second_photo_finds_what_the_first_did_not_show() {
    let suite = late();
    let words = ["--matcher", QUICK, "--updates"];
    let document = eval(suite.path(), &[&words[..], &["--json"]].concat()).ok().json();
    let update = &answer(&document, "late", 0)["update"];
    assert_eq!((&update["changes"], &update["second_run"]), (&json!([]), &json!(0)));
    let expected = json!({
        "reliable": true, "changes": 1, "duplicates": 0, "false_updates": 0, "newly_found": 1, "corrected": 0,
    });
    assert_eq!(update["second_photo"], expected, "{update}");
    assert_eq!(update["second_photo_changes"][0]["class"], "banner");
    let summary = &document["groups"][0]["summaries"][0]["changes"];
    assert_eq!((&summary["second_photos"]["photos"], &summary["second_photos"]["newly_found"]), (&json!(1), &json!(1)));
    // What the first photo hides is not held against anybody.
    assert_eq!(summary["material"], json!({ "found": 0, "expected": 0 }));
}

#[test]
fn a_second_photo_of_what_is_on_the_map_changes_nothing_and_one_that_fails_says_why() {
    let suite = copy();
    let first = suite.path().join("capture");
    let second = first.join("second");
    std::fs::create_dir(&second).unwrap();
    for file in ["capture.json", "labels.png", "truth.json"] {
        std::fs::copy(first.join(file), second.join(file)).unwrap();
    }
    near(&second, &street().case);
    let words = ["--only", "capture", "--matcher", QUICK, "--updates"];
    let run = || eval(suite.path(), &[&words[..], &["--json"]].concat());
    let update = run().ok().json()["captures"][0]["answers"][0]["update"].clone();
    assert_eq!((&update["second_photo"]["reliable"], &update["second_photo"]["changes"]), (&json!(true), &json!(0)));
    std::fs::write(second.join("labels.png"), b"no picture").unwrap();
    let csv = suite.path().join("rows.csv");
    let said = eval(suite.path(), &[&words[..], &["--csv", text(&csv)]].concat()).ok();
    assert!(said.out.contains("no update: ") && said.out.contains("second photo: "), "{}", said.out);
    let rows = std::fs::read_to_string(&csv).unwrap();
    let [names, row] = [0, 1].map(|index| rows.lines().nth(index).unwrap());
    assert!(names.ends_with("second_photo_new,update_problem") && row.contains("labels.png"), "{rows}");
    std::fs::remove_file(second.join("truth.json")).unwrap();
    run().refused(10, &["second", "truth.json"]);
}
