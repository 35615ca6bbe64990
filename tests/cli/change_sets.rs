//! `apply`: a change set whole, or refused whole.

use crate::bench::{Bench, edited};
use crate::differences::chair_at;
use serde_json::{Value, json};

/// A point of the street, 30 m from its origin.
pub const CHAIR: [f64; 3] = [835_600.0, 817_800.0, 4.5];

/// A chair at [`CHAIR`].
pub fn chair() -> Value {
    json!({"class": "chair", "position": CHAIR})
}

/// 2 m × 1 m, facing east.
pub fn banner() -> Value {
    let [e, n, h] = CHAIR;
    json!({"class": "banner", "corners": [[e, n, h], [e, n + 2.0, h], [e, n + 2.0, h + 1.0], [e, n, h + 1.0]]})
}

/// A change set as text.
pub fn set(base: Option<u64>, lines: &[Value]) -> String {
    let header = json!({"format": "resurvey.changes/1", "base_version": base, "author": "survey", "message": "m"});
    std::iter::once(&header).chain(lines).map(|line| format!("{line}\n")).collect()
}

/// A map with a chair (fid 1) and a banner (fid 2) as version 1.
pub fn furnished() -> Bench {
    let bench = Bench::with_empty_map();
    let lines = [json!({"op": "add", "after": chair()}), json!({"op": "add", "after": banner()})];
    let file = bench.file("first.jsonl", set(Some(0), &lines));
    let applied = bench.json("apply", &[&file]);
    let expected = json!({"base_version": 0, "version": 1, "added": 2, "modified": 0, "removed": 0});
    assert_eq!(applied, expected);
    bench
}

/// Asserts that the set is refused and the map stays at version 1.
fn refuses(bench: &Bench, text: &str, code: u8, words: &[&str]) {
    let file = bench.file("set.jsonl", text);
    bench.run("apply", &[&file]).refused(code, words);
    assert_eq!(bench.head(), 1);
}

#[test]
fn a_set_is_applied_whole_and_seen_in_the_log() {
    let bench = furnished();
    let [moved, gone] = [edited(&chair(), |c| c["position"][0] = json!(835_601.0)), banner().to_string()];
    let [moved, gone]: [Value; 2] = [moved, gone].map(|text| serde_json::from_str(&text).unwrap());
    let lines = [
        json!({"op": "modify", "fid": 1, "before": chair(), "after": moved}),
        json!({"op": "remove", "fid": 2, "before": gone}),
    ];
    let file = bench.file("second.jsonl", set(Some(1), &lines));
    let run = bench.run("apply", &[&file]).ok();
    assert_eq!(run.out, "version 2: 0 added, 1 modified, 1 removed\n");
    let versions = bench.json("log", &[])["versions"].clone();
    assert_eq!((&versions[0]["author"], &versions[0]["message"]), (&json!("survey"), &json!("m")));
    assert_eq!((&versions[0]["kind"], &versions[0]["modified"]), (&json!("apply"), &json!(1)));
    let chairs = bench.json("query", &["--class", "chair"]);
    assert_eq!(chairs["features"][0]["position"][0], 835_601.0);
    assert_eq!(bench.json("query", &["--class", "banner"])["features"], json!([]));
}

#[test]
fn a_before_that_is_not_what_the_map_has_is_exit_21() {
    let bench = furnished();
    let wrong = json!({"class": "chair", "position": [835_600.5, 817_800.0, 4.5]});
    let remove = json!({"op": "remove", "fid": 1, "before": wrong});
    refuses(
        &bench,
        &set(Some(1), &[json!({"op": "add", "after": banner()}), remove]),
        21,
        &["version 1 of the map is not what was expected: feature 1", "resurvey query"],
    );
    refuses(&bench, &set(Some(1), &[json!({"op": "remove", "fid": 9, "before": chair()})]), 21, &["feature 9"]);
    let taken = json!({"op": "add", "fid": 1, "after": chair()});
    refuses(&bench, &set(None, &[taken]), 21, &["feature 1"]);
}

#[test]
fn a_base_that_the_map_never_had_is_exit_11() {
    let bench = furnished();
    let words = ["set.jsonl: base_version: no version 7; the newest is 1", "null applies to any version"];
    refuses(&bench, &set(Some(7), &[json!({"op": "add", "after": chair()})]), 11, &words);
}

#[test]
fn a_set_that_is_none_is_exit_10_with_its_line() {
    let bench = furnished();
    let add = |after: Value| set(Some(1), &[json!({"op": "add", "after": after})]);
    let skewed = edited(&banner(), |b| b["corners"][2][0] = json!(835_601.0));
    let twice = set(Some(1), &vec![json!({"op": "remove", "fid": 1, "before": chair()}); 2]);
    let cases: Vec<(String, Vec<&str>)> = vec![
        (String::new(), vec!["line 1", "resurvey.changes/1"]),
        ("a change\n".to_owned(), vec!["line 1"]),
        (set(Some(1), &[]).replace("changes/1", "changes/2"), vec!["resurvey.changes/2"]),
        (set(Some(1), &[]).replace("author", "auther"), vec!["line 1", "unknown field `auther`"]),
        (twice, vec!["line 3: feature 1 has two deltas, the first in line 2"]),
        (add(json!({"class": "sofa", "position": CHAIR})), vec!["line 2, after", "\"sofa\"", "expected one of stone"]),
        (add(json!({"class": "sky", "position": CHAIR})), vec!["line 2, after", "sky"]),
        (add(serde_json::from_str(&skewed).unwrap()), vec!["line 2, after", "corner 0"]),
        (add(json!({"class": "banner", "position": CHAIR})), vec!["line 2, after", "banner"]),
        (add(json!({"class": "chair", "position": [1e30, 0, 0]})), vec!["line 2, after"]),
        (add(chair()).replace("835600.0", "NaN"), vec!["line 2", "expected value"]),
        (add(chair()).replace("835600.0", "1e999"), vec!["line 2", "number out of range"]),
        (add(chair()).replace("\"add\"", "\"shift\""), vec!["line 2", "unknown variant `shift`"]),
        (set(Some(1), &[json!({"op": "remove", "before": chair()})]), vec!["line 2", "fid"]),
        (set(Some(1), &[json!({"op": "add", "fid": 0, "after": chair()})]), vec!["line 2", "fid 0"]),
        (
            set(Some(1), &[json!({"op": "modify", "fid": 1, "before": chair(), "after": chair()})]),
            vec!["line 2: feature 1 changes nothing"],
        ),
    ];
    for (text, words) in cases {
        let words: Vec<&str> = words.into_iter().chain(["set.jsonl"]).collect();
        refuses(&bench, &text, 10, &words);
    }
    bench.run("apply", &["/nowhere.jsonl"]).refused(10, &["/nowhere.jsonl"]);
    let binary = bench.file("set.jsonl", [0xff_u8; 64]);
    bench.run("apply", &[&binary]).refused(10, &["set.jsonl"]);
}

#[test]
fn the_base_that_is_printed_is_the_base_in_the_log() {
    let bench = furnished();
    bench.apply(&[json!({"op": "add", "after": chair_at(100.0)})]);
    let file = bench.file("late.jsonl", set(Some(1), &[json!({"op": "add", "after": chair_at(200.0)})]));
    let applied = bench.json("apply", &[&file]);
    assert_eq!((&applied["base_version"], &applied["version"]), (&json!(1), &json!(3)));
    assert_eq!(bench.json("log", &["-n", "1"])["versions"][0]["base_version"], applied["base_version"]);
}

#[test]
fn a_set_without_an_operation_is_exit_20() {
    let bench = furnished();
    let same = bench.run("changes", &["1..1"]).ok().out;
    for text in [set(Some(1), &[]), set(None, &[]), same] {
        let file = bench.file("set.jsonl", text);
        bench.run("apply", &[&file]).refused(20, &["set.jsonl: ", "changes nothing", "after the header"]);
        let run = bench.run("apply", &[&file, "--json"]);
        let expected = json!({"decision": "nothing", "base_version": 1, "version": null, "added": 0, "modified": 0,
            "removed": 0});
        assert_eq!((run.code, run.json()), (20, expected));
    }
    assert_eq!(bench.head(), 1);
}

#[test]
fn a_set_without_an_author_is_committed_by_resurvey() {
    let bench = furnished();
    let text = set(Some(1), &[json!({"op": "add", "after": chair_at(9.0)})]).replace("\"author\":\"survey\",", "");
    assert!(!text.contains("author"));
    bench.json("apply", &[&bench.file("set.jsonl", text)]);
    assert_eq!(bench.json("log", &["-n", "1"])["versions"][0]["author"], "resurvey");
}

#[test]
fn a_set_that_another_program_wrote_is_told_in_its_own_words() {
    let bench = furnished();
    let add = set(Some(1), &[json!({"op": "add", "after": chair_at(9.0)})]);
    let marked = format!("\u{feff}{}", add.replace('\n', "\r\n"));
    bench.run("apply", &[&bench.file("marked.jsonl", marked)]).ok();
    for (text, word) in
        [("[]", "line 1: invalid length 0, expected a header"), ("7", "expected a header, {\"format\": …}")]
    {
        bench.run("apply", &[&bench.file("set.jsonl", text)]).refused(10, &[word]);
    }
    let line = set(Some(1), &[json!([])]);
    bench.run("apply", &[&bench.file("set.jsonl", line)]).refused(10, &["line 2: ", "expected an operation"]);
    bench.run("apply", &[&bench.file("set.jsonl", [0xff_u8; 9])]).refused(10, &["set.jsonl: ", "in UTF-8"]);
}
