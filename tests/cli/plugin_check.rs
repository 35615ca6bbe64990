//! `plugins check` through the built binary: it passes every plugin that is shipped and fails every one that is broken,
//! with what is wrong and what to do.

use crate::bench::text;
use rayon::prelude::*;
use serde_json::Value;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A broken plugin: how it is made, the test that must fail, and words of its message.
struct Broken {
    source: Source,
    test: &'static str,
    words: &'static [&'static str],
}

#[derive(Clone, Copy, Debug)]
enum Source {
    /// A file of `plugins/fixtures/c`, with a flag.
    C(&'static str, &'static str),
    /// The crate `plugins/fixtures`, whose default is this mode.
    Rust(&'static str),
}

const fn c(file: &'static str, flag: &'static str, test: &'static str, words: &'static [&'static str]) -> Broken {
    Broken { source: Source::C(file, flag), test, words }
}

const fn rust(mode: &'static str, test: &'static str, words: &'static [&'static str]) -> Broken {
    Broken { source: Source::Rust(mode), test, words }
}

const MATCHER: &str = "faulty_matcher.c";
const DETECTOR: &str = "faulty_detector.c";
const ESTIMATOR: &str = "faulty_estimator.c";
const SEGMENTER: &str = "faulty_segmenter.c";
const ANY: &str = "broken.c";

const BROKEN: &[Broken] = &[
    c(ANY, "-DMAJOR=2", "header", &["abi: plugin speaks ABI 2.0, this host speaks 1.0", "install a build for ABI 1"]),
    c(ANY, "-DMIN_HOST=9", "header", &["plugin needs a host of ABI 1.9", "upgrade resurvey"]),
    c(ANY, "-DSYMBOL=other", "header", &["exports no symbol that begins with resurvey_plugin_v1__"]),
    c(ANY, "-DSECOND=resurvey_plugin_v1__two", "header", &["more than one declaration"]),
    c(ANY, "-DNAME=\"No Name\"", "header", &["expected a name of a–z, 0–9 and dashes"]),
    c(ANY, "-DUNDEFINED_SYMBOL", "loads", &["symbol: ", "resurvey_nobody_has_this", "a build for this system"]),
    c(ANY, "-DCONSTRUCTOR", "loads", &["signal 6 (abort) in the library's own start"]),
    c(ANY, "-DENTRY_FAILS", "loads", &["its entry returned status 1: needs a licence"]),
    c(ANY, "-DNO_SCORE", "loads", &["a matcher needs the function score or search"]),
    c(ANY, "-DSCHEMA=\"{\\\"properties\\\": 7}\"", "loads", &["settings schema: properties: 7 is not understood"]),
    c(ANY, "-DCREATE_FAILS", "settings", &["no answer in create: no model for this city", "narrow the schema"]),
    c(ANY, "-DSCORE=NAN", "answers", &["score = NaN", "from 0 to 1", "before it is returned"]),
    c(ANY, "-DCANCELLED", "answers", &["was cancelled in score", "only after the host's cancelled() gave 1"]),
    c(ANY, "-DNO_REASON", "answers", &["no reason given"]),
    c(ANY, "-DSCORE=0.5", "sense", &["a photo scores 0.5 on its own view and 0.5 on one of another pose"]),
    c(MATCHER, "-DFAULT_EXPORT", "exports", &["found 1 more: score", "-fvisibility=hidden"]),
    c(MATCHER, "-DFAULT_EXIT", "settings", &["ended the whole process with exit code 0 in create", "never call exit"]),
    c(MATCHER, "-DFAULT_BOUND", "settings", &["no answer in create: cannot divide by a share of 0"]),
    c(MATCHER, "-DFAULT_ABORT_IN_DESTROY", "settings", &["signal 6 (abort) in destroy"]),
    c(MATCHER, "-DFAULT_LOOP", "answers", &["did not return within 1 s in score", "end every loop"]),
    c(MATCHER, "-DFAULT_CRASH", "answers", &["signal 11 (segmentation fault) in score", "check pointers for null"]),
    c(MATCHER, "-DFAULT_MEMORY", "answers", &["in score", "malloc"]),
    c(MATCHER, "-DFAULT_PERCENT", "answers", &["score = 100", "a number from 0 to 1"]),
    c(MATCHER, "-DFAULT_NAN", "answers", &["score = ", "a number from 0 to 1"]),
    c(MATCHER, "-DFAULT_SMALL", "small-images", &["signal 11", "in score"]),
    c(
        MATCHER,
        "-DFAULT_STRIDE",
        "rows",
        &["padding behind each row changed the answer", "row_bytes, not by the width"],
    ),
    c(
        MATCHER,
        "-DFAULT_KEEP",
        "inputs",
        &["photo was used after the call (in score)", "lent for the length of the call"],
    ),
    c(MATCHER, "-DFAULT_WRITE_INPUT", "inputs", &["photo was written to (in score)", "inputs are read-only"]),
    c(MATCHER, "-DFAULT_READ_PAST", "inputs", &["photo was overrun", "row_bytes"]),
    c(MATCHER, "-DFAULT_WRITE_PAST", "outputs", &["score was overrun", "stay inside"]),
    c(MATCHER, "-DFAULT_WRITE_BEFORE", "outputs", &["something was written beside the score"]),
    c(MATCHER, "-DFAULT_LONG_ERROR", "outputs", &["error.data was overrun", "stay inside"]),
    c(MATCHER, "-DFAULT_COUNTER", "repeats", &["the same instance gave another answer", "score 1 became score 0.5"]),
    c(MATCHER, "-DFAULT_SLOW", "cancel", &["one call of score, which cannot be cancelled, took 3", "at most 200"]),
    c(MATCHER, "-DFAULT_GLOBAL", "threads", &["score 1 became score 0.5", "no static buffers"]),
    c(MATCHER, "-DFAULT_WHOLE_TABLE", "older-host", &["table was overrun", "the size at the start of each struct"]),
    c(MATCHER, "-DFAULT_WHOLE_TABLE", "newer-host", &["entry overwrote `size`", "leave `size` alone"]),
    c(MATCHER, "-DFAULT_ROUNDING", "manners", &["the floating-point mode changed in a call", "-ffast-math"]),
    c(MATCHER, "-DFAULT_DIRECTORY", "manners", &["the working directory changed in a call", "became /"]),
    c(MATCHER, "-DFAULT_SIGNAL", "manners", &["the handler of signal", "leave signals to the program"]),
    c(MATCHER, "-DFAULT_PRINT", "answers", &["standard output has \"scoring 76800 pixels\"", "standard error"]),
    c(MATCHER, "-DFAULT_DIFFERENCE", "sense", &["a photo scores 0 on its own view", "higher is better"]),
    c(DETECTOR, "-DFAULT_CLASS", "answers", &["region[0].class_after = 200", "a class of the map"]),
    c(DETECTOR, "-DFAULT_BOX", "answers", &["region[0].bounds = ", "a box inside 320×240 pixels"]),
    c(DETECTOR, "-DFAULT_VOID", "nothing", &["all void (255) gave 1 regions", "unlabelled"]),
    c(
        DETECTOR,
        "-DFAULT_CANCEL",
        "cancel",
        &["a call that is cancelled from the start took", "at most 200", "cancelled()"],
    ),
    c(DETECTOR, "-DFAULT_LOG", "older-host", &["services was overrun", "the size at the start of each struct"]),
    c(DETECTOR, "-DFAULT_BLIND", "sense", &["the regions cover 0 %"]),
    c(ESTIMATOR, "-DFAULT_NORMAL", "answers", &["proposal[0].descriptor.normal = ", "a unit vector"]),
    c(ESTIMATOR, "-DFAULT_REMOVE", "sense", &["proposed to remove class 3 near E 83", "where the map has none"]),
    c(
        ESTIMATOR,
        "-DFAULT_MEASURE",
        "sense",
        &["where the banner has 4.000 m × 2.000 m", "its centre at (i + 0.5, j + 0.5)"],
    ),
    c(SEGMENTER, "-DFAULT_LABEL", "nothing", &["labels[0][0] = 200", "a class of the map, or 255"]),
    c(SEGMENTER, "-DFAULT_STRIDE", "rows", &["padding behind each row changed the answer"]),
    c(SEGMENTER, "-DFAULT_ROWS", "rows", &["behind the end of a row of labels", "step from row to row by row_bytes"]),
    c(SEGMENTER, "-DFAULT_PAST", "outputs", &["labels was overrun", "stay inside"]),
    c(SEGMENTER, "-DFAULT_MAP", "answers", &["nobody knows yet where the photo was taken"]),
    rust("panic-in-create", "settings", &["panicked in create: asked to panic in create at ", "return an error"]),
    rust("panic-in-score", "answers", &["panicked in score", "image.rs:", "return an error"]),
    rust("panic-in-drop", "settings", &["panicked in destroy: asked to panic in drop", "make it one that cannot fail"]),
    rust("not-a-number", "answers", &["score = NaN"]),
    rust("exit", "answers", &["exit code 0 in score", "never call exit"]),
    rust("loop", "answers", &["did not return within 1 s in score"]),
    rust("hoard", "answers", &["signal 6 (abort) in score: memory allocation of", "malloc"]),
    rust("recurse", "answers", &["ended the whole process with signal", "in score"]),
    rust("print", "answers", &["standard output has \"call 0\""]),
    rust("wander", "manners", &["the working directory changed in a call"]),
    rust("remember", "repeats", &["another answer to the same input"]),
    rust("fine", "sense", &["a photo scores 0.25 on its own view and 0.25"]),
];

/// Runs `plugins check --json`.
fn check(library: &Path, time_limit: &str) -> (i32, Value) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_resurvey"));
    command.args(["plugins", "check", text(library), "--json", "--time-limit", time_limit, "--memory-limit", "1024"]);
    let output = command.output().unwrap();
    let parsed = serde_json::from_slice(&output.stdout);
    let document = parsed.unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(&output.stderr)));
    (output.status.code().unwrap(), document)
}

fn test<'a>(document: &'a Value, name: &str) -> &'a Value {
    document["tests"].as_array().unwrap().iter().find(|test| test["test"] == name).unwrap()
}

/// A library that Cargo built beside this test.
fn built(crate_name: &str) -> PathBuf {
    let name = format!("{}{crate_name}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    std::env::current_exe().unwrap().with_file_name(name)
}

/// `None`, said aloud, where there is no C compiler.
fn compiler() -> Option<()> {
    let is_there = Command::new("cc").arg("--version").output().is_ok();
    if !is_there {
        let _ = writeln!(std::io::stderr(), "SKIPPED: no C compiler cc; broken plugins in C were not checked");
    }
    is_there.then_some(())
}

fn make(source: Source, directory: &Path, number: usize) -> Option<PathBuf> {
    let library = directory.join(format!("libbroken{number}.so"));
    match source {
        Source::C(file, flag) => {
            compiler()?;
            let mut command = Command::new("cc");
            command.args(["-std=c11", "-D_DEFAULT_SOURCE", "-O1", "-fPIC", "-shared", "-I"]);
            command.arg(format!("{ROOT}/schema/include")).arg(format!("{ROOT}/plugins/fixtures/c/{file}"));
            let done = command.args([flag, "-o", text(&library), "-lm"]).output().unwrap();
            assert!(done.status.success(), "{flag}: {}", String::from_utf8_lossy(&done.stderr));
        }
        Source::Rust(mode) => {
            let mut bytes = std::fs::read(built("resurvey_fixtures")).unwrap();
            let (room, wanted) = (b"\"default\": \"fine\"               ,", format!("\"default\": \"{mode}\""));
            let at = bytes.windows(room.len()).position(|window| window == room).expect("the schema is in the library");
            let padded = format!("{wanted:width$},", width = room.len() - 1);
            bytes[at..at + room.len()].copy_from_slice(padded.as_bytes());
            std::fs::write(&library, bytes).unwrap();
        }
    }
    Some(library)
}

#[test]
fn every_broken_plugin_fails_with_what_is_wrong_and_what_to_do() {
    let directory = tempfile::tempdir().unwrap();
    let judge = |(number, broken): (usize, &Broken)| {
        let library = make(broken.source, directory.path(), number)?;
        let is_endless = broken.words.iter().any(|word| word.starts_with("did not return within 1 s"));
        let (code, document) = check(&library, if is_endless { "1" } else { "30" });
        let found = test(&document, broken.test);
        let message =
            format!("{} · {}", found["problem"].as_str().unwrap_or(""), found["advice"].as_str().unwrap_or(""));
        let is_right = code == 12 && document["ok"] == false && found["result"] == "failed";
        let missing = broken.words.iter().find(|word| !message.contains(**word));
        (!is_right || missing.is_some()).then(|| {
            format!(
                "{:?}: exit code {code}, {} {}, expected {missing:?} in {message}",
                broken.source, broken.test, found["result"]
            )
        })
    };
    let wrong: Vec<String> = BROKEN.par_iter().enumerate().filter_map(judge).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_shipped_plugin_passes() {
    for library in [
        "resurvey_class_difference",
        "resurvey_descriptors",
        "resurvey_edges",
        "resurvey_palette",
        "resurvey_pixel",
        "resurvey_semantic",
        "resurvey_silhouette",
        "resurvey_skyline",
    ] {
        let (code, document) = check(&built(library), "60");
        assert_eq!((code, &document["ok"]), (0, &Value::Bool(true)), "{library}: {document:#}");
        assert_eq!(document["plugin"]["name"], library.trim_start_matches("resurvey_").replace('_', "-"));
        assert!(document["tests"].as_array().unwrap().iter().all(|test| test["result"] == "ok"), "{document:#}");
    }
}

#[test]
fn plugins_in_c_and_rust_without_a_fault_pass() {
    let directory = tempfile::tempdir().unwrap();
    let mut sources = vec![Source::Rust("agreement")];
    if compiler().is_some() {
        let right = ["matcher.c", MATCHER, DETECTOR, ESTIMATOR, SEGMENTER].map(|file| Source::C(file, "-DNOTHING"));
        sources.extend(right);
    }
    for (number, source) in sources.into_iter().enumerate() {
        let library = make(source, directory.path(), number).unwrap();
        let (code, document) = check(&library, "30");
        assert_eq!(code, 0, "{source:?}: {document:#}");
    }
}

#[test]
fn a_matcher_in_c_plus_plus_with_the_standard_library_passes() {
    let directory = tempfile::tempdir().unwrap();
    let library = directory.path().join("libcpp.so");
    let built = Command::new("c++")
        .args(["-std=c++17", "-O1", "-fPIC", "-shared", "-fvisibility=hidden", "-I"])
        .arg(format!("{ROOT}/schema/include"))
        .arg(format!("{ROOT}/plugins/fixtures/cpp/matcher.cpp"))
        .args(["-o", text(&library)])
        .output();
    let Ok(built) = built else {
        let _ = writeln!(std::io::stderr(), "SKIPPED: no C++ compiler c++; a matcher in C++ was not checked");
        return;
    };
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let (code, document) = check(&library, "30");
    assert_eq!((code, &test(&document, "exports")["result"]), (0, &Value::from("ok")), "{document:#}");
}

/// Scores with the photo of the first call, which it keeps: a view of memory that is lent.
const KEEPER: &str = r##"#!/usr/bin/env python3
# resurvey-plugin: {"wire": 1, "kind": "matcher", "name": "keeper", "version": "1", "summary": "Keeps what it was lent"}
import json, mmap, os, socket, struct
wire = socket.socket(fileno=os.dup(1)); os.dup2(2, 1)
lines, memory, kept = wire.makefile("r"), mmap.mmap(os.dup(0), 0), None
say = lambda message: wire.sendall((json.dumps(message) + "\n").encode())
say({"hello": {"wire": 1, "name": "keeper", "version": "1", "kind": "matcher", "summary": "Keeps what it was lent",
               "form": "score", "settings_schema": ""}})
for line in lines:
    (name, body), = json.loads(line).items()
    if name == "create": kept = None
    if name == "score":
        if body["memory"] > len(memory): memory = mmap.mmap(0, body["memory"])
        photo, labels = body["photo"], body["views"]["labels"]
        size = photo["shape"][0] * photo["shape"][1]
        kept = kept or memoryview(memory)[photo["offset"]:photo["offset"] + size]
        for view in range(labels["shape"][0]):
            at = labels["offset"] + view * labels["strides"][0]
            same = sum(x == y for x, y in zip(kept, memory[at:at + size]))
            struct.pack_into("<d", memory, body["scores"]["offset"] + 8 * view, same / size)
    say({"done": {}})
"##;

#[test]
#[cfg(target_os = "linux")]
fn an_executable_that_keeps_what_it_was_lent_is_found_out() {
    use std::os::unix::fs::PermissionsExt;
    if Command::new("python3").arg("--version").output().is_err() {
        let _ = writeln!(std::io::stderr(), "SKIPPED: no python3; an executable was not checked");
        return;
    }
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("resurvey-plugin-keeper");
    std::fs::write(&file, KEEPER).unwrap();
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o755)).unwrap();
    let (code, document) = check(&file, "30");
    let repeats = test(&document, "repeats");
    assert_eq!((code, &repeats["result"]), (12, &Value::from("failed")), "{document:#}");
    let words = format!("{} · {}", repeats["problem"], repeats["advice"]);
    assert!(words.contains("another answer to the same input") && words.contains("copy what you keep"), "{words}");

    std::fs::write(
        &file,
        KEEPER.replace("for line in lines:", "raise ModuleNotFoundError('numpy')\nfor line in lines:"),
    )
    .unwrap();
    let (_, document) = check(&file, "30");
    let words = test(&document, "settings")["advice"].as_str().unwrap().to_owned();
    assert!(words.contains("docs/plugin-wire.md") && words.contains("last words"), "{document:#}");
}

#[test]
fn what_is_no_whole_library_of_ones_own_fails_before_any_code_runs() {
    let directory = tempfile::tempdir().unwrap();
    let whole = std::fs::read(built("resurvey_skyline")).unwrap();
    for (name, bytes, words) in [
        ("libtext.so", &b"not a library at all, but long enough to be read as one"[..], "not a library of this system"),
        ("libcut.so", &whole[..whole.len() / 2], ""),
    ] {
        let library = directory.path().join(name);
        std::fs::write(&library, bytes).unwrap();
        let (code, document) = check(&library, "10");
        let header = test(&document, "header");
        assert_eq!((code, &header["result"]), (12, &Value::from("failed")), "{document:#}");
        assert!(header["problem"].as_str().unwrap().contains(words), "{header}");
        assert!(header["advice"].as_str().unwrap().contains("whole plugin library"), "{header}");
        assert_eq!(test(&document, "loads")["result"], "not-run");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let library = directory.path().join("libopen.so");
        std::fs::write(&library, &whole).unwrap();
        std::fs::set_permissions(&library, std::fs::Permissions::from_mode(0o666)).unwrap();
        let (code, document) = check(&library, "10");
        let permissions = test(&document, "permissions");
        assert_eq!((code, &permissions["result"]), (12, &Value::from("failed")));
        assert!(permissions["problem"].as_str().unwrap().contains("every user of this machine may write the file"));
        assert!(permissions["advice"].as_str().unwrap().contains("chmod o-w"));
        assert_eq!(test(&document, "loads")["result"], "not-run");
    }
}

#[test]
fn a_file_that_is_not_there_is_a_wrong_input() {
    let output =
        Command::new(env!("CARGO_BIN_EXE_resurvey")).args(["plugins", "check", "no/such.so"]).output().unwrap();
    assert_eq!(output.status.code(), Some(10));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no/such.so"));
}
