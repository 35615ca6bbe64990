//! `localize`, `update` and `render`: what they print and what they leave behind.

use crate::bench::{Bench, resurvey, street, text};
use serde_json::{Value, json};
use std::path::PathBuf;

fn capture() -> PathBuf {
    street().path("capture/capture.json")
}

fn pose() -> PathBuf {
    street().path("pose.json")
}

/// The keys of a JSON object, in its order.
fn keys(value: &Value) -> Vec<&str> {
    value
        .as_object()
        .unwrap_or_else(|| panic!("expected an object, found {value}"))
        .keys()
        .map(String::as_str)
        .collect()
}

const PRIOR: [&str; 11] = [
    "pose",
    "position_sigma_m",
    "height_sigma_m",
    "yaw_sigma_deg",
    "tilt_sigma_deg",
    "source",
    "file",
    "height_from",
    "heading_from",
    "sentences",
    "notes",
];

const LOCALIZATION: [&str; 15] = [
    "pose",
    "latitude",
    "longitude",
    "score",
    "covariance",
    "alignment",
    "reliable",
    "reasons",
    "gates",
    "runner_up",
    "candidates",
    "skipped",
    "matcher",
    "prior",
    "timings_ms",
];

#[test]
fn an_update_at_the_true_pose_places_the_banner_with_the_documented_keys() {
    let (bench, document) = Bench::with_banner();
    assert_eq!(
        keys(&document),
        [
            "capture",
            "base_version",
            "version",
            "decision",
            "localization",
            "changes",
            "rejections",
            "plugins",
            "timings_ms"
        ]
    );
    assert_eq!((&document["base_version"], &document["version"]), (&json!(1), &json!(2)));
    assert_eq!(document["decision"], "committed");
    assert_eq!(keys(&document["localization"]), LOCALIZATION);
    let changes = document["changes"].as_array().unwrap();
    assert_eq!(changes.len(), 1, "{changes:?}");
    assert_eq!(keys(&changes[0]), ["op", "fid", "class", "before", "after"]);
    let after = &changes[0]["after"];
    for key in ["class", "corners", "centre", "width_m", "height_m", "area_m2", "normal", "sigma_m"] {
        assert!(!after[key].is_null(), "{key} is missing in {after}");
    }
    let truth = street().case.truth.changes[0].position.unwrap();
    let off_m = (0..2).map(|i| (after["centre"][i].as_f64().unwrap() - truth[i]).powi(2)).sum::<f64>().sqrt();
    assert!(off_m < 0.5, "the banner is {off_m:.2} m off in plan");
    for plugin in document["plugins"].as_array().unwrap() {
        assert_eq!(keys(plugin), ["kind", "name", "version", "sha256", "settings", "settings_sha256", "files"]);
    }
    assert_eq!(bench.head(), 2);
}

#[test]
fn the_same_capture_again_changes_nothing_and_is_exit_20() {
    let (bench, _) = Bench::with_banner();
    let before = bench.run("query", &["--json"]).out;
    let again = bench.run("update", &[text(&capture()), "--pose", text(&pose()), "--json"]);
    assert_eq!(again.code, 20, "{}", again.err);
    let document = again.json();
    assert_eq!((&document["decision"], &document["version"]), (&json!("nothing"), &Value::Null));
    assert_eq!((bench.head(), bench.run("query", &["--json"]).out), (2, before));
}

#[test]
fn a_dry_run_says_what_would_change_and_writes_not_one_byte() {
    let bench = Bench::with_street();
    let (capture, pose) = (capture(), pose());
    let words = [text(&capture), "--pose", text(&pose), "--dry-run"];
    let document = bench.json("update", &words);
    assert_eq!((&document["decision"], &document["version"]), (&json!("dry-run"), &Value::Null));
    assert_eq!((&document["changes"][0]["op"], &document["changes"][0]["fid"]), (&json!("add"), &Value::Null));
    assert!(bench.is_unchanged());
    let lines = bench.run("update", &words).ok().out;
    assert!(lines.contains("dry-run") && lines.contains("add") && lines.contains("banner"), "{lines}");
    assert!(bench.is_unchanged());
}

#[test]
fn several_captures_give_an_array_and_one_that_changed_something_is_exit_0() {
    let bench = Bench::with_street();
    let capture = capture();
    let document = bench.json("update", &[text(&capture), text(&capture)]);
    let decisions: Vec<_> = document.as_array().unwrap().iter().map(|one| one["decision"].as_str().unwrap()).collect();
    assert_eq!(decisions, ["committed", "nothing"]);
    assert_eq!(bench.head(), 2);
}

#[test]
fn a_bad_capture_among_good_ones_still_prints_what_was_committed() {
    let bench = Bench::with_street();
    let (capture, bad) = (capture(), bench.file("bad.json", "{}"));
    let run = bench.run("update", &[text(&capture), &bad, "--json"]);
    assert_eq!(run.code, 10, "{}", run.err);
    assert!(run.err.contains("bad.json"), "{}", run.err);
    let document = run.json();
    assert_eq!(document.as_array().map(Vec::len), Some(1), "{document}");
    assert_eq!(document[0]["version"], bench.head());
}

#[test]
fn a_pose_that_is_found_can_be_written_and_read_again() {
    let bench = Bench::with_street();
    let (capture, found) = (capture(), bench.path("found.json"));
    let document = bench.json("localize", &[text(&capture), "--out", text(&found)]);
    assert!(bench.is_unchanged());
    assert_eq!(keys(&document), LOCALIZATION);
    assert_eq!(keys(&document["pose"]), ["easting", "northing", "height", "yaw_deg", "pitch_deg", "roll_deg"]);
    assert_eq!(keys(&document["matcher"]), ["name", "version", "sha256"]);
    assert_eq!(keys(&document["prior"]), PRIOR);
    assert_eq!((&document["prior"]["source"], &document["prior"]["file"]), (&json!("capture"), &Value::Null));
    for gate in document["gates"].as_array().unwrap() {
        assert_eq!(keys(gate), ["name", "measured", "limit", "unit", "passed"]);
    }
    assert_eq!(document["covariance"].as_array().map(Vec::len), Some(3));
    assert_eq!(keys(&document["alignment"]), ["covariance", "map_sigma_m", "label_sigma_px"]);
    assert_eq!(document["alignment"]["covariance"].as_array().map(Vec::len), Some(6));
    let written: Value = serde_json::from_slice(&std::fs::read(&found).unwrap()).unwrap();
    assert_eq!(written, document);
    let out = bench.path("view");
    bench.run("render", &["--pose", text(&found), "--out", text(&out)]).ok();
    assert!(out.join("view.json").exists());
    // The pose is then as sure as the document says, and not exact.
    let updated = bench.json("update", &[text(&capture), "--dry-run", "--pose", text(&found)]);
    assert_eq!(updated["localization"]["covariance"], document["covariance"]);
    assert_eq!(updated["localization"]["alignment"], document["alignment"]);
    let mut unsure = document.clone();
    unsure["covariance"][0][0] = json!(-1.0);
    let negative = bench.path("negative.json");
    std::fs::write(&negative, unsure.to_string()).unwrap();
    bench
        .run("update", &[text(&capture), "--dry-run", "--pose", text(&negative)])
        .refused(10, &["negative.json", "variances of at least 0", "found -1"]);
    let nowhere = bench.path("no/such/pose.json");
    bench
        .run("localize", &[text(&capture), "--set", "semantic.radius_m=2", "--out", text(&nowhere)])
        .refused(10, &["no/such/pose.json"]);
}

#[test]
fn an_unreliable_pose_is_exit_22_with_its_reasons_and_commits_nothing() {
    let bench = Bench::with_street();
    let capture = capture();
    let strict = [text(&capture), "--set", "gate.min_score=1", "--set", "semantic.radius_m=5", "--json"];
    let localized = bench.run("localize", &strict);
    assert_eq!(localized.code, 22, "{}", localized.err);
    assert_eq!(localized.json()["reliable"], false);
    assert!(localized.json()["reasons"][0].as_str().unwrap().contains("score"));
    let updated = bench.run("update", &strict);
    assert_eq!(updated.code, 22, "{}", updated.err);
    let document = updated.json();
    assert_eq!((&document["decision"], &document["version"]), (&json!("unreliable"), &Value::Null));
    assert_eq!(document["changes"], json!([]));
    assert_eq!(bench.head(), 1);
}

#[test]
fn a_view_is_drawn_in_the_size_of_the_camera() {
    let bench = Bench::with_street();
    let (capture, pose, out) = (capture(), pose(), bench.path("a/new/view"));
    let document = bench.json("render", &[text(&capture), "--pose", text(&pose), "--out", text(&out)]);
    assert_eq!(keys(&document), ["version", "pose", "width", "height", "class", "depth", "points"]);
    let size = |name: &str| {
        let reader =
            png::Decoder::new(std::io::Cursor::new(std::fs::read(out.join(name)).unwrap())).read_info().unwrap();
        (u64::from(reader.info().width), u64::from(reader.info().height), reader.info().bit_depth)
    };
    let expected = (document["width"].as_u64().unwrap(), document["height"].as_u64().unwrap());
    assert_eq!(expected.0, street().case.width as u64);
    assert_eq!(size("class.png"), (expected.0, expected.1, png::BitDepth::Eight));
    assert_eq!(size("depth.png"), (expected.0, expected.1, png::BitDepth::Sixteen));
    let points = std::fs::read(out.join("points.ply")).unwrap();
    let header = format!("element vertex {}\n", document["points"]["count"]);
    assert!(points.starts_with(b"ply\n") && String::from_utf8_lossy(&points[..400]).contains(&header));
    let written: Value = serde_json::from_slice(&std::fs::read(out.join("view.json")).unwrap()).unwrap();
    assert_eq!(written, document);
    assert!(bench.is_unchanged());
    let blocked = bench.file("file", "");
    bench.run("render", &["--pose", text(&pose), "--out", &blocked]).refused(10, &["file"]);
    resurvey(&["render", text(&bench.path("map.rsv")), "--out", text(&out)]).refused(2, &["--pose"]);
}
