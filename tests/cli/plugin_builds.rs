//! Several builds of one plugin: the newest runs, and what an older one did is replayed with that one.
#![cfg(target_os = "linux")]

use crate::bench::{Bench, street, text};
use crate::plugin_files::plugin;
use serde_json::{Value, json};
use std::process::Command;

/// A bench whose version 2 a build of `faulty_estimator.c` has found, and its digest.
struct Recorded {
    bench: Bench,
    first: String,
}

impl Recorded {
    fn new(flags: &[&str], settings: &[&str]) -> Option<Self> {
        let bench = Bench::with_street();
        let first = plugin(&bench, "faulty_estimator.c", "one", &[flags, &["-lm"]].concat())?;
        let recorded = Self { bench, first };
        recorded.install("one");
        let (map, pose) = (recorded.bench.path("map.rsv"), street().path("pose.json"));
        let capture = street().path("capture/capture.json");
        let words = ["update", text(&map), text(&capture), "--pose", text(&pose), "--estimator", "faulty-estimator"];
        let document = recorded.json(&[&words[..], &["--keep-labels"], settings].concat());
        assert_eq!(document["version"], 2, "{document:#}");
        Some(recorded)
    }

    fn run(&self, words: &[&str]) -> (i32, String, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_resurvey"))
            .args(words)
            .env("XDG_DATA_HOME", self.bench.path("data"))
            .env_remove("RESURVEY_PLUGIN_PATH")
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
    }

    fn json(&self, words: &[&str]) -> Value {
        let (code, out, err) = self.run(&[words, &["--json"]].concat());
        assert_eq!(code, 0, "{out}{err}");
        serde_json::from_str(&out).unwrap()
    }

    fn install(&self, name: &str) {
        let file = self.bench.path(&format!("plugins/lib{name}.so"));
        self.json(&["plugins", "install", "--no-check", text(&file)]);
    }

    fn replay(&self, more: &[&str]) -> Value {
        self.json(&[&["replay", text(&self.bench.path("map.rsv")), "2"], more].concat())
    }

    /// Asserts that a replay ends with this code and these words.
    fn refuses(&self, more: &[&str], code: i32, words: &[&str]) {
        let map = self.bench.path("map.rsv");
        let (found, out, err) = self.run(&[&["replay", text(&map), "2"], more].concat());
        assert_eq!(found, code, "{out}{err}");
        for word in words {
            assert!(err.contains(word), "expected {word:?} in {err:?}");
        }
    }
}

/// What a document of `replay` says of the estimator.
fn estimator(replay: &Value) -> &Value {
    replay["plugins"].as_array().unwrap().iter().find(|build| build["kind"] == "estimator").unwrap()
}

#[test]
fn what_an_older_build_found_is_replayed_with_that_build() {
    let Some(recorded) = Recorded::new(&["-O1"], &[]) else { return };
    let Some(second) = plugin(&recorded.bench, "faulty_estimator.c", "two", &["-O2", "-lm"]) else { return };
    recorded.install("two");
    let listed = recorded.json(&["plugins", "list"]);
    let runs = listed["plugins"].as_array().unwrap().iter().find(|one| one["name"] == "faulty-estimator").unwrap();
    assert_eq!(runs["sha256"], json!(second));
    assert_eq!((&listed["older"][0]["name"], &listed["older"][0]["sha256"]), (&runs["name"], &json!(recorded.first)));
    let replay = recorded.replay(&[]);
    assert_eq!((&replay["same"], &estimator(&replay)["found_sha256"]), (&json!(true), &json!(recorded.first)));
    assert_eq!(replay["changes"]["rejections"]["same"], true);

    recorded.json(&["plugins", "remove", &recorded.first]);
    recorded.refuses(&[], 12, &[&recorded.first, "install that build", "--any-build"]);
    let replay = recorded.replay(&["--any-build"]);
    assert_eq!((&replay["same"], &estimator(&replay)["same"]), (&json!(true), &json!(false)));
    recorded.json(&["plugins", "remove", "faulty-estimator"]);
    for any in [&[][..], &["--any-build"]] {
        recorded.refuses(any, 11, &["estimator faulty-estimator", &recorded.first, "no plugin of that name"]);
    }
    // The newest is the one that is installed last, also when it was there before.
    recorded.install("two");
    recorded.install("one");
    recorded.install("two");
    assert_eq!(recorded.json(&["plugins", "info", "faulty-estimator"])["sha256"], json!(second));
}

#[test]
fn a_model_file_may_lie_elsewhere_and_must_be_the_same() {
    let model = Bench::with_empty_map();
    let file = model.file("city.onnx", "weights");
    let setting = format!("faulty-estimator.model={file}");
    let Some(recorded) = Recorded::new(&["-DMODEL"], &["--set", &setting]) else { return };
    assert_eq!(recorded.replay(&[])["same"], true);
    let moved = model.file("moved.onnx", "weights");
    std::fs::remove_file(&file).unwrap();
    recorded.refuses(&[], 10, &["faulty-estimator.model", "city.onnx", "--file PLUGIN.KEY=PATH"]);
    let replay = recorded.replay(&["--file", &format!("faulty-estimator.model={moved}")]);
    assert_eq!((&replay["same"], &estimator(&replay)["same"]), (&json!(true), &json!(true)));
    let other = format!("faulty-estimator.model={}", model.file("other.onnx", "other weights"));
    recorded.refuses(&["--file", &other], 12, &["with other files", "--file PLUGIN.KEY=PATH"]);
    recorded.refuses(&["--file", "semantic.best=3"], 2, &["--file semantic.best=3", "named a file"]);
}

#[test]
fn other_code_in_the_program_is_another_digest_of_its_plugins() {
    let bench = Bench::with_empty_map();
    let digest_in = |program: &str| {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let host = resurvey::Host { program: Some(bench.path(program)), ..resurvey::Host::default() };
        assert_eq!(resurvey::run_as(host, ["resurvey", "plugins", "list", "--json"], &mut out, &mut err), 0);
        let listed: Value = serde_json::from_slice(&out).unwrap();
        let all = listed["plugins"].as_array().unwrap();
        all.iter().find(|plugin| plugin["name"] == "skyline").unwrap()["sha256"].clone()
    };
    bench.file("one", "code");
    bench.file("same", "code");
    bench.file("other", "other code");
    assert_eq!(digest_in("one"), digest_in("same"));
    assert_ne!(digest_in("one"), digest_in("other"));
}
