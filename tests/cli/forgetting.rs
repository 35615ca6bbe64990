//! `gc`, `fsck --repair`, and maps of older formats.

use crate::bench::{Bench, resurvey, text};
use crate::differences::{chair_at, changed};
use rusqlite::Connection;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Versions 1 to 5; version 2 is called "surveyed".
fn long() -> Bench {
    let bench = changed();
    bench.run("tag", &["surveyed", "2"]).ok();
    for east in [1.0, 2.0, 3.0] {
        let line = json!({"op": "modify", "fid": 1, "before": chair_at(east), "after": chair_at(east + 1.0)});
        bench.apply(&[line]);
    }
    bench
}

#[test]
fn nothing_is_forgotten_that_was_not_asked_for() {
    let bench = long();
    assert_eq!(bench.run("gc", &[]).ok().out, "nothing to remove\n");
    let dry = bench.json("gc", &["--forget-before", "5", "--dry-run"]);
    assert_eq!((&dry["forgotten"], &dry["kept"]), (&json!([1, 3, 4]), &json!([0, 2, 5])));
    assert_eq!((&dry["dry_run"], &dry["states"]), (&json!(true), &json!(4)));
    let said = bench.run("gc", &["--forget-before", "head", "--dry-run"]).ok().out;
    let expected = "versions would be forgotten: 1, 3-4\nversions kept: 0, 2, 5\n";
    assert!(said.starts_with(expected) && said.contains("would be removed: 4 states"), "{said}");
    assert_eq!((bench.head(), bench.state("4").len()), (5, 2));
}

#[test]
fn what_is_forgotten_is_refused_by_name_and_what_is_kept_is_as_it_was() {
    let bench = long();
    let before = ["2", "head"].map(|revision| bench.state(revision));
    let done = bench.json("gc", &["--forget-before", "head"]);
    assert_eq!((&done["dry_run"], &done["forgotten"]), (&json!(false), &json!([1, 3, 4])));
    assert_eq!(["surveyed", "head"].map(|revision| bench.state(revision)), before);
    let out = text(&bench.path("out.glb")).to_owned();
    for words in [
        &["query", "--at", "3"][..],
        &["diff", "1..head"],
        &["changes", "head..4"],
        &["export", &out, "--at", "4"],
        &["tag", "late", "3"],
        &["revert", "5"],
    ] {
        bench.run(words[0], &words[1..]).refused(11, &["was forgotten; the next one that is kept is"]);
    }
    let fids = |range: &str| bench.json("diff", &[range])["changes"][0]["fid"].clone();
    assert_eq!(fids("2..5"), 1);
    assert_eq!(bench.json("log", &[])["versions"].as_array().map(Vec::len), Some(6));
    assert_eq!(bench.head(), 5);
    assert_eq!(bench.run("gc", &["--forget-before", "head"]).ok().out, "nothing to remove\n");
    bench.run("gc", &["--forget-before", "9"]).refused(11, &["no version 9"]);
    bench.apply(&[json!({"op": "add", "after": chair_at(9.0)})]);
    assert_eq!(bench.head(), 6);
}

#[test]
fn what_a_forgotten_version_did_to_a_feature_or_region_is_unknown() {
    let bench = long();
    bench.run("gc", &["--forget-before", "head"]).ok();
    // The chair came with version 1 and was moved by 2, which has a tag, and by 3 to 5.
    let why = bench.json("why", &["1"]);
    let steps: Vec<Value> = why["steps"].as_array().unwrap().clone();
    let ops: Vec<_> = steps.iter().map(|step| (step["version"]["version"].clone(), step["op"].clone())).collect();
    assert_eq!(ops, [5, 3, 2].map(|version| (json!(version), Value::Null)));
    assert_eq!((&steps[0]["before"], &steps[1]["after"]), (&Value::Null, &Value::Null));
    assert_eq!((&steps[0]["after"]["class"], &steps[1]["before"]["class"]), (&json!("chair"), &json!("chair")));
    let text = bench.run("why", &["1"]).ok().out;
    let words =
        ["version 5: unknown, forgotten, by apply", "before    unknown, forgotten", "after     unknown, forgotten"];
    assert!(words.iter().all(|words| text.contains(words)), "{text}");
    for question in [&["1"][..], &["--bbox", "835590,817790,835660,817810"]] {
        let log = bench.json("log", question);
        let counts = |record: &Value| (record["added"].clone(), record["modified"].clone(), record["removed"].clone());
        let all: Vec<_> = log["versions"].as_array().unwrap().iter().map(counts).collect();
        assert!(!all.is_empty() && all.iter().all(|one| *one == (Value::Null, Value::Null, Value::Null)), "{log}");
        let run = bench.run("log", question).ok();
        assert!(run.out.contains(" ? ") && run.err.contains("?: unknown, forgotten"), "{}{}", run.out, run.err);
    }
    let log = bench.json("log", &[]);
    assert_eq!((&log["versions"][0]["modified"], &log["versions"][4]["added"]), (&json!(1), &json!(2)));
}

/// The bytes of every label image that a map of the street keeps are worth forgetting.
#[test]
fn the_file_gets_smaller() {
    let bench = Bench::with_street();
    let street = crate::bench::street();
    let (capture, pose) = (street.path("capture/capture.json"), street.path("pose.json"));
    bench.run("update", &[text(&capture), "--pose", text(&pose), "--keep-labels"]).ok();
    bench.json("revert", &["2"]);
    bench.json("revert", &["1"]);
    let done = bench.json("gc", &["--forget-before", "head"]);
    let [before, after] = ["file_bytes_before", "file_bytes_after"].map(|key| done[key].as_u64().unwrap());
    assert!(after < before && done["label_images"] == 1 && done["geometries"].as_u64().unwrap() > 0, "{done}");
    assert_eq!(bench.head(), 4);
}

#[test]
fn a_lost_index_is_mended_and_what_cannot_be_is_named() {
    let bench = changed();
    let raw = || Connection::open(bench.path("map.rsv")).unwrap();
    raw().execute_batch("DELETE FROM feature_index").unwrap();
    let run = bench.run("fsck", &["--json"]);
    assert_eq!((run.code, &run.json()["ok"]), (13, &json!(false)));
    assert!(run.out.contains("index: feature 1 from version 1: is not in the index"), "{}", run.out);
    let mended = bench.json("fsck", &["--repair"]);
    assert_eq!((&mended["ok"], &mended["problems"]), (&json!(true), &json!([])));
    assert_eq!(mended["repaired"].as_array().map(Vec::len), Some(4));
    assert_eq!(
        bench.json("query", &["--bbox", "835590,817790,835660,817810"])["features"].as_array().map(Vec::len),
        Some(2)
    );
    assert_eq!(bench.run("fsck", &["--repair"]).ok().out.lines().count(), 1);
    raw()
        .execute_batch(
            "PRAGMA foreign_keys = OFF; DROP TRIGGER version_is_final; UPDATE version SET added = 7 WHERE version = 1",
        )
        .unwrap();
    let left = bench.run("fsck", &["--repair", "--json"]);
    assert_eq!(left.code, 13);
    assert!(left.out.contains("schema: trigger version_is_final: is missing"), "{}", left.out);
    assert!(left.out.contains("versions: version 1: says"), "{}", left.out);
    assert_eq!(left.json()["repaired"], json!([]));
}

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

#[test]
fn a_map_of_every_format_so_far_opens_unchanged_and_takes_another_version() {
    for (name, format) in (1..=4).map(|format| (format!("map-format-{format}.rsv"), format)) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(&name);
        std::fs::copy(fixture(&name), &path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let map = text(&path);
        let json = |words: &[&str]| {
            let words: Vec<&str> = words.iter().copied().chain(["--json"]).collect();
            resurvey(&words).ok().json()
        };
        let format_of = || {
            let raw = Connection::open(&path).unwrap();
            raw.pragma_query_value(None, "user_version", |row| row.get::<_, i32>(0)).unwrap()
        };
        assert_eq!(json(&["fsck", map]), json!({"ok": true, "problems": []}));
        let head = json(&["query", map])["version"].as_u64().unwrap();
        json(&["diff", map, "surveyed..head"]);
        json(&["query", map, "--observed-at", "2026-03-02"]);
        json(&["gc", map, "--dry-run"]);
        json(&["why", map, "1"]);
        json(&["proposals", map]);
        let typo = directory.path().join("typo.jsonl");
        std::fs::write(&typo, "{").unwrap();
        let set = directory.path().join("set.jsonl");
        let gone = json!({"op": "remove", "fid": 99, "before": chair_at(0.0)});
        std::fs::write(&set, crate::change_sets::set(None, &[gone])).unwrap();
        for (code, words) in [
            (10, &["apply", map, text(&typo)][..]),
            (10, &["tag", map, "surveyed"]),
            (11, &["revert", map, "99"]),
            (11, &["proposals", map, "accept", "9"]),
            (21, &["apply", map, text(&set)]),
        ] {
            assert_eq!(resurvey(words).code, code, "{words:?}");
        }
        assert_eq!(resurvey(&["gc", map]).ok().out, "nothing to remove\n");
        assert_eq!(json(&["fsck", map, "--repair"])["repaired"], json!([]));
        assert_eq!((std::fs::read(&path).unwrap() == bytes, format_of()), (true, format), "{name}");
        json(&["proposals", map, "accept", "1"]);
        assert_eq!((json(&["query", map])["version"].as_u64(), format_of()), (Some(head + 1), 4), "{name}");
        assert_eq!(json(&["fsck", map]), json!({"ok": true, "problems": []}));
        let log: Value = json(&["log", map]);
        assert_eq!(log["versions"].as_array().unwrap().len() as u64, head + 2);
    }
}

/// The page on the format is enough to check a map by.
#[test]
fn another_program_finds_the_chain_states_and_seals_of_a_map_and_what_changed_in_it() {
    let verify = |map: &Path| {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/verify_chain.py");
        Command::new("python3").arg(script).arg(map).output()
    };
    let bench = long();
    bench.run("gc", &["--forget-before", "head"]).ok();
    let map = bench.path("map.rsv");
    let Ok(whole) = verify(&map) else {
        println!("SKIPPED: python3 is missing");
        return;
    };
    let said = |output: &std::process::Output| String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(whole.status.success(), "{}{}", said(&whole), String::from_utf8_lossy(&whole.stderr));
    assert!(said(&whole).contains("state of 5 ") && said(&whole).ends_with("seals ok\n"), "{}", said(&whole));
    let raw = Connection::open(&map).unwrap();
    raw.execute_batch("UPDATE tag SET version = 5").unwrap();
    drop(raw);
    let changed = verify(&map).unwrap();
    assert!(!changed.status.success() && said(&changed).contains("tag surveyed is not what"), "{}", said(&changed));
}
