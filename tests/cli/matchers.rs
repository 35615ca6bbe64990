//! Matchers that score views, alone and combined by the host.

use crate::bench::{Bench, resurvey, street, text};
use serde_json::Value;

fn capture() -> String {
    text(&street().path("capture/capture.json")).to_owned()
}

/// Distance in plan from the true pose of the street's capture, metres.
fn error_m(localization: &Value) -> f64 {
    let truth = &street().case.truth.json["pose"];
    let off = |key: &str| localization["pose"][key].as_f64().unwrap() - truth[key].as_f64().unwrap();
    off("easting").hypot(off("northing"))
}

#[test]
fn matchers_that_score_views_find_the_street_alone_and_together() {
    let bench = Bench::with_street();
    // The prior is 15 m (1 sigma along each axis) off.
    for matcher in ["pixel", "edges", "fused"] {
        let run = bench.run("localize", &[&capture(), "--matcher", matcher, "--json"]);
        assert!(matches!(run.code, 0 | 22), "{matcher}: {}", run.err);
        let (name, error_m) = (&run.json()["matcher"]["name"], error_m(&run.json()));
        assert_eq!(*name, matcher);
        assert!(error_m < 1.0, "{matcher} is {error_m:.2} m off");
    }
}

#[test]
fn the_evidence_of_a_combination_names_every_member_with_version_hash_and_settings() {
    let bench = Bench::with_street();
    let settings = ["--set", "fused.members=silhouette:2+edges", "--set", "edges.truncation=0.1"];
    let narrow = ["--set", "search.radius_m=4", "--set", "search.yaw_range_deg=4"];
    let capture = capture();
    let words = [&[capture.as_str(), "--matcher", "fused", "--json"], &settings[..], &narrow].concat();
    let used = |document: &Value| -> Vec<Value> { document["plugins"].as_array().unwrap().clone() };
    let plugins = used(&bench.run("update", &words).json());
    let names: Vec<&str> = plugins.iter().map(|used| used["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["fused", "silhouette", "edges", "class-difference", "descriptors"]);
    for used in &plugins {
        assert!(used["version"].is_string() && used["sha256"].as_str().unwrap().len() == 64, "{used}");
    }
    assert_eq!(plugins[0]["settings"]["members"], "silhouette:2+edges");
    assert_eq!(plugins[2]["settings"]["truncation"], 0.1);
    // Another setting of a member is another combination.
    let other =
        used(&Bench::with_street().run("update", &[&words[..], &["--set", "edges.truncation=0.2"]].concat()).json());
    assert_ne!(other[0]["sha256"], plugins[0]["sha256"]);
    assert_eq!(other[1], plugins[1]);
}

#[test]
fn what_cannot_be_combined_is_refused_with_the_reason() {
    let bench = Bench::with_street();
    let capture = capture();
    for (setting, code, words) in [
        ("fused.members=pixel+semantic", 12, &["semantic", "searches by itself"][..]),
        ("fused.members=pixel+aligned", 12, &["aligned is a detector"]),
        ("fused.members=pixel+magic", 11, &["magic"]),
        ("fused.members=pixel:1e308+edges:1e308", 2, &["weights from 1e-6 to 1e6"]),
        ("fused.members=pixel:0", 2, &["pixel:1+edges:2", "pixel:0"]),
        ("fused.members=pixel+pixel", 2, &["each matcher once"]),
        ("fused.members=fused", 2, &["not fused itself"]),
        ("fused.luck=1", 2, &["luck", "members"]),
        ("skyline.sky_class=6", 2, &["does not use \"skyline\"", "pixel, edges"]),
        ("edges.truncation=7", 2, &["truncation", "from 0.001 to 1"]),
    ] {
        for command in ["localize", "update"] {
            bench.refuses(command, &[&capture, "--matcher", "fused", "--set", setting], code, words);
        }
    }
    bench.refuses("localize", &[&capture, "--matcher", "fused", "--exhaustive"], 2, &["no such search"]);
    let eval = |matcher: &str| resurvey(&["eval", text(&street().path("")), "--matcher", matcher]);
    eval("fused:members=pixel+semantic").refused(12, &["searches by itself"]);
    eval("fused:members=pixel:x").refused(2, &["pixel:x"]);
}
