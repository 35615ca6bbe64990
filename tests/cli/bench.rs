//! A street that is generated and imported once, and a copy of its map for every test.

use crate::synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, SceneKind, write_case, write_map};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// What a command line gave.
#[derive(Debug)]
pub struct Run {
    /// Exit code.
    pub code: u8,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl Run {
    /// Standard output as exactly one JSON document.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {:?}, {}", self.out, self.err))
    }

    /// Asserts that all went well.
    pub fn ok(self) -> Self {
        assert_eq!(self.code, 0, "{}{}", self.out, self.err);
        self
    }

    /// Asserts an exit code and words on standard error, and that nothing was printed as a result.
    pub fn refused(&self, code: u8, words: &[&str]) {
        assert_eq!(self.code, code, "{}{}", self.out, self.err);
        for word in words {
            assert!(self.err.contains(word), "expected {word:?} in {:?}", self.err);
        }
        assert!(self.out.is_empty(), "{}", self.out);
        assert!(!self.err.contains("this is a bug"), "{}", self.err);
    }
}

/// Runs `resurvey ARGUMENTS`.
pub fn resurvey<S: AsRef<str>>(arguments: &[S]) -> Run {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let words = std::iter::once("resurvey").chain(arguments.iter().map(AsRef::as_ref));
    let host = resurvey::Host { program: Some(env!("CARGO_BIN_EXE_resurvey").into()), ..Default::default() };
    let code = resurvey::run_as(host, words, &mut out, &mut err);
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Run { code, out: text(out), err: text(err) }
}

/// A path as text.
pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// What all tests share and none changes.
pub struct Street {
    /// The scene.
    pub scene: Scene,
    /// The capture with a new banner.
    pub case: Case,
    directory: PathBuf,
}

impl Street {
    /// A file of the street.
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.join(name)
    }

    /// The model in this format.
    pub fn model(&self, suffix: &str) -> PathBuf {
        self.path(&format!("maps/street/street.{suffix}"))
    }

    /// `--origin` of the model.
    pub fn origin(&self) -> String {
        self.scene.origin.map(|number| number.to_string()).join(",")
    }
}

/// The street: `plain.rsv` with the model as version 1, a capture with a new banner in `capture/`, and its true pose.
pub fn street() -> &'static Street {
    static STREET: OnceLock<Street> = OnceLock::new();
    STREET.get_or_init(|| {
        let directory = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cli");
        let _ = std::fs::remove_dir_all(&directory);
        std::fs::create_dir_all(&directory).unwrap();
        let scene = Scene::new(SceneKind::Street, 7);
        write_map(&scene, &directory).unwrap();
        let (name, change, noise) = ("capture".to_owned(), ChangeKind::Banner, NoiseLevel::LIGHT);
        let case = Case::new(&scene, CaseSpec { name, change, noise, seed: 7, grid_prior: false }).unwrap();
        write_case(&case, &directory).unwrap();
        let pose = json!({ "pose": case.truth.json["pose"] });
        std::fs::write(directory.join("pose.json"), pose.to_string()).unwrap();
        let street = Street { scene, case, directory };
        let (map, model) = (street.path("plain.rsv"), street.model("3ds"));
        resurvey(&["init", text(&map)]).ok();
        resurvey(&["import", text(&map), text(&model), "--origin", &street.origin()]).ok();
        street
    })
}

/// The street's map after the banner was placed at the true pose as version 2, and the document of that update.
fn updated() -> &'static (PathBuf, Value) {
    static UPDATED: OnceLock<(PathBuf, Value)> = OnceLock::new();
    UPDATED.get_or_init(|| {
        let map = street().path("updated.rsv");
        std::fs::copy(street().path("plain.rsv"), &map).unwrap();
        let (capture, pose) = (street().path("capture/capture.json"), street().path("pose.json"));
        let run = resurvey(&["update", text(&map), text(&capture), "--pose", text(&pose), "--json"]).ok();
        (map, run.json())
    })
}

/// A directory of one test with `map.rsv` in it.
pub struct Bench {
    directory: TempDir,
    before: Vec<u8>,
}

impl Bench {
    /// With the street as version 1.
    pub fn with_street() -> Self {
        Self::with_map(&street().path("plain.rsv"))
    }

    /// With the street as version 1, a banner as version 2, and what `update --json` printed for it.
    pub fn with_banner() -> (Self, Value) {
        let (map, document) = updated();
        (Self::with_map(map), document.clone())
    }

    /// With an empty map.
    pub fn with_empty_map() -> Self {
        let directory = tempfile::tempdir().unwrap();
        resurvey(&["init", text(&directory.path().join("map.rsv"))]).ok();
        let before = std::fs::read(directory.path().join("map.rsv")).unwrap();
        Self { directory, before }
    }

    fn with_map(map: &Path) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let before = std::fs::read(map).unwrap();
        std::fs::write(directory.path().join("map.rsv"), &before).unwrap();
        Self { directory, before }
    }

    /// A file of this test.
    pub fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// The path of a file of this test with these contents.
    pub fn file(&self, name: &str, contents: impl AsRef<[u8]>) -> String {
        let path = self.path(name);
        std::fs::write(&path, contents).unwrap();
        text(&path).to_owned()
    }

    /// Runs `resurvey COMMAND map.rsv ARGUMENTS`.
    pub fn run(&self, command: &str, arguments: &[&str]) -> Run {
        let map = self.path("map.rsv");
        let words: Vec<&str> = [command, text(&map)].into_iter().chain(arguments.iter().copied()).collect();
        resurvey(&words)
    }

    /// The same with `--json`: the document.
    pub fn json(&self, command: &str, arguments: &[&str]) -> Value {
        let words: Vec<&str> = arguments.iter().copied().chain(["--json"]).collect();
        self.run(command, &words).ok().json()
    }

    /// Runs what must be refused: the exit code, words of the message, no result, and not one byte changed.
    pub fn refuses(&self, command: &str, arguments: &[&str], code: u8, words: &[&str]) {
        self.run(command, arguments).refused(code, words);
        assert!(self.is_unchanged(), "{command} {arguments:?} changed the map");
    }

    /// The features of a version without the versions they are from.
    pub fn state(&self, revision: &str) -> Vec<Value> {
        let answer = self.json("query", &["--at", revision]);
        let without = |feature: &Value| {
            let mut fields = feature.as_object().unwrap().clone();
            fields.retain(|key, _| key != "from" && key != "to");
            Value::Object(fields)
        };
        answer["features"].as_array().unwrap().iter().map(without).collect()
    }

    /// Applies operations to head, and returns the new version.
    pub fn apply(&self, lines: &[Value]) -> u64 {
        let file = self.file("lines.jsonl", crate::change_sets::set(None, lines));
        self.json("apply", &[&file])["version"].as_u64().unwrap()
    }

    /// Whether the map file has the bytes it began with and nothing waits to be written into it.
    pub fn is_unchanged(&self) -> bool {
        let log = std::fs::metadata(self.path("map.rsv-wal")).map_or(0, |file| file.len());
        log == 0 && std::fs::read(self.path("map.rsv")).unwrap() == self.before
    }

    /// The newest version, once fsck finds nothing wrong.
    pub fn head(&self) -> u64 {
        assert_eq!(self.json("fsck", &[]), json!({ "ok": true, "problems": [] }));
        self.json("log", &["-n", "1"])["versions"][0]["version"].as_u64().unwrap()
    }
}

/// Calls `edit` on a JSON document and returns its text.
pub fn edited(document: &Value, edit: impl FnOnce(&mut Value)) -> String {
    let mut document = document.clone();
    edit(&mut document);
    document.to_string()
}

/// Bytes without meaning, always the same.
pub fn noise(length: usize) -> Vec<u8> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let byte = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state.to_le_bytes()[3]
    };
    std::iter::repeat_with(byte).take(length).collect()
}
