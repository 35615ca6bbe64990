//! `query --observed-at`: when the world was so, beside when it was committed.

use crate::bench::{Bench, resurvey, street, text};
use crate::change_sets::{chair, set};
use crate::differences::chair_at;
use serde_json::{Value, json};

/// Applies a set that was observed at `time`.
fn observed(bench: &Bench, time: &str, line: &Value) {
    let header = set(None, &[]).replace("\"message\"", &format!("\"observed_at\":\"{time}\",\"message\""));
    let file = bench.file("observed.jsonl", format!("{header}{line}\n"));
    bench.run("apply", &[&file]).ok();
}

/// Eastings of the chairs that were there at `time`, as `revision` knows it.
fn chairs(bench: &Bench, revision: &str, time: &str) -> Vec<f64> {
    let answer = bench.json("query", &["--at", revision, "--observed-at", time]);
    answer["features"].as_array().unwrap().iter().map(|one| one["position"][0].as_f64().unwrap()).collect()
}

#[test]
fn what_was_there_at_a_time_is_told_by_when_it_was_seen() {
    let bench = Bench::with_empty_map();
    observed(&bench, "2026-03-01T10:00:00+08:00", &json!({"op": "add", "after": chair()}));
    observed(
        &bench,
        "2026-03-05T00:00:00Z",
        &json!({"op": "modify", "fid": 1, "before": chair(), "after": chair_at(5.0)}),
    );
    // Seen in between, and told last.
    observed(
        &bench,
        "2026-03-03T00:00:00Z",
        &json!({"op": "modify", "fid": 1, "before": chair_at(5.0), "after": chair_at(3.0)}),
    );
    let at = |revision: &str, time: &str| chairs(&bench, revision, time);
    // 10:00 in Hong Kong is 02:00 UTC.
    assert_eq!((at("head", "2026-02-28"), at("head", "2026-03-01T01:59:59Z")), (vec![], vec![]));
    assert_eq!((at("head", "2026-03-01T02:00:00Z"), at("head", "@2026-03-02")), (vec![835_600.0], vec![835_600.0]));
    assert_eq!((at("head", "2026-03-04"), at("head", "2026-03-05")), (vec![835_603.0], vec![835_605.0]));
    // Version 2 had not heard of it yet.
    assert_eq!(at("2", "2026-03-04"), [835_600.0]);
    assert_eq!(bench.json("query", &[])["features"][0]["position"][0], 835_603.0);
    let bbox = ["--observed-at", "2026-03-05", "--bbox", "835604,817799,835606,817801"];
    assert_eq!(bench.json("query", &bbox)["features"].as_array().map(Vec::len), Some(1));
    let bbox = ["--observed-at", "2026-03-04", "--bbox", "835604,817799,835606,817801"];
    assert_eq!(bench.json("query", &bbox)["features"], json!([]));
    let seen = bench.json("log", &["-n", "1"])["versions"][0]["observed_at"].clone();
    assert_eq!(seen, "2026-03-03T00:00:00Z");
}

#[test]
fn a_photo_speaks_of_when_it_was_taken_and_a_model_of_when_it_was_surveyed() {
    let (bench, document) = Bench::with_banner();
    let fid = &document["changes"][0]["fid"];
    let has = |time: &str| {
        let answer = bench.json("query", &["--observed-at", time]);
        answer["features"].as_array().unwrap().iter().any(|feature| &feature["fid"] == fid)
    };
    // Taken at 10:07 in Hong Kong.
    assert_eq!((has("2026-06-01T10:06:59+08:00"), has("2026-06-01T10:07:00+08:00")), (false, true));
    let map = bench.path("surveyed.rsv");
    resurvey(&["init", text(&map)]).ok();
    let model = street().model("3ds");
    resurvey(&["import", text(&map), text(&model), "--origin", &street().origin(), "--observed-at", "2020-05-01"]).ok();
    let count = |time: &str| {
        let answer = resurvey(&["query", text(&map), "--observed-at", time, "--json"]).ok().json();
        answer["features"].as_array().unwrap().len()
    };
    assert!(count("2020-04-30") == 0 && count("2020-05-01") > 1);
}

#[test]
fn a_time_that_is_none_is_refused() {
    let bench = Bench::with_street();
    for time in ["yesterday", "2026-13-01", "2026-03-01T10:00:00", "", "5"] {
        bench.refuses("query", &["--observed-at", time], 2, &["is not a time", "@2026-03-01"]);
    }
    let header = "{\"format\":\"resurvey.changes/1\",\"base_version\":null,\"observed_at\":\"noon\"}\n";
    let file = bench.file("set.jsonl", header);
    bench.refuses("apply", &[&file], 10, &["line 1", "observed_at", "noon"]);
    assert_eq!(bench.json("query", &["--observed-at", "1900-01-01"])["features"], json!([]));
}
