//! Authors in Python, C, C++ and Rust: every line of `plugins/README.md` from an empty folder, projects of every kind and
//! language that `plugins new` writes, and the examples, all through the built binary. A tool that a language needs and is
//! not here skips its tests, and says so.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test's helpers may fail loudly")]

#[path = "../examples/synthetic/mod.rs"]
mod synthetic;
#[path = "plugin_languages/toys.rs"]
mod toys;
#[path = "plugin_languages/trial.rs"]
mod trial;

use std::path::Path;
use trial::{ROOT, Trial, has, readme_block};

#[test]
fn the_readme_leads_to_a_running_matcher_in_python() {
    if has(&["python3", "numpy"]) {
        Trial::new().follow("Python", 1, "my-matcher");
    }
}

#[test]
fn the_readme_leads_to_a_running_matcher_in_c() {
    if has(&["cc", "make"]) {
        Trial::new().follow("C", 0, "my-c-matcher");
    }
}

#[test]
fn the_readme_leads_to_a_running_matcher_in_rust() {
    if has(&["cargo"]) {
        Trial::new().follow("Rust", 0, "my-rust-matcher");
    }
}

#[test]
fn detectors_and_estimators_of_every_language_are_written_whole() {
    let languages: [(&str, &[&str], &str, &str); 3] = [
        ("c", &["cc", "make"], "make", "libmy_NAME.so"),
        (
            "python",
            &["python3", "numpy"],
            "python3 -m unittest && python3 -m resurvey_plugin build KIND.py",
            "resurvey-plugin-my-NAME",
        ),
        ("rust", &["cargo"], "cargo test && cargo build", "target/debug/libmy_NAME.so"),
    ];
    for (language, tools, build, file) in languages {
        for kind in ["detector", "estimator"].into_iter().filter(|_| has(tools)) {
            let trial = Trial::new();
            let name = format!("my-{language}-{kind}");
            let file = file.replace("my_NAME", &name.replace('-', "_")).replace("my-NAME", &name);
            let script = format!(
                "resurvey plugins new {name} --kind {kind} --lang {language}\ncd {name}\n{}\n\
                 resurvey plugins check {file}\nresurvey plugins install {file}",
                build.replace("KIND", kind)
            );
            trial.shell(&script);
            trial.finds_the_banner(&[&format!("--{kind}"), &name], &name);
        }
    }
}

#[test]
fn the_matcher_in_one_file_of_python_finds_the_pose() {
    if !has(&["python3", "numpy"]) {
        return;
    }
    let trial = Trial::new().with_python_package();
    trial.installs(&Path::new(ROOT).join("examples/python_matcher/resurvey-plugin-mean-dice"));
    trial.finds_the_pose("mean-dice");
}

#[test]
fn the_matcher_in_cpp_finds_the_pose() {
    if has(&["c++"]) {
        let trial = Trial::new();
        trial.installs(&trial.built_by_its_first_comment("examples/cpp_matcher/matcher.cpp", "libkappa.so"));
        trial.finds_the_pose("kappa");
    }
}

#[test]
fn the_detector_in_c_finds_the_banner() {
    if has(&["cc"]) {
        let trial = Trial::new();
        trial.installs(&trial.built_by_its_first_comment("examples/c_detector/detector.c", "libnear_by.so"));
        trial.finds_the_banner(&["--detector", "near-by"], "near-by");
    }
}

#[test]
fn the_python_package_keeps_its_promises() {
    if has(&["python3", "numpy"]) {
        let trial = Trial::bare();
        trial.shell(&format!("cd '{ROOT}/plugins/python'\npython3 -m unittest discover -t . -s tests"));
        // The templates are whole plugins themselves.
        trial.with_python_package().shell(&format!("cd '{ROOT}/plugins/templates/python'\npython3 -m unittest"));
    }
}

#[test]
fn new_leaves_alone_what_is_there() {
    let trial = Trial::bare();
    let new =
        |name: &str, more: &str| trial.code(&format!("resurvey plugins new {name} --kind matcher --lang c {more}"));
    assert_eq!(new("mine", ""), (0, String::new()));
    let (code, message) = new("mine", "");
    assert_eq!((code, message.contains("mine is there already; give another --out")), (10, true), "{message}");
    std::fs::write(trial.path("a-file"), "precious").unwrap();
    assert_eq!(new("other", "--out a-file").0, 10);
    assert_eq!(std::fs::read_to_string(trial.path("a-file")).unwrap(), "precious");
    std::fs::create_dir(trial.path("empty")).unwrap();
    assert_eq!(new("other", "--out empty").0, 0);
    assert!(trial.path("empty/plugin.c").is_file());
    let left: Vec<_> = std::fs::read_dir(trial.path("")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left.len(), 3, "nothing half-written stays: {left:?}");
}

#[test]
fn new_refuses_names_that_cannot_be_and_says_which_can() {
    let trial = Trial::bare();
    let refusals = [
        ("Facade", "words joined by single dashes, such as facade-edges; found \"Facade\""),
        ("facade--edges", "found \"facade--edges\""),
        ("3d", "found \"3d\""),
        ("../up", "found \"../up\""),
        ("a123456789-a123456789-a123456789-a12345678", "up to 40"),
        ("skyline", "a built-in plugin is called skyline"),
        ("match", "match is a word of Rust"),
    ];
    for (name, words) in refusals {
        let (code, message) = trial.code(&format!("resurvey plugins new '{name}' --kind matcher --lang rust"));
        assert_eq!((code, message.contains(words)), (2, true), "{name}: {message}");
    }
    let (code, message) = trial.code("resurvey plugins new mine --kind matcher --lang rust --sdk nowhere");
    assert_eq!((code, message.contains("expected the Rust SDK in nowhere; give --sdk")), (2, true), "{message}");
    let (code, _) = trial.code("resurvey plugins new mine --kind matcher --lang rust --sdk https://example.org/r.git");
    let manifest = std::fs::read_to_string(trial.path("mine/Cargo.toml")).unwrap();
    assert_eq!(code, 0);
    assert!(manifest.contains("resurvey-plugin = { git = \"https://example.org/r.git\" }"), "{manifest}");
}

#[test]
fn nothing_of_a_template_is_left_in_a_project() {
    let trial = Trial::bare();
    for language in ["rust", "c", "python"] {
        for kind in ["matcher", "detector", "estimator"] {
            let name = format!("{language}-{kind}");
            trial.shell(&format!("resurvey plugins new {name} --kind {kind} --lang {language}"));
            for text in trial.texts_in(&name) {
                for mark in
                    ["my-plugin", "my_plugin", "MyMatcher", "MyDetector", "MyEstimator", "@KIND", "@USE", "@SDK"]
                {
                    assert!(!text.contains(mark), "{name}: {mark}");
                }
            }
        }
    }
}

#[test]
fn the_readme_says_how_to_invent_a_map_as_these_tests_do() {
    let block = readme_block("Before you begin", 1);
    assert!(block.starts_with(trial::GENERATE), "{block}");
}
