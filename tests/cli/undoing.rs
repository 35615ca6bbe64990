//! `revert` and `tag`.

use crate::bench::Bench;
use crate::change_sets::{CHAIR, chair, furnished};
use crate::differences::{chair_at, chair_state, changed};
use serde_json::{Value, json};

#[test]
fn an_undo_restores_the_map_and_its_own_undo_the_original() {
    let bench = changed();
    let document = bench.json("revert", &["2"]);
    assert_eq!(document, json!({"reverts": 2, "version": 3, "added": 1, "modified": 1, "removed": 1}));
    assert_eq!(bench.state("3"), bench.state("1"));
    let run = bench.run("revert", &["head", "--message", "it was right", "--author", "ada"]).ok();
    assert_eq!(run.out, "version 4 undoes version 3: 1 added, 1 modified, 1 removed\n");
    assert_eq!(bench.state("4"), bench.state("2"));
    let versions = bench.json("log", &["-n", "2"])["versions"].clone();
    assert_eq!((&versions[0]["kind"], &versions[0]["reverts"]), (&json!("revert"), &json!(3)));
    assert_eq!((&versions[0]["message"], &versions[0]["author"]), (&json!("it was right"), &json!("ada")));
    assert_eq!((&versions[1]["message"], &versions[1]["reverts"]), (&json!("revert version 2: m"), &json!(2)));
    assert_eq!(bench.head(), 4);
}

#[test]
fn an_undo_of_what_changed_later_is_exit_21_with_a_list() {
    let bench = changed();
    bench.apply(&[json!({"op": "modify", "fid": 1, "before": chair_at(1.0), "after": chair_at(2.0)})]);
    bench
        .run("revert", &["2"])
        .refused(21, &["between version 2 and version 3", "feature 1 (version 3)", "resurvey query"]);
    let run = bench.run("revert", &["2", "--json"]);
    assert_eq!(run.code, 21);
    let document = run.json();
    let keys: Vec<&String> = document.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["decision", "base_version", "head", "version", "conflicts", "looked_at_by"]);
    let (found, expected) = (chair_state(2.0), chair_state(1.0));
    let one =
        json!({"fid": 1, "changed_in": 3, "is_on_map": true, "is_target": true, "found": found, "expected": expected});
    assert_eq!(document["conflicts"], json!([one]));
    assert_eq!((&document["decision"], &document["version"]), (&json!("conflict"), &Value::Null));
    assert_eq!(bench.head(), 3);
    // Where nothing changed since, it can be undone.
    let [e, n, _] = CHAIR;
    let far = format!("{},{},{},{}", e + 45.0, n - 5.0, e + 55.0, n + 5.0);
    let part = bench.json("revert", &["2", "--bbox", &far]);
    assert_eq!((&part["removed"], &part["added"], &part["modified"]), (&json!(1), &json!(0), &json!(0)));
}

#[test]
fn an_undo_does_not_put_a_chair_into_the_one_that_stands_there_by_now() {
    let bench = furnished();
    bench.apply(&[json!({"op": "remove", "fid": 1, "before": chair()})]);
    bench.apply(&[json!({"op": "add", "after": chair_at(0.1)})]);
    let run = bench.run("revert", &["2", "--json"]);
    assert_eq!(run.code, 21, "{run:?}");
    let there = json!({"fid": 3, "changed_in": 3, "is_on_map": true, "is_target": false, "found": chair_state(0.1)});
    assert_eq!(run.json()["conflicts"], json!([there]));
    assert_eq!(bench.head(), 3);
    // Once that is gone, there is room.
    bench.json("revert", &["3"]);
    assert_eq!(bench.json("revert", &["2"])["added"], 1);
}

#[test]
fn an_undo_that_has_nothing_to_undo_is_exit_20() {
    let bench = changed();
    bench.run("revert", &["2", "--bbox", "0,0,1,1"]).refused(20, &["version 2 changed nothing in the region"]);
    bench.run("revert", &["0"]).refused(20, &["version 0 changed nothing"]);
    for words in [&["2", "--bbox", "0,0,1,1", "--json"][..], &["0", "--json"]] {
        let run = bench.run("revert", words);
        let reverts: u64 = words[0].parse().unwrap();
        let expected = json!({"decision": "nothing", "reverts": reverts, "version": null, "added": 0, "modified": 0,
            "removed": 0});
        assert_eq!((run.code, run.json()), (20, expected));
    }
    bench.run("revert", &["7"]).refused(11, &["no version 7; the newest is 2"]);
    bench.run("revert", &["@1999-12-31"]).refused(11, &["no version at 1999-12-31"]);
    assert_eq!(bench.head(), 2);
}

#[test]
fn why_of_an_undone_change_has_the_evidence_of_what_was_undone() {
    let (bench, document) = Bench::with_banner();
    let fid = document["changes"][0]["fid"].to_string();
    bench.json("revert", &["2"]);
    let why = bench.json("why", &[&fid]);
    assert_eq!((&why["steps"][0]["op"], &why["steps"][0]["observation"]), (&json!("remove"), &Value::Null));
    let reverted = &why["steps"][0]["reverted"];
    assert_eq!(reverted["version"]["version"], 2);
    assert_eq!(reverted["observation"]["capture_sha256"], why["steps"][1]["observation"]["capture_sha256"]);
    assert_eq!(why["steps"][1]["reverted"], Value::Null);
    let lines = bench.run("why", &[&fid]).ok().out;
    for word in ["version 3: remove by revert", "undoes    version 2: update: 1 added", "hash", "before", "score"] {
        assert!(lines.contains(word), "{word:?} is not in {lines}");
    }
    // The import is undone with all its objects, and comes back.
    bench.json("revert", &["1"]);
    assert_eq!(bench.state("head"), Vec::<Value>::new());
    bench.json("revert", &["head"]);
    assert_eq!(bench.state("head"), bench.state("1"));
    assert_eq!(bench.head(), 5);
}

#[test]
fn a_version_has_a_name_until_it_is_taken_away() {
    let bench = changed();
    assert_eq!(bench.run("tag", &[]).ok().out, "");
    assert_eq!(bench.run("tag", &["surveyed", "1"]).ok().out, "surveyed names version 1\n");
    assert_eq!(bench.json("tag", &["newest"]), json!({"tag": "newest", "version": 2, "deleted": false}));
    assert_eq!(bench.run("tag", &[]).ok().out, "newest 2\nsurveyed 1\n");
    let listed = json!({"tags": [{"tag": "newest", "version": 2}, {"tag": "surveyed", "version": 1}]});
    assert_eq!(bench.json("tag", &[]), listed);
    assert_eq!(bench.json("query", &["--at", "surveyed"])["version"], 1);
    assert_eq!(bench.run("diff", &["surveyed..newest"]).ok().out, bench.run("diff", &["1..2"]).ok().out);
    bench.run("tag", &["surveyed", "2"]).refused(10, &["tag \"surveyed\" names version 1 already", "--delete"]);
    bench.run("tag", &["head"]).refused(2, &["cannot be a tag"]);
    bench.run("tag", &["a..b"]).refused(2, &["cannot be a tag"]);
    bench.run("tag", &["later", "9"]).refused(11, &["no version 9"]);
    bench.run("tag", &["--delete"]).refused(2, &["NAME"]);
    bench.run("tag", &["none", "--delete"]).refused(11, &["no tag \"none\""]);
    assert_eq!(bench.run("tag", &["surveyed", "--delete"]).ok().out, "surveyed no longer names version 1\n");
    bench.run("query", &["--at", "surveyed"]).refused(11, &["surveyed"]);
    assert_eq!((bench.head(), bench.state("1").len()), (2, 2));
}
