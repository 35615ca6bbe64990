//! Two who change the map at once, through the built binary: one wins, the other is told; a retry is done once.

use crate::bench::{Bench, Run, street, text};
use crate::change_sets::{chair, furnished, set};
use crate::differences::{chair_at, chair_state};
use serde_json::{Value, json};
use std::process::{Command, Stdio};

/// Runs these command lines on the map at the same time, each in a process of its own.
fn at_once(bench: &Bench, lines: &[Vec<&str>]) -> Vec<Run> {
    let map = bench.path("map.rsv");
    let start = |words: &Vec<&str>| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_resurvey"));
        command.arg(words[0]).arg(&map).args(&words[1..]).arg("--json");
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let children: Vec<_> = lines.iter().map(start).collect();
    let end = |child: std::process::Child| {
        let output = child.wait_with_output().unwrap();
        let text = |bytes| String::from_utf8(bytes).unwrap();
        let code = u8::try_from(output.status.code().unwrap()).unwrap();
        Run { code, out: text(output.stdout), err: text(output.stderr) }
    };
    children.into_iter().map(end).collect()
}

#[test]
fn of_two_processes_that_change_one_feature_from_one_base_the_second_gets_a_list() {
    let bench = furnished();
    let file = |name: &str, east: f64| {
        let line = json!({"op": "modify", "fid": 1, "before": chair(), "after": chair_at(east)});
        bench.file(name, set(Some(1), &[line]))
    };
    let (first, second) = (file("first.jsonl", 1.0), file("second.jsonl", 2.0));
    let runs = at_once(&bench, &[vec!["apply", &first], vec!["apply", &second]]);
    let mut codes: Vec<u8> = runs.iter().map(|run| run.code).collect();
    codes.sort_unstable();
    assert_eq!(codes, [0, 21], "{runs:?}");
    let lost = runs.iter().find(|run| run.code == 21).unwrap().json();
    let [expected, found] = [chair_state(0.0), lost["conflicts"][0]["found"].clone()];
    assert!([chair_state(1.0), chair_state(2.0)].contains(&found), "{found}");
    let one =
        json!({"fid": 1, "changed_in": 2, "is_on_map": true, "is_target": true, "found": found, "expected": expected});
    assert_eq!(lost["conflicts"], json!([one]));
    for word in ["feature 1: expected chair at E 835600.00", ", found chair at E 83560"] {
        assert!(runs.iter().any(|run| run.err.contains(word)), "expected {word:?} in {runs:?}");
    }
    assert_eq!((&lost["base_version"], &lost["head"]), (&json!(1), &json!(2)));
    assert_eq!(bench.head(), 2);
}

#[test]
fn two_processes_that_change_different_places_both_pass() {
    let bench = furnished();
    let add = |name: &str, east: f64| bench.file(name, set(Some(1), &[json!({"op": "add", "after": chair_at(east)})]));
    let (first, second) = (add("first.jsonl", 100.0), add("second.jsonl", 200.0));
    let runs = at_once(&bench, &[vec!["apply", &first], vec!["apply", &second]]);
    assert!(runs.iter().all(|run| run.code == 0), "{runs:?}");
    assert_eq!((bench.head(), bench.state("head").len()), (3, 4));
}

#[test]
fn an_upload_that_is_sent_by_four_processes_with_one_key_is_committed_once() {
    let bench = furnished();
    let file = bench.file("set.jsonl", set(Some(1), &[json!({"op": "add", "after": chair_at(100.0)})]));
    let line = vec!["apply", &file, "--idempotency-key", "phone 7, photo 12"];
    let runs = at_once(&bench, &vec![line; 4]);
    for run in &runs {
        assert_eq!((run.code, &run.json()["version"]), (0, &json!(2)), "{run:?}");
    }
    assert_eq!((bench.head(), bench.state("head").len()), (2, 3));
    // Without the key it is another chair.
    bench.run("apply", &[&file]).ok();
    assert_eq!(bench.head(), 3);
}

#[test]
fn an_import_that_is_sent_again_with_its_key_is_done_once() {
    let bench = Bench::with_empty_map();
    let (model, origin) = (street().model("3ds"), street().origin());
    let words = [text(&model), "--origin", &origin, "--idempotency-key", "model of May"];
    assert_eq!(bench.json("import", &words)["version"], 1);
    assert_eq!(bench.json("import", &words)["version"], 1);
    assert_eq!(bench.head(), 1);
}

#[test]
fn a_change_set_from_before_a_photo_that_looked_there_is_a_conflict() {
    let (bench, document) = Bench::with_banner();
    let [e, n, h] = [0, 1, 2].map(|axis| document["changes"][0]["after"]["centre"][axis].as_f64().unwrap());
    let chair_near = json!({"class": "chair", "position": [e, n, h]});
    let stale = bench.file("set.jsonl", set(Some(1), &[json!({"op": "add", "after": chair_near})]));
    bench.run("apply", &[&stale]).refused(21, &["version 2 looked at a place that this changes"]);
    let run = bench.run("apply", &[&stale, "--json"]);
    assert_eq!((run.code, &run.json()["looked_at_by"]), (21, &json!([2])));
    // Far from what the photo shows nothing is in the way.
    let far = json!({"class": "chair", "position": [e + 5000.0, n, h]});
    let other = bench.file("set.jsonl", set(Some(1), &[json!({"op": "add", "after": far})]));
    bench.run("apply", &[&other]).ok();
    assert_eq!(bench.head(), 3);
}

#[test]
fn of_two_processes_with_one_photo_one_commits_and_the_banner_is_there_once() {
    let bench = Bench::with_street();
    let (capture, pose) = (street().path("capture/capture.json"), street().path("pose.json"));
    let line = vec!["update", text(&capture), "--pose", text(&pose)];
    let runs = at_once(&bench, &vec![line; 3]);
    let committed = runs.iter().filter(|run| run.code == 0).count();
    // Who read the map before the commit gets the conflict; who read it after finds nothing to do.
    let told: Vec<&str> = vec!["committed", "conflict", "nothing"];
    for run in &runs {
        assert!(told.contains(&run.json()["decision"].as_str().unwrap()), "{run:?}");
        assert!([0, 20, 21].contains(&run.code), "{run:?}");
    }
    assert_eq!((committed, bench.head()), (1, 2), "{runs:?}");
    assert_eq!(bench.json("query", &["--class", "banner"])["features"].as_array().map(Vec::len), Some(1));
}

#[test]
fn an_update_that_is_sent_again_with_its_key_gives_its_first_version() {
    let bench = Bench::with_street();
    let (capture, pose) = (street().path("capture/capture.json"), street().path("pose.json"));
    let words = [text(&capture), "--pose", text(&pose), "--idempotency-key", "photo 12"];
    let first = bench.json("update", &words);
    assert_eq!((&first["decision"], &first["version"]), (&json!("committed"), &json!(2)));
    assert_eq!(first["repeated"], Value::Null);
    bench.apply(&[json!({"op": "add", "after": chair()})]);
    let again = bench.json("update", &words);
    assert_eq!((&again["version"], &again["repeated"], &again["base_version"]), (&json!(2), &json!(true), &json!(1)));
    assert_eq!(again["changes"][0]["fid"], first["changes"][0]["fid"]);
    assert!(bench.run("update", &words).ok().out.contains("committed before, version 2"));
    assert_eq!(bench.head(), 3);
    bench.run("gc", &["--forget-before", "head"]).ok();
    let forgotten = bench.json("update", &words);
    assert_eq!((&forgotten["version"], &forgotten["changes"]), (&json!(2), &json!([])));
    let two = [text(&capture), text(&capture), "--idempotency-key", "k"];
    bench.run("update", &two).refused(2, &["--idempotency-key belongs to one photo"]);
}

#[test]
fn a_before_that_is_wrong_in_one_value_is_told_by_that_value() {
    let bench = furnished();
    let mut unsure = chair();
    unsure["sigma_m"] = json!(0.25);
    let file = bench.file("set.jsonl", set(Some(1), &[json!({"op": "remove", "fid": 1, "before": unsure})]));
    bench.run("apply", &[&file]).refused(21, &["feature 1: expected sigma_m = 0.25, found sigma_m = none"]);
    let gone = bench.file("set.jsonl", set(Some(1), &[json!({"op": "remove", "fid": 9, "before": chair()})]));
    bench.run("apply", &[&gone]).refused(21, &["feature 9: expected chair at E 835600.00", "found none"]);
    let run = bench.run("apply", &[&gone, "--json"]);
    let one = &run.json()["conflicts"][0];
    assert_eq!((&one["expected"], &one["found"], &one["changed_in"]), (&chair_state(0.0), &Value::Null, &Value::Null));
}
