//! Drives the command line from an example, through the same entry point as the binary, and prints what a user would
//! type.
#![allow(dead_code, reason = "each example uses a part of this module")]

use crate::synthetic::{Case, Scene, Truth, write_case, write_map};
use anyhow::{Context, ensure};
use serde_json::Value;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

/// A directory with one map in it.
pub struct Session {
    directory: PathBuf,
}

/// What a command answered.
pub struct Answer {
    /// Exit code.
    pub code: u8,
    /// Standard output.
    pub text: String,
}

impl Session {
    /// An empty directory for the example called `name`, under `target/examples-out` or where the first argument says.
    pub fn start(name: &str) -> anyhow::Result<Self> {
        let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/examples-out").join(name);
        let directory = std::env::args_os().nth(1).map_or(default, PathBuf::from);
        if directory.join("map.rsv").exists() {
            fs::remove_dir_all(&directory).with_context(|| format!("emptying {}", directory.display()))?;
        }
        fs::create_dir_all(&directory).with_context(|| format!("making {}", directory.display()))?;
        println!("everything is written to {}\n", shown(&directory));
        Ok(Self { directory })
    }

    /// A path in the directory.
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.join(name)
    }

    /// Makes `map.rsv` of a scene: version 1 holds its model.
    pub fn import(&self, scene: &Scene) -> anyhow::Result<()> {
        let folder = write_map(scene, &self.directory)?;
        let model = folder.join(format!("{}.3ds", scene.name()));
        let origin = scene.origin.map(|number| number.to_string()).join(",");
        self.json("init", &[])?;
        self.json("import", &[&text(&model)?, "--origin", &origin])?;
        Ok(())
    }

    /// Writes a capture; the map learns what it knew before. Returns the path of `capture.json`.
    pub fn receive(&self, case: &Case) -> anyhow::Result<String> {
        let folder = write_case(case, &self.directory)?;
        if !case.base_changes.is_empty() {
            self.json("apply", &[&text(&folder.join("base.changes.jsonl"))?])?;
        }
        text(&folder.join("capture.json"))
    }

    /// Runs `resurvey COMMAND map.rsv …`, whatever it answers.
    pub fn run(&self, command: &str, arguments: &[&str]) -> anyhow::Result<Answer> {
        let map = text(&self.path("map.rsv"))?;
        let words: Vec<&str> = ["resurvey", command, &map].into_iter().chain(arguments.iter().copied()).collect();
        let typed: Vec<String> = words.iter().map(|word| shown(Path::new(word))).collect();
        println!("$ {}", typed.join(" "));
        let (mut out, mut messages) = (Vec::new(), Vec::new());
        let code = resurvey::run(words.iter().map(OsString::from), &mut out, &mut messages);
        for line in String::from_utf8_lossy(&messages).lines() {
            println!("  {line}");
        }
        Ok(Answer { code, text: String::from_utf8(out).context("output is UTF-8")? })
    }

    /// Runs a command with `--json` that must come to a result: exit code 0, or 22 for a pose that is not reliable.
    pub fn json(&self, command: &str, arguments: &[&str]) -> anyhow::Result<Value> {
        let arguments: Vec<&str> = arguments.iter().copied().chain(["--json"]).collect();
        let answer = self.run(command, &arguments)?;
        ensure!(
            matches!(answer.code, 0 | 22),
            "resurvey {command} ended with exit code {}: {}",
            answer.code,
            answer.text
        );
        serde_json::from_str(&answer.text).with_context(|| format!("reading the answer of resurvey {command}"))
    }

    /// Runs a command that must succeed, and prints its answer.
    pub fn show(&self, command: &str, arguments: &[&str]) -> anyhow::Result<()> {
        let answer = self.run(command, arguments)?;
        ensure!(answer.code == 0, "resurvey {command} ended with exit code {}: {}", answer.code, answer.text);
        for line in answer.text.lines() {
            println!("  {line}");
        }
        Ok(())
    }
}

/// A path as text.
pub fn text(path: &Path) -> anyhow::Result<String> {
    path.to_str().map(str::to_owned).with_context(|| format!("{} is not Unicode", path.display()))
}

/// A path from the current directory where that is shorter.
fn shown(path: &Path) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    path.strip_prefix(&here).unwrap_or(path).display().to_string()
}

/// Distance in plan, metres, and difference in heading, degrees, of the pose of a `localize` answer from the truth.
pub fn pose_error(localization: &Value, truth: &Truth) -> anyhow::Result<(f64, f64)> {
    let pose = &localization["pose"];
    let number = |key: &str| pose[key].as_f64().with_context(|| format!("pose has no {key}: {localization}"));
    let (e, n) = (number("easting")? - truth.position[0], number("northing")? - truth.position[1]);
    let turn = number("yaw_deg")? - truth.attitude_deg[0];
    Ok((e.hypot(n), (turn + 180.0).rem_euclid(360.0) - 180.0))
}

/// Area of a quadrilateral, m².
pub fn area_m2(corners: [[f64; 3]; 4]) -> f64 {
    let [a, b, c, d] = corners;
    let triangle = |p: [f64; 3], q: [f64; 3], r: [f64; 3]| {
        let (u, v) = ([0, 1, 2].map(|i| q[i] - p[i]), [0, 1, 2].map(|i| r[i] - p[i]));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        cross.iter().map(|part| part * part).sum::<f64>().sqrt() / 2.0
    };
    triangle(a, b, c) + triangle(a, c, d)
}
