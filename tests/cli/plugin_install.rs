//! `plugins install` and `plugins remove` through the built binary, each test with a data directory of its own.

use crate::bench::text;
use serde_json::{Value, json};
use sha2::Digest;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A user with an empty data directory.
struct User(TempDir);

impl User {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_resurvey"));
        command.arg("plugins").args(arguments).env("XDG_DATA_HOME", self.0.path().join("data"));
        command.env_remove("RESURVEY_PLUGIN_PATH").output().unwrap()
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let output = self.run(&[arguments, &["--json"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// Asserts an exit code and words of the message.
    fn refused(&self, arguments: &[&str], code: i32, words: &[&str]) {
        let output = self.run(arguments);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{message}");
        for word in words {
            assert!(message.contains(word), "expected {word:?} in {message:?}");
        }
    }

    fn data(&self) -> PathBuf {
        self.0.path().join("data/resurvey")
    }

    /// Digests on the list.
    fn allowed(&self) -> Vec<String> {
        let list = std::fs::read_to_string(self.data().join("allowed-plugins")).unwrap_or_default();
        list.lines().map(|line| line.split(' ').next().unwrap().to_owned()).collect()
    }

    /// Names of what lies among the installed plugins.
    fn kept(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.data().join("plugins")).into_iter().flatten().flatten();
        let mut names: Vec<String> = entries.map(|entry| entry.file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Compiles `matcher.c` with `flags` as `lib{name}.so`; `None`, said aloud, without a compiler.
    fn library(&self, source: &str, name: &str, flags: &[&str]) -> Option<(PathBuf, String)> {
        let library = self.0.path().join(format!("lib{name}.so"));
        let mut command = Command::new("cc");
        command.args(["-std=c11", "-D_DEFAULT_SOURCE", "-fPIC", "-shared", "-I"]);
        command.arg(format!("{ROOT}/schema/include")).arg(format!("{ROOT}/plugins/fixtures/c/{source}"));
        let Ok(built) = command.args(flags).args(["-o", text(&library), "-lm"]).output() else {
            let _ = writeln!(std::io::stderr(), "SKIPPED: no C compiler cc; installing plugins was not tested");
            return None;
        };
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        allow_writing(&library, 0o755);
        let digest = digest(&library);
        Some((library, digest))
    }
}

fn digest(path: &Path) -> String {
    sha2::Sha256::digest(std::fs::read(path).unwrap()).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn allow_writing(path: &Path, mode: u32) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    }
    #[cfg(not(unix))]
    let _ = (path, mode);
}

#[test]
fn what_is_installed_is_checked_listed_loaded_and_removed_without_a_trace() {
    let user = User::new();
    let Some((library, sha256)) = user.library("matcher.c", "mine", &[]) else { return };
    let before = user.json(&["info", "skyline"]);
    user.refused(&["info", "agreement"], 11, &["agreement"]);

    let installed = user.json(&["install", text(&library)]);
    assert_eq!((&installed["installed"], &installed["was_installed"]), (&json!(true), &json!(false)));
    assert_eq!((&installed["name"], &installed["sha256"]), (&json!("agreement"), &json!(sha256)));
    assert_eq!(installed["check"]["ok"], true);
    let path = user.data().join("plugins").join(&sha256).join("libagreement.so");
    assert_eq!(installed["path"], json!(text(&path)));
    assert_eq!((user.kept(), user.allowed()), (vec![sha256.clone()], vec![sha256.clone()]));

    std::fs::remove_file(&library).unwrap();
    let listed = user.json(&["list"]);
    let mine = listed["plugins"].as_array().unwrap().iter().find(|plugin| plugin["name"] == "agreement").unwrap();
    assert_eq!((&mine["sha256"], &mine["builtin"]), (&json!(sha256), &json!(false)));
    assert!(listed["directories"].as_array().unwrap().contains(&json!(text(path.parent().unwrap()))));
    assert_eq!(user.json(&["info", "agreement"])["settings_schema"]["properties"]["void_is_wrong"]["default"], false);

    assert_eq!(user.json(&["remove", "agreement"]), json!({ "removed": [sha256] }));
    assert_eq!((user.kept(), user.allowed()), (vec![], vec![]));
    user.refused(&["info", "agreement"], 11, &["agreement"]);
    user.refused(&["remove", "agreement"], 11, &["no installed plugin is \"agreement\"", "installed are: none"]);
    assert_eq!(user.json(&["info", "skyline"]), before);
}

#[test]
fn installing_twice_is_installing_once() {
    let user = User::new();
    let Some((library, sha256)) = user.library("matcher.c", "mine", &[]) else { return };
    user.json(&["install", text(&library), "--no-check"]);
    let again = user.json(&["install", text(&library), "--no-check"]);
    assert_eq!(
        (&again["installed"], &again["was_installed"], &again["check"]),
        (&json!(true), &json!(true), &json!(null))
    );
    assert_eq!((user.kept(), user.allowed()), (vec![sha256.clone()], vec![sha256.clone()]));
    // By its digest, which names one build.
    assert_eq!(user.json(&["remove", &sha256]), json!({ "removed": [sha256] }));
    assert_eq!(user.kept(), Vec::<String>::new());
}

#[test]
fn a_new_build_takes_the_place_of_the_old_one() {
    let user = User::new();
    let Some((old, first)) = user.library("matcher.c", "old", &["-O1"]) else { return };
    let Some((new, second)) = user.library("matcher.c", "new", &["-O2"]) else { return };
    assert_ne!(first, second);
    let other = "0".repeat(64);
    std::fs::create_dir_all(user.data()).unwrap();
    std::fs::write(user.data().join("allowed-plugins"), format!("{other} of my own\n")).unwrap();
    user.json(&["install", text(&old), "--no-check"]);
    assert_eq!(user.json(&["install", text(&new), "--no-check"])["replaced"], json!([first]));
    // The older build stays for replay, and the new one is the last on the list: it runs.
    let mut both = vec![first.clone(), second.clone()];
    both.sort();
    assert_eq!((user.kept(), user.allowed()), (both, vec![other.clone(), first, second.clone()]));
    assert_eq!(user.json(&["info", "agreement"])["sha256"], json!(second));
    // What the user wrote stays as it was.
    let list = std::fs::read_to_string(user.data().join("allowed-plugins")).unwrap();
    assert!(list.starts_with(&format!("{other} of my own\n")), "{list}");
    assert_eq!(user.json(&["remove", &other]), json!({ "removed": [other] }));
}

#[test]
fn a_plugin_that_fails_its_check_is_not_installed_and_leaves_nothing_behind() {
    let user = User::new();
    let Some((library, _)) = user.library("faulty_matcher.c", "faulty", &["-DFAULT_STRIDE"]) else { return };
    let words = ["libfaulty.so is not installed: 1 tests failed", "--no-check"];
    user.refused(&["install", text(&library)], 12, &words);
    assert_eq!((user.kept(), user.allowed()), (vec![], vec![]));
    let output = user.run(&["install", text(&library), "--json"]);
    let document: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&document["installed"], &document["check"]["ok"]), (&json!(false), &json!(false)));
    assert_eq!(user.json(&["install", text(&library), "--no-check"])["installed"], true);
}

#[test]
fn a_file_that_others_may_write_is_not_installed_even_unchecked() {
    let user = User::new();
    let Some((library, _)) = user.library("matcher.c", "mine", &[]) else { return };
    allow_writing(&library, 0o666);
    if cfg!(unix) {
        let words = ["refused libmine.so at permissions", "every user of this machine may write the file", "chmod o-w"];
        user.refused(&["install", text(&library), "--no-check"], 12, &words);
        assert_eq!((user.kept(), user.allowed()), (vec![], vec![]));
    }
}

#[test]
fn a_pipe_is_no_plugin_and_nobody_waits_for_it() {
    let user = User::new();
    let directory = tempfile::tempdir().unwrap();
    let pipe = directory.path().join("pipe");
    if !Command::new("mkfifo").arg(&pipe).status().is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: mkfifo is missing");
        return;
    }
    for words in [&["check"][..], &["install"], &["install", "--no-check"]] {
        user.refused(&[words, &[text(&pipe)]].concat(), 10, &["not a file", "name a library"]);
    }
}

#[test]
fn a_name_that_means_something_else_is_taken() {
    let user = User::new();
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("project");
    for name in ["gate", "search", "prior", "fused"] {
        let words = ["new", name, "--kind", "matcher", "--lang", "c", "--out", text(&out)];
        user.refused(&words, 2, &[name, "resurvey uses itself"]);
    }
    assert!(!out.exists());
}

#[test]
fn the_name_of_a_built_in_plugin_is_taken() {
    let user = User::new();
    let name = format!("{}resurvey_skyline{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let library = std::env::current_exe().unwrap().with_file_name(name);
    let words = ["a built-in plugin is called skyline", "another name"];
    user.refused(&["install", text(&library)], 12, &words);
    assert_eq!(user.kept(), Vec::<String>::new());
}

#[test]
fn a_plugin_that_was_not_installed_is_refused_with_how_to_allow_it() {
    let user = User::new();
    let Some((library, sha256)) = user.library("matcher.c", "agreement", &[]) else { return };
    let directory = library.parent().unwrap();
    let arguments = ["info", "agreement", "--plugin-dir", text(directory)];
    let words = ["refused libagreement.so at allow-list", &sha256, "resurvey plugins install"];
    user.refused(&arguments, 12, &words);
}

#[test]
fn a_library_that_changes_after_it_was_installed_is_not_loaded() {
    let user = User::new();
    let Some((library, _)) = user.library("matcher.c", "mine", &[]) else { return };
    let path = user.json(&["install", text(&library), "--no-check"])["path"].as_str().unwrap().to_owned();
    let mut bytes = std::fs::read(&path).unwrap();
    bytes.push(0);
    std::fs::write(&path, bytes).unwrap();
    user.refused(&["info", "agreement"], 12, &["refused libagreement.so at allow-list"]);
    let skipped = user.json(&["list"])["skipped"].clone();
    assert!(skipped[0]["reason"].as_str().unwrap().contains("allow-list"), "{skipped}");
}

#[test]
fn builds_that_are_installed_at_once_are_all_on_the_list() {
    let user = User::new();
    let named = |number| format!("-DNAME=\"mine{number}\"");
    let built = (0..6).map(|number| user.library("broken.c", &format!("mine{number}"), &[&named(number)]));
    let Some(libraries) = built.collect::<Option<Vec<_>>>() else { return };
    std::thread::scope(|scope| {
        for (library, _) in &libraries {
            scope.spawn(|| user.json(&["install", text(library), "--no-check"]));
        }
    });
    let mut expected: Vec<String> = libraries.into_iter().map(|(_, sha256)| sha256).collect();
    expected.sort();
    let mut allowed = user.allowed();
    allowed.sort();
    assert_eq!(allowed, expected);
}

#[test]
#[cfg(unix)]
fn a_list_that_others_may_write_or_nobody_can_read_allows_nothing() {
    let user = User::new();
    let Some((library, _)) = user.library("matcher.c", "mine", &[]) else { return };
    user.json(&["install", text(&library), "--no-check"]);
    let list = user.data().join("allowed-plugins");
    allow_writing(&list, 0o646);
    let words = ["allowed-plugins", "every user of this machine may write the file", "chmod o-w"];
    user.refused(&["info", "agreement"], 12, &words);
    std::fs::write(&list, b"\xff\xfe").unwrap();
    allow_writing(&list, 0o600);
    user.refused(&["info", "agreement"], 10, &["allowed-plugins", "UTF-8"]);
}

#[test]
fn a_data_directory_that_is_no_whole_path_counts_for_nothing() {
    let user = User::new();
    let listed = Command::new(env!("CARGO_BIN_EXE_resurvey"))
        .args(["plugins", "list", "--json"])
        .env("XDG_DATA_HOME", "data")
        .env("HOME", user.0.path())
        .current_dir(user.0.path())
        .output()
        .unwrap();
    assert!(listed.status.success());
    let Some((library, _)) = user.library("matcher.c", "mine", &[]) else { return };
    let installed = Command::new(env!("CARGO_BIN_EXE_resurvey"))
        .args(["plugins", "install", "--no-check", text(&library)])
        .env("XDG_DATA_HOME", "data")
        .env("HOME", user.0.path())
        .current_dir(user.0.path())
        .output()
        .unwrap();
    assert!(installed.status.success(), "{}", String::from_utf8_lossy(&installed.stderr));
    assert!(!user.0.path().join("data").exists());
    assert!(user.0.path().join(".local/share/resurvey/allowed-plugins").exists());
}
