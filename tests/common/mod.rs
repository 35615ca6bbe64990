//! Runs the built binary on invented places.
#![allow(dead_code, reason = "each test binary uses a part of this module")]

use crate::synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, write_case, write_map};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// What a run of the binary gave.
#[derive(Debug)]
pub struct Answer {
    /// Exit code.
    pub code: i32,
    /// Standard output as JSON; null when it is none.
    pub json: Value,
    /// Standard error.
    pub messages: String,
}

/// Runs `resurvey ARGUMENTS --json`.
pub fn resurvey<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Answer {
    let output =
        Command::new(env!("CARGO_BIN_EXE_resurvey")).args(arguments).arg("--json").output().expect("the binary starts");
    Answer {
        code: output.status.code().unwrap_or(-1),
        json: serde_json::from_slice(&output.stdout).unwrap_or(Value::Null),
        messages: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

/// A directory with the map of a scene, imported as version 1.
pub struct Place {
    /// The scene.
    pub scene: Scene,
    directory: TempDir,
}

impl Place {
    /// The map of `scene`, imported from its file with this suffix.
    pub fn new(scene: Scene, suffix: &str) -> Self {
        let directory = tempfile::tempdir().expect("a temporary directory");
        let place = Self { scene, directory };
        let folder = write_map(&place.scene, place.directory.path()).expect("the map is written");
        let model = folder.join(format!("{}.{suffix}", place.scene.name()));
        let origin = place.scene.origin.map(|number| number.to_string()).join(",");
        assert_eq!(place.run("init", &[]).code, 0);
        let imported = place.run("import", &[path(&model), "--origin", &origin]);
        assert_eq!(imported.code, 0, "{}", imported.messages);
        place
    }

    /// A path in the directory.
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// Runs `resurvey COMMAND map.rsv ARGUMENTS --json`.
    pub fn run(&self, command: &str, arguments: &[&str]) -> Answer {
        let map = self.path("map.rsv");
        let words: Vec<&str> = [command, path(&map)].into_iter().chain(arguments.iter().copied()).collect();
        resurvey(&words)
    }

    /// A capture of the place; the map learns what it knew before. Returns it and the path of `capture.json`.
    pub fn capture(&self, change: ChangeKind, noise: NoiseLevel, seed: u64) -> (Case, PathBuf) {
        self.written(Case::new(&self.scene, spec(change, noise, seed)).expect("a pose shows the change"))
    }

    /// The same, and the path of a second photo's `capture.json` where one can be taken.
    pub fn two_photos(&self, change: ChangeKind, noise: NoiseLevel, seed: u64) -> (Case, [PathBuf; 2]) {
        let case = Case::with_second(&self.scene, spec(change, noise, seed)).expect("a pose shows the change");
        assert!(case.second.is_some(), "a second pose shows the change");
        let (case, first) = self.written(case);
        let second = first.with_file_name("second").join("capture.json");
        (case, [first, second])
    }

    fn written(&self, case: Case) -> (Case, PathBuf) {
        let folder = write_case(&case, self.directory.path()).expect("the capture is written");
        if !case.base_changes.is_empty() {
            let applied = self.run("apply", &[path(&folder.join("base.changes.jsonl"))]);
            assert_eq!(applied.code, 0, "{}", applied.messages);
        }
        (case, folder.join("capture.json"))
    }
}

fn spec(change: ChangeKind, noise: NoiseLevel, seed: u64) -> CaseSpec {
    let name = format!("capture-{}-{seed}", change.name());
    CaseSpec { name, change, noise, seed, grid_prior: false }
}

/// A path as text.
pub fn path(path: &Path) -> &str {
    path.to_str().expect("temporary paths are Unicode")
}
