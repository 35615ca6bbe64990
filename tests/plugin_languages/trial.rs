//! An empty folder, a data directory of its own, and the built binary as `resurvey`, as a new user has them.

use crate::synthetic::{ChangeKind, Changes, NoiseLevel, SceneKind, Suite, write_suite};
use serde_json::Value;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use tempfile::TempDir;

/// The repository.
pub const ROOT: &str = env!("CARGO_MANIFEST_DIR");
/// How the README invents a street; [`street`] does the same.
pub const GENERATE: &str = "cargo run --release --example generate_cases -- --change banner --noise light --count 1 --out ~/plugin-trial\n\
                            cd ~/plugin-trial\n";

/// Whether all tools are here; says which is not.
pub fn has(tools: &[&str]) -> bool {
    let runs = |program: &str, arguments: &[&str]| {
        Command::new(program).args(arguments).output().is_ok_and(|output| output.status.success())
    };
    let is_here = |tool: &&&str| match **tool {
        "numpy" => runs("python3", &["-c", "import numpy"]),
        tool => runs(tool, &["--version"]),
    };
    let missing: Vec<_> = tools.iter().filter(|tool| !is_here(tool)).collect();
    if !missing.is_empty() {
        let _ = writeln!(std::io::stderr(), "SKIPPED: no {missing:?}; plugins in its language were not tested");
    }
    missing.is_empty()
}

/// The code block `index` of the section `heading` of `plugins/README.md`.
pub fn readme_block(heading: &str, index: usize) -> String {
    let readme = std::fs::read_to_string(format!("{ROOT}/plugins/README.md")).unwrap();
    let section = readme.split("\n## ").find(|section| section.starts_with(&format!("{heading}\n"))).unwrap();
    section.split("```sh\n").nth(index + 1).unwrap().split("```").next().unwrap().to_owned()
}

/// How the first comment of a C or C++ example says that it is built.
pub fn build_line(source: &str) -> String {
    let text = std::fs::read_to_string(Path::new(ROOT).join(source)).unwrap();
    text.lines().find_map(|line| line.split_once("Build: ")).expect("a build line").1.to_owned()
}

/// The folder `plugin-trial` of the README.
fn street() -> &'static TempDir {
    static STREET: OnceLock<TempDir> = OnceLock::new();
    STREET.get_or_init(|| {
        let directory = tempfile::tempdir().unwrap();
        let suite = Suite {
            scene: SceneKind::Street,
            seed: 1,
            capture_seed: 1,
            count: 1,
            noise: NoiseLevel::LIGHT,
            changes: Changes::Only(ChangeKind::Banner),
        };
        write_suite(&suite, directory.path()).unwrap();
        directory
    })
}

/// A folder in which something is tried.
pub struct Trial {
    directory: TempDir,
    python_path: Option<String>,
}

impl Trial {
    /// An empty folder.
    pub fn bare() -> Self {
        Self { directory: tempfile::tempdir().unwrap(), python_path: None }
    }

    /// The folder of the README, with map and capture.
    pub fn new() -> Self {
        let trial = Self::bare();
        trial.shell(&format!("cp -r '{}'/. .", street().path().display()));
        let lines = readme_block("Before you begin", 1);
        trial.shell(lines.strip_prefix(GENERATE).expect("the README invents the street as this file does"));
        trial
    }

    /// Python finds the package of the repository, as if it were installed.
    pub fn with_python_package(self) -> Self {
        Self { python_path: Some(format!("{ROOT}/plugins/python")), ..self }
    }

    /// A path in the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join("work").join(name)
    }

    /// Runs lines of a shell.
    fn run(&self, script: &str) -> Output {
        let binary = Path::new(env!("CARGO_BIN_EXE_resurvey")).parent().unwrap();
        let search = format!("{}:{}", binary.display(), std::env::var("PATH").unwrap());
        std::fs::create_dir_all(self.path("")).unwrap();
        let mut shell = Command::new("bash");
        shell.args(["-euc", script]).current_dir(self.path("")).env("PATH", search);
        shell.env("XDG_DATA_HOME", self.directory.path().join("data")).env("PYTHONDONTWRITEBYTECODE", "1");
        // What Cargo needs is here, and is built once for all projects.
        shell.env("CARGO_NET_OFFLINE", "true").env_remove("CARGO_TARGET_DIR");
        shell.env("CARGO_BUILD_BUILD_DIR", concat!(env!("CARGO_TARGET_TMPDIR"), "/plugin-projects"));
        match &self.python_path {
            Some(path) => shell.env("PYTHONPATH", path),
            None => shell.env_remove("PYTHONPATH"),
        };
        shell.output().expect("bash starts")
    }

    /// Runs lines of a shell, each of which must succeed.
    pub fn shell(&self, script: &str) -> String {
        let output = self.run(script);
        let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{script}\n{out}\n{err}");
        out.into_owned()
    }

    /// Exit code and messages of a line.
    pub fn code(&self, line: &str) -> (i32, String) {
        let output = self.run(line);
        (output.status.code().unwrap_or(-1), String::from_utf8_lossy(&output.stderr).into_owned())
    }

    /// Types what a block of the section of the README says, and looks at the pose that its last line gives.
    pub fn follow(&self, heading: &str, block: usize, name: &str) {
        self.shell(&readme_block(heading, block));
        self.finds_the_pose(&["--matcher", name]);
    }

    /// Checks and installs a plugin.
    pub fn installs(&self, file: &Path) {
        self.shell(&format!("resurvey plugins install '{}'", file.display()));
    }

    /// Builds a C or C++ example by the line in its first comment.
    pub fn built_by_its_first_comment(&self, source: &str, library: &str) -> PathBuf {
        let line = build_line(source);
        let built = self.path(library);
        assert!(line.ends_with(&format!(" -o {library}")), "{line}");
        let elsewhere = line.replace(&format!(" -o {library}"), &format!(" -Werror -o '{}'", built.display()));
        self.shell(&format!("cd '{ROOT}'\n{elsewhere}"));
        built
    }

    /// Asserts that `localize` with `options` finds the true pose of the capture.
    pub fn finds_the_pose(&self, options: &[&str]) {
        let options = options.join(" ");
        let json = self.json(&format!("resurvey localize city.rsv capture.json {options} --json"));
        let truth = &self.truth()["pose"];
        let off = |key: &str| json["pose"][key].as_f64().unwrap() - truth[key].as_f64().unwrap();
        let (metres, degrees) = (off("easting").hypot(off("northing")), off("yaw_deg").abs());
        assert!(metres < 1.0 && degrees < 1.5, "{options}: {metres:.2} m and {degrees:.2}° off: {json}");
    }

    /// Asserts that an update with the plugin `name` adds the banner that the capture shows.
    pub fn finds_the_banner(&self, options: &[&str], name: &str) {
        let json = self.json(&format!("resurvey update city.rsv capture.json --dry-run --json {}", options.join(" ")));
        let changes = json["changes"].as_array().unwrap();
        let banners: Vec<_> = changes.iter().filter(|change| change["class"] == "banner").collect();
        let truth = &self.truth()["changes"][0];
        let [banner] = banners[..] else { panic!("{name} finds {} banners: {json}", banners.len()) };
        let centre = |index: usize| {
            let corners = truth["corners"].as_array().unwrap();
            corners.iter().map(|corner| corner[index].as_f64().unwrap()).sum::<f64>() / corners.len() as f64
        };
        let off = |index: usize| banner["after"]["centre"][index].as_f64().unwrap() - centre(index);
        let metres = off(0).hypot(off(1)).hypot(off(2));
        assert!(metres < 0.6, "{name} puts the banner {metres:.2} m off: {json}");
        assert!(json.to_string().contains(&format!("\"{name}\"")), "{name} is named as what did it: {json}");
    }

    /// The files of a folder, those that are text.
    pub fn texts_in(&self, name: &str) -> Vec<String> {
        let mut texts = Vec::new();
        for entry in std::fs::read_dir(self.path(name)).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_file() {
                texts.push(std::fs::read_to_string(entry).unwrap());
            }
        }
        texts
    }

    fn json(&self, line: &str) -> Value {
        serde_json::from_str(&self.shell(line)).unwrap()
    }

    fn truth(&self) -> Value {
        serde_json::from_slice(&std::fs::read(self.path("truth.json")).unwrap()).unwrap()
    }
}
