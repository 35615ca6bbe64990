//! `log`, `why` and revisions.

use crate::bench::{Bench, resurvey, text};
use serde_json::{Value, json};

fn numbers(log: &Value) -> Vec<u64> {
    log["versions"].as_array().unwrap().iter().map(|version| version["version"].as_u64().unwrap()).collect()
}

/// `--bbox` around the banner.
fn around(document: &Value) -> String {
    let [e, n] = [0, 1].map(|axis| document["changes"][0]["after"]["centre"][axis].as_f64().unwrap());
    format!("{},{},{},{}", e - 3.0, n - 3.0, e + 3.0, n + 3.0)
}

#[test]
fn the_log_is_newest_first_and_can_be_narrowed_to_a_feature_or_a_region() {
    let (bench, document) = Bench::with_banner();
    let log = bench.json("log", &[]);
    assert_eq!(numbers(&log), [2, 1, 0]);
    let keys: Vec<&String> = log["versions"][0].as_object().unwrap().keys().collect();
    let expected = [
        "version",
        "kind",
        "committed_at",
        "observed_at",
        "author",
        "message",
        "base_version",
        "reverts",
        "added",
        "modified",
        "removed",
        "hash",
    ];
    assert_eq!(keys, expected);
    let kinds: Vec<_> = log["versions"].as_array().unwrap().iter().map(|one| one["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["update", "import", "init"]);
    assert_eq!(numbers(&bench.json("log", &["-n", "2"])), [2, 1]);
    assert_eq!(numbers(&bench.json("log", &["--limit", "0"])), [0_u64; 0]);

    let fid = document["changes"][0]["fid"].to_string();
    assert_eq!(numbers(&bench.json("log", &[&fid])), [2]);
    assert_eq!(numbers(&bench.json("log", &["--bbox", "0,0,1,1"])), [0_u64; 0]);
    assert!(numbers(&bench.json("log", &["--bbox", &around(&document)])).contains(&2));
    let text = bench.run("log", &[]).ok().out;
    assert!(text.contains("version") && text.contains("update") && text.lines().count() >= 4, "{text}");
    assert!(bench.is_unchanged());
}

#[test]
fn every_way_to_name_a_version_gives_that_version() {
    let (bench, document) = Bench::with_banner();
    let fid = &document["changes"][0]["fid"];
    let at = |revision: &str| {
        let answer = bench.json("query", &["--at", revision]);
        let found = answer["features"].as_array().unwrap().iter().any(|feature| &feature["fid"] == fid);
        (answer["version"].as_u64().unwrap(), found)
    };
    assert_eq!((at("0"), at("1"), at("v1")), ((0, false), (1, false), (1, false)));
    assert_eq!((at("2"), at("v2"), at("head")), ((2, true), (2, true), (2, true)));
    assert_eq!(at("@2999-01-01"), (2, true));
    let log = bench.json("log", &[]);
    let committed = log["versions"][1]["committed_at"].as_str().unwrap();
    assert_eq!(at(&format!("@{committed}")), (1, false));
    assert_eq!(bench.json("query", &[])["version"], 2);
}

#[test]
fn why_names_the_capture_the_plugins_and_the_gates() {
    let (bench, document) = Bench::with_banner();
    let fid = document["changes"][0]["fid"].to_string();
    let why = bench.json("why", &[&fid]);
    let step = &why["steps"][0];
    assert_eq!((&why["fid"], &step["op"]), (&document["changes"][0]["fid"], &json!("add")));
    assert_eq!(step["version"]["version"], 2);
    assert_eq!(step["after"]["class"], "banner");
    let seen = &step["observation"];
    let digest = seen["capture_sha256"].as_str().unwrap();
    assert!(digest.len() == 64 && digest.bytes().all(|byte| byte.is_ascii_hexdigit()), "{digest}");
    assert_eq!(seen["decision"], "committed");
    // 10:07 in Hong Kong.
    assert_eq!(seen["taken_at"], "2026-06-01T02:07:00Z");
    assert!(seen["labels_sha256"].is_null() && seen["prior"]["pose"].is_object());
    let kinds: Vec<_> = seen["plugins"].as_array().unwrap().iter().map(|used| used["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["detector", "estimator"], "a given pose needs no matcher");
    for plugin in seen["plugins"].as_array().unwrap() {
        let digest = plugin["sha256"].as_str().unwrap();
        let info = resurvey(&["plugins", "info", plugin["name"].as_str().unwrap(), "--json"]).ok().json();
        assert_eq!(info["sha256"], digest);
    }
    let gates = seen["gates"].as_array().unwrap();
    assert!(gates.iter().all(|gate| gate["passed"] == true) && gates.len() == 5, "{gates:?}");
    let lines = bench.run("why", &[&fid]).ok().out;
    for word in ["version 2: add", digest, "prior", "pose", "gate", "detector", "estimator"] {
        assert!(lines.contains(word), "{word:?} is not in {lines}");
    }
}

#[test]
fn why_has_the_whole_evidence_as_text_too() {
    let bench = Bench::with_street();
    let capture = crate::bench::street().path("capture/capture.json");
    let document = bench.json("update", &[text(&capture)]);
    let fid = document["changes"][0]["fid"].to_string();
    let seen = bench.json("why", &[&fid])["steps"][0]["observation"].clone();
    assert_eq!(seen["localization"]["alignment"], document["localization"]["alignment"]);
    let lines = bench.run("why", &[&fid]).ok().out;
    let (camera, search) = (&seen["camera"], &seen["search"]);
    let mut words = vec![
        format!("camera    {}, {} x {} px", camera["model"].as_str().unwrap(), camera["width"], camera["height"]),
        format!("fx {} fy", camera["fx"].as_f64().unwrap()),
        format!(
            "search    {} m and {}°",
            search["radius_m"].as_f64().unwrap(),
            search["yaw_range_deg"].as_f64().unwrap()
        ),
        "aligned: 1 sigma H".to_owned(),
    ];
    words.extend(
        seen["plugins"].as_array().unwrap().iter().map(|used| used["settings_sha256"].as_str().unwrap().to_owned()),
    );
    for word in words {
        assert!(lines.contains(&word), "{word:?} is not in {lines}");
    }
}

#[test]
fn why_of_an_imported_object_says_that_there_is_no_capture() {
    let bench = Bench::with_street();
    let first = bench.json("query", &[])["features"][0]["fid"].to_string();
    let why = bench.json("why", &[&first]);
    assert_eq!((&why["steps"][0]["op"], &why["steps"][0]["observation"]), (&json!("add"), &Value::Null));
    assert!(bench.run("why", &[&first]).ok().out.contains("not made from a capture"));
    resurvey(&["fsck", text(&bench.path("map.rsv"))]).ok();
}

#[test]
fn labels_are_kept_as_evidence_only_when_asked() {
    let bench = Bench::with_street();
    let (capture, pose) =
        (crate::bench::street().path("capture/capture.json"), crate::bench::street().path("pose.json"));
    let words = [text(&capture), "--pose", text(&pose), "--keep-labels", "--message", "survey", "--author", "ada"];
    let document = bench.json("update", &words);
    let why = bench.json("why", &[&document["changes"][0]["fid"].to_string()]);
    assert_eq!(why["steps"][0]["observation"]["labels_sha256"].as_str().map(str::len), Some(64));
    let version = &why["steps"][0]["version"];
    assert_eq!((&version["author"], &version["message"]), (&json!("ada"), &json!("survey")));
}
