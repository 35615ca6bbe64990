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
fn the_readme_leads_to_a_running_matcher_in_cpp() {
    if has(&["cc", "c++", "make"]) {
        Trial::new().follow("C++", 0, "my-cpp-matcher");
    }
}

#[test]
fn the_readme_leads_to_a_running_matcher_in_rust() {
    if has(&["cargo"]) {
        Trial::new().follow("Rust", 0, "my-rust-matcher");
    }
}

/// Language, its tools, how a project is tested and built, and the file that comes out.
type InLanguage = (&'static str, &'static [&'static str], &'static str, &'static str);
const LANGUAGES: [InLanguage; 3] = [
    ("c", &["cc", "make"], "make test && make", "libmy_NAME.so"),
    (
        "python",
        &["python3", "numpy"],
        "python3 -m unittest && python3 -m resurvey_plugin build KIND.py",
        "resurvey-plugin-my-NAME",
    ),
    ("rust", &["cargo"], "cargo test && cargo build", "target/debug/libmy_NAME.so"),
];

/// Writes a project in every language whose tools are here, from a template, by the words of `plugins new`; tests, builds,
/// checks and installs it, and hands on the folder and the name.
fn in_every_language(template: &str, words: &str, then: impl Fn(&Trial, &str)) {
    for (language, _, build, file) in LANGUAGES.into_iter().filter(|(_, tools, ..)| has(tools)) {
        let trial = Trial::new();
        let name = format!("my-{language}-{template}");
        let file = file.replace("my_NAME", &name.replace('-', "_")).replace("my-NAME", &name);
        let script = format!(
            "resurvey plugins new {name} {words} --lang {language}\ncd {name}\n{}\nresurvey plugins check {file}\n\
             resurvey plugins install {file}",
            build.replace("KIND", template)
        );
        trial.shell(&script);
        then(&trial, &name);
    }
}

#[test]
fn detectors_of_every_language_are_written_whole() {
    in_every_language("detector", "--kind detector", |trial, name| {
        trial.finds_the_banner(&["--detector", name], name);
    });
}

#[test]
fn estimators_of_every_language_are_written_whole() {
    in_every_language("estimator", "--kind estimator", |trial, name| {
        trial.finds_the_banner(&["--estimator", name], name);
    });
}

#[test]
fn matchers_that_search_are_written_whole_in_every_language() {
    in_every_language("search", "--kind matcher --form search", |trial, name| {
        trial.finds_the_pose(&["--matcher", name]);
    });
}

#[test]
fn segmenters_of_every_language_are_written_whole() {
    // The label image is indexed with the class colours: as a photo it is a picture in them.
    in_every_language("segmenter", "--kind segmenter", |trial, name| {
        trial.finds_the_pose(&["--photo", "labels.png", "--segmenter", name]);
    });
}

#[test]
fn the_matcher_in_one_file_of_python_finds_the_pose() {
    if !has(&["python3", "numpy"]) {
        return;
    }
    let trial = Trial::new().with_python_package();
    trial.installs(&Path::new(ROOT).join("examples/python_matcher/resurvey-plugin-mean-dice"));
    trial.finds_the_pose(&["--matcher", "mean-dice"]);
}

#[test]
fn the_matcher_in_cpp_finds_the_pose() {
    if has(&["c++"]) {
        let trial = Trial::new();
        trial.installs(&trial.built_by_its_first_comment("examples/cpp_matcher/matcher.cpp", "libkappa.so"));
        trial.finds_the_pose(&["--matcher", "kappa"]);
    }
}

#[test]
fn a_cpp_matcher_with_the_standard_library_passes_with_the_flags_of_the_example() {
    if has(&["c++"]) {
        let trial = Trial::new();
        let built = trial.path("libstandard_library.so");
        let line = trial::build_line("examples/cpp_matcher/matcher.cpp");
        let (compiler, _) = line.split_once("examples/").unwrap();
        let source = "tests/plugin_languages/standard_library.cpp";
        trial.shell(&format!("cd '{ROOT}'\n{compiler}{source} -Werror -o '{}'", built.display()));
        trial.installs(&built);
        trial.finds_the_pose(&["--matcher", "standard-library"]);
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
fn new_says_what_it_does_not_begin() {
    let trial = Trial::bare();
    let (code, message) = trial.code("resurvey plugins new mine --kind detector --form search --lang c");
    assert_eq!((code, message.contains("--form search is for a matcher")), (2, true), "{message}");
    let (code, message) = trial.code("resurvey plugins new mine --kind detector --lang cpp");
    assert_eq!((code, message.contains("begin others with --lang c")), (2, true), "{message}");
}

#[test]
fn what_new_says_comes_next_leads_to_a_pose() {
    if has(&["cc", "make"]) {
        let trial = Trial::new();
        let said = trial.shell("resurvey plugins new my-own --kind matcher --lang c --out projects/mine");
        let (_, steps) = said.split_once("next:\n").unwrap();
        assert_eq!(steps.lines().count(), 7, "{steps}");
        assert!(trial.shell(steps).contains("heading"), "{steps}");
    }
}

#[test]
fn nothing_of_a_template_is_left_in_a_project() {
    let trial = Trial::bare();
    let kinds = ["matcher", "matcher --form search", "detector", "estimator", "segmenter"];
    for language in ["rust", "c", "cpp", "python"] {
        for kind in kinds.into_iter().filter(|kind| language != "cpp" || *kind == "matcher") {
            let name = format!("{language}-{}", kind.replace(" --form ", "-"));
            trial.shell(&format!("resurvey plugins new {name} --kind {kind} --lang {language}"));
            for text in trial.texts_in(&name) {
                let marks = ["MyMatcher", "MyDetector", "MyEstimator", "MySegmenter", "@KIND", "@FILE", "@USE", "@SDK"];
                for mark in ["my-plugin", "my_plugin"].into_iter().chain(marks) {
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
