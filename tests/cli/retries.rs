//! `--idempotency-key`: the same request again is told what it was told the first time, another one is refused.

use crate::bench::{Bench, edited, street, text};
use crate::change_sets::{chair, set};
use crate::differences::{chair_at, changed};
use serde_json::{Value, json};

/// The document of a retry without the key that says so.
fn again(bench: &Bench, command: &str, words: &[&str]) -> Value {
    let mut document = bench.json(command, words);
    assert_eq!(document["repeated"], true, "{command} {words:?}: {document}");
    document.as_object_mut().unwrap().remove("repeated");
    document
}

fn capture() -> String {
    text(&street().path("capture/capture.json")).to_owned()
}

#[test]
fn another_change_set_under_the_same_key_is_refused_and_neither_lost_nor_taken_for_done() {
    let bench = Bench::with_empty_map();
    let first = bench.file("first.jsonl", set(None, &[json!({"op": "add", "after": chair()})]));
    let other = bench.file("other.jsonl", set(None, &[json!({"op": "add", "after": chair_at(9.0)})]));
    let done = bench.json("apply", &[&first, "--idempotency-key", "k"]);
    assert_eq!(again(&bench, "apply", &[&first, "--idempotency-key", "k"]), done);
    let both = ["key \"k\" made version 1 for the apply", "comes with the apply", "another key"];
    bench.run("apply", &[&other, "--idempotency-key", "k"]).refused(21, &both);
    bench.run("revert", &["1", "--idempotency-key", "k"]).refused(21, &["for the apply", "comes with the revert"]);
    let told = bench.run("apply", &[&other, "--idempotency-key", "k", "--json"]).json();
    let made = json!({"version": 1});
    assert_eq!(told, json!({"decision": "conflict", "version": null, "idempotency_key": "k", "made": made}));
    assert_eq!(bench.json("apply", &[&other, "--idempotency-key", "l"])["version"], 2);
    assert_eq!(bench.head(), 2);
}

#[test]
fn an_undo_of_head_that_is_sent_again_is_the_undo_of_the_first_time() {
    let bench = changed();
    let words = ["head", "--idempotency-key", "R"];
    let done = bench.json("revert", &words);
    assert_eq!((&done["reverts"], &done["version"]), (&json!(2), &json!(3)));
    assert_eq!(again(&bench, "revert", &words), done);
    bench.apply(&[json!({"op": "add", "after": chair_at(30.0)})]);
    assert_eq!(again(&bench, "revert", &words), done);
    assert_eq!(bench.run("revert", &words).ok().out, "version 3 undoes version 2: 1 added, 1 modified, 1 removed\n");
    bench.run("gc", &["--forget-before", "head"]).ok();
    assert_eq!(again(&bench, "revert", &words), done);
    for other in [&["2"][..], &["head", "--bbox", "0,0,1,1"]] {
        let words = [other, &["--idempotency-key", "R"]].concat();
        bench.run("revert", &words).refused(21, &["key \"R\" made version 3"]);
    }
    assert_eq!(bench.head(), 4);
}

#[test]
fn an_import_under_a_key_is_of_these_files_read_in_this_way() {
    let bench = Bench::with_empty_map();
    let (model, glb, origin) = (street().model("3ds"), street().model("glb"), street().origin());
    let words = [text(&model), "--origin", &origin, "--idempotency-key", "May"];
    let done = bench.json("import", &words);
    assert_eq!(again(&bench, "import", &words), done);
    bench.json("revert", &["1"]);
    bench.run("gc", &["--forget-before", "head"]).ok();
    assert_eq!(again(&bench, "import", &words), done);
    for other in [
        [text(&glb), "--origin", &origin, "--idempotency-key", "May"],
        [text(&model), "--origin", "835600,817800,5", "--idempotency-key", "May"],
    ] {
        bench.run("import", &other).refused(21, &["key \"May\" made version 1 for the import"]);
    }
    // Who asks and why is no part of what is asked for.
    assert_eq!(again(&bench, "import", &[&words[..], &["--message", "once more"]].concat()), done);
    assert_eq!(bench.head(), 2);
}

#[test]
fn another_photo_under_the_same_key_is_refused() {
    let bench = Bench::with_street();
    let pose = street().path("pose.json");
    let send = |capture: &str| bench.run("update", &[capture, "--pose", text(&pose), "--idempotency-key", "photo 12"]);
    send(&capture()).ok();
    let labels = std::fs::read(street().path("capture/labels.png")).unwrap();
    bench.file("labels.png", labels);
    let file: Value = serde_json::from_slice(&std::fs::read(capture()).unwrap()).unwrap();
    let other = bench.file("capture.json", edited(&file, |file| file["taken_at"] = json!("2026-06-02T10:00:00+08:00")));
    send(&other).refused(21, &["key \"photo 12\" made version 2 for the update"]);
    send(&capture()).ok();
    assert_eq!(bench.head(), 2);
}

#[test]
fn all_that_a_build_did_is_told_again_undo_by_undo() {
    let (bench, _) = Bench::with_banner();
    bench.json("revert", &["2"]);
    bench.json("update", &[&capture(), "--pose", text(&street().path("pose.json"))]);
    let words = ["--by-plugin", "class-difference", "--idempotency-key", "all of it"];
    let done = bench.json("revert", &words);
    assert_eq!(done["versions_by_plugin"], json!([4, 2]));
    assert_eq!(done["reverted"].as_array().map(Vec::len), Some(1));
    assert_eq!(again(&bench, "revert", &words), done);
    // The build goes on, and the retry is still of what it had done by then.
    bench.json("update", &[&capture(), "--pose", text(&street().path("pose.json"))]);
    assert_eq!(again(&bench, "revert", &words), done);
    assert_eq!(bench.head(), 6);
}
