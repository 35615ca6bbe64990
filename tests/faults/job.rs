//! The commands that write, each with a map to write to, and what the map is before and after.

use crate::common::{Place, path};
use crate::observed::{Observed, run};
use crate::synthetic::{ChangeKind, NoiseLevel, Scene, SceneKind};
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A command line that writes to a map.
pub struct Job {
    /// `apply`, for example.
    pub command: &'static str,
    /// What follows the map.
    pub arguments: Vec<String>,
    /// The map to copy.
    pub template: PathBuf,
    /// What the map is before.
    pub before: Observed,
    /// What it is when all went well.
    pub after: Observed,
}

impl Job {
    fn new(command: &'static str, arguments: &[&str], template: PathBuf) -> Self {
        let arguments: Vec<String> = arguments.iter().map(|&argument| argument.to_owned()).collect();
        let before = Observed::of(&template);
        let directory = tempfile::tempdir().unwrap();
        let map = copy(&template, directory.path());
        let status = Command::new(env!("CARGO_BIN_EXE_resurvey")).arg(command).arg(&map).args(&arguments).output();
        assert_eq!(status.unwrap().status.code(), Some(0), "{command}");
        let after = Observed::of(&map);
        assert_ne!(before, after, "{command} changes the map");
        Self { command, arguments, template, before, after }
    }
}

/// A copy of a map called `map.rsv`.
pub fn copy(map: &Path, directory: &Path) -> PathBuf {
    let to = directory.join("map.rsv");
    fs::copy(map, &to).unwrap();
    to
}

/// What all tests share and none changes.
pub struct Jobs {
    /// `import`, `update`, `apply`, `revert`, `gc`, and `apply` to a map of format 2.
    pub all: Vec<Job>,
    /// A map with everything that a map can have.
    pub eventful: PathBuf,
    /// The same after all was forgotten but what has a tag, and the newest.
    pub forgetful: PathBuf,
    /// A change set that every map takes.
    pub chair: PathBuf,
    _place: Place,
}

/// The commands on maps of an invented hall.
pub fn jobs() -> &'static Jobs {
    static JOBS: OnceLock<Jobs> = OnceLock::new();
    JOBS.get_or_init(|| {
        let place = Place::new(Scene::new(SceneKind::Hall, 3), "3ds");
        let (case, capture) = place.capture(ChangeKind::ChairRemoved, NoiseLevel::LIGHT, 3);
        let (empty, chair, pose) = (place.path("empty.rsv"), place.path("chair.jsonl"), place.path("pose.json"));
        let model = place.path("maps").join(place.scene.name()).join(format!("{}.3ds", place.scene.name()));
        let origin = place.scene.origin.map(|number| number.to_string()).join(",");
        assert_eq!(crate::common::resurvey(&["init", path(&empty)]).code, 0);
        let header = json!({"format": "resurvey.changes/1", "base_version": null});
        let state = json!({"class": "chair", "position": place.scene.origin});
        fs::write(&chair, format!("{header}\n{}\n", json!({"op": "add", "after": state}))).unwrap();
        fs::write(&pose, json!({ "pose": case.truth.json["pose"] }).to_string()).unwrap();
        // Its later steps write to the map of the place, so each job gets a copy of what it is by then.
        let now = |name: &str| {
            let to = place.path(name);
            fs::copy(place.path("map.rsv"), &to).unwrap();
            to
        };
        let ok = |command: &str, arguments: &[&str]| {
            let answer = place.run(command, arguments);
            assert_eq!(answer.code, 0, "{command}: {}", answer.messages);
        };
        let [capture, chair_set, pose] = [&capture, &chair, &pose].map(|file| path(file));
        let mut all = vec![Job::new("import", &[path(&model), "--origin", &origin], empty)];
        all.push(Job::new("update", &[capture, "--pose", pose], now("to-update.rsv")));
        all.push(Job::new("apply", &[chair_set], now("to-apply.rsv")));
        ok("update", &[capture, "--pose", pose, "--keep-labels"]);
        all.push(Job::new("revert", &["head"], now("to-revert.rsv")));
        ok("tag", &["surveyed", "head"]);
        ok("revert", &["head"]);
        ok("apply", &[chair_set]);
        ok("update", &[capture, "--pose", pose, "--propose"]);
        let eventful = now("eventful.rsv");
        all.push(Job::new("gc", &["--forget-before", "head"], eventful.clone()));
        let forgetful = now("forgetful.rsv");
        assert_eq!(run("gc", &forgetful, &["--forget-before", "head"]).code, 0);
        // The first command that writes to a map of an older format migrates it with what it writes.
        let older = place.path("format-2.rsv");
        fs::copy(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/map-format-2.rsv"), &older).unwrap();
        all.push(Job::new("apply", &[chair_set], older));
        Jobs { all, eventful, forgetful, chair, _place: place }
    })
}

/// Up to `count` of 1 to `last`: the first ones, the last ones, and some evenly between.
pub fn sample(last: usize, count: usize) -> Vec<usize> {
    let ends = count / 4;
    let between = (0..count - 2 * ends).map(|step| 1 + step * last / (count - 2 * ends));
    let mut chosen: Vec<usize> = (1..=ends).chain(between).chain(last.saturating_sub(ends) + 1..=last).collect();
    chosen.retain(|place| (1..=last).contains(place));
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}
