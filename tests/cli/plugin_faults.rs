//! Plugins in processes of their own, through the built program: what ends such a process ends the run with code 12, names
//! plugin and call, and leaves map, temporary directory and process table as they were.
#![cfg(target_os = "linux")]

use crate::bench::{Bench, street, text};
use crate::plugin_files::{plugin, restrict, sha256};
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A bench with a fixture, a data directory and a temporary directory of its own.
struct Trial {
    bench: Bench,
    sha256: String,
}

/// What the program gave.
struct Ran {
    code: i32,
    out: String,
    err: String,
}

const NARROW: [&str; 4] = ["--set", "search.radius_m=0", "--set", "search.yaw_range_deg=0"];

impl Trial {
    fn new(source: &str, flags: &[&str]) -> Option<Self> {
        let bench = Bench::with_street();
        let sha256 = plugin(&bench, source, "faults", flags)?;
        Some(Self::prepared(bench, sha256))
    }

    /// With a script in place of a library.
    fn script(lines: &str) -> Self {
        let bench = Bench::with_street();
        let directory = bench.path("plugins");
        std::fs::create_dir_all(&directory).unwrap();
        restrict(&directory, 0o755);
        let file = directory.join("resurvey-plugin-faults");
        std::fs::write(&file, lines).unwrap();
        restrict(&file, 0o755);
        let sha256 = sha256(lines.as_bytes());
        Self::prepared(bench, sha256)
    }

    fn prepared(bench: Bench, sha256: String) -> Self {
        std::fs::create_dir_all(bench.path("tmp")).unwrap();
        Self { bench, sha256 }
    }

    fn run(&self, command: &str, plugin_as: &str, arguments: &[&str]) -> Ran {
        let capture = street().path("capture/capture.json");
        let output = Command::new(env!("CARGO_BIN_EXE_resurvey"))
            .args([command, text(&self.bench.path("map.rsv")), text(&capture), plugin_as, "faults"])
            .args(["--plugin-dir", text(&self.bench.path("plugins")), "--allow-plugin", &self.sha256])
            .args(arguments)
            .env("XDG_DATA_HOME", self.bench.path("data"))
            .env("TMPDIR", self.bench.path("tmp"))
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let words = |bytes| String::from_utf8_lossy(bytes).into_owned();
        Ran { code: output.status.code().unwrap_or(-1), out: words(&output.stdout), err: words(&output.stderr) }
    }

    /// `localize` with the fault `how` in the call `when`.
    fn localize(&self, how: &str, when: &str, more: &[&str]) -> Ran {
        self.with_fault("localize", how, when, more)
    }

    /// `update`, which writes into the map unless something keeps it from it.
    fn update(&self, how: &str, when: &str, more: &[&str]) -> Ran {
        self.with_fault("update", how, when, more)
    }

    fn with_fault(&self, command: &str, how: &str, when: &str, more: &[&str]) -> Ran {
        let (how, when) = (format!("faults.how={how}"), format!("faults.when={when}"));
        self.run(command, "--matcher", &[&NARROW[..], &["--set", &how, "--set", &when], more].concat())
    }

    /// Asserts that a run was ended by the plugin: code 12, these words, and nothing left behind.
    fn ended(&self, ran: &Ran, words: &[&str]) {
        assert_eq!(ran.code, 12, "{}{}", ran.out, ran.err);
        assert_eq!(ran.out, "");
        for word in words {
            assert!(ran.err.contains(word), "expected {word:?} in {:?}", ran.err);
        }
        assert!(self.bench.is_unchanged());
        assert_eq!(std::fs::read_dir(self.bench.path("tmp")).unwrap().count(), 0);
    }

    fn forget_crashes(&self) {
        let _ = std::fs::remove_dir_all(self.bench.path("data"));
    }
}

/// Whether a process runs; one that has ended and waits for its parent does not.
fn is_running(process: &str) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    status.lines().any(|line| line.starts_with("State:") && !line.contains('Z'))
}

#[test]
fn what_kills_the_process_ends_the_run_and_names_plugin_and_call() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    for (how, words) in [
        ("segv", &["signal 11", "SIGSEGV"][..]),
        ("abort", &["signal 6", "SIGABRT", "its last words: assertion failed: faults.c"]),
        ("exit", &["left with exit code 0"]),
        ("close", &["closed the wire"]),
    ] {
        for (when, call) in [("create", "create"), ("call", "score"), ("destroy", "destroy")] {
            let named = format!("plugin faults crashed in {call}: ");
            trial.ended(&trial.update(how, when, &[]), &[&[named.as_str()], words].concat());
            trial.forget_crashes();
        }
    }
}

#[test]
fn an_endless_loop_ends_with_the_time_limit() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    for (when, call) in [("create", "create"), ("call", "score"), ("destroy", "destroy")] {
        let started = Instant::now();
        let ran = trial.update("hang", when, &["--plugin-timeout", "0.3"]);
        let words = format!("plugin faults did not return from {call} within 0.3 s; --plugin-timeout SECONDS");
        trial.ended(&ran, &[&words]);
        assert!(started.elapsed() < Duration::from_secs(30));
    }
}

/// Says all the time that it has scored one more view.
const BUSY: &str = r##"#!/usr/bin/env python3
# resurvey-plugin: {"wire": 1, "kind": "matcher", "name": "faults", "version": "1", "summary": "A script"}
import mmap, os, socket
wire, memory = socket.socket(fileno=os.dup(1)), mmap.mmap(os.dup(0), 0)
wire.sendall(b'{"hello": {"wire": 1, "name": "faults", "version": "1", "kind": "matcher", "summary": "A script", "form": "score"}}\n')
while True: memory[16] = (memory[16] + 1) % 256
"##;

#[test]
fn a_plugin_does_not_set_its_own_clock_back() {
    if Command::new("python3").arg("--version").output().is_err() {
        let _ = writeln!(std::io::stderr(), "SKIPPED: no python3; the clock was not tested");
        return;
    }
    let (trial, started) = (Trial::script(BUSY), Instant::now());
    let ran = trial.run("update", "--matcher", &[&NARROW[..], &["--plugin-timeout", "3"]].concat());
    trial.ended(&ran, &["did not return from create within 3 s"]);
    assert!(started.elapsed() < Duration::from_secs(30));
}

#[test]
fn a_process_that_leaves_its_group_is_ended_all_the_same() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    let started = Instant::now();
    trial.ended(&trial.update("regroup", "call", &["--plugin-timeout", "0.3"]), &["did not return from score"]);
    assert!(started.elapsed() < Duration::from_secs(30));
}

#[test]
fn a_memory_hog_meets_its_limit_and_not_the_machine() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    for _ in 0..3 {
        // However often: the limit may be the reason, so it is no crash that counts.
        let ran = trial.update("hog", "call", &["--plugin-memory", "512"]);
        trial.ended(&ran, &["plugin faults crashed in score", "out of memory"]);
    }
}

#[test]
fn a_lower_limit_of_the_system_is_kept_and_no_crash() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    let capture = street().path("capture/capture.json");
    let limited = Command::new("sh")
        .args(["-c", "ulimit -v 7000000 && exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_resurvey")])
        .args(["localize", text(&trial.bench.path("map.rsv")), text(&capture), "--matcher", "faults"])
        .args(["--plugin-dir", text(&trial.bench.path("plugins")), "--allow-plugin", &trial.sha256])
        .args(NARROW)
        .env("XDG_DATA_HOME", trial.bench.path("data"))
        .output()
        .unwrap();
    assert!([0, 22].contains(&limited.status.code().unwrap()), "{}", String::from_utf8_lossy(&limited.stderr));
}

#[test]
fn a_request_that_no_host_can_serve_is_the_failure_of_who_asked() {
    let Some(trial) = Trial::new("faults.c", &["-DSEARCH"]) else { return };
    for here in [&[][..], &["--in-process"]] {
        let words = ["plugin faults gave no answer in search: boundary tolerance is 1", "expected 0 to 100"];
        trial.ended(&trial.update("greedy", "call", here), &words);
    }
}

#[test]
fn a_descriptor_that_no_map_can_hold_is_the_failure_of_who_made_it() {
    let Some(trial) = Trial::new("faults.c", &["-DKIND=3"]) else { return };
    let pose = street().path("pose.json");
    for here in [&[][..], &["--in-process"]] {
        let arguments = [&["--set", "faults.how=twist", "--pose", text(&pose)], here].concat();
        let words = ["plugin faults answered proposal[0].descriptor.corners = corner 0", "in estimate", "top-left"];
        trial.ended(&trial.run("update", "--estimator", &arguments), &words);
    }
}

#[test]
fn a_plugin_that_logs_in_a_loop_is_heard_up_to_a_limit() {
    let Some(trial) = Trial::new("faults.c", &["-DSEARCH"]) else { return };
    let ran = trial.localize("chatter", "call", &[]);
    assert!([0, 22].contains(&ran.code), "{}", ran.err);
    let heard = ran.err.lines().filter(|line| line.contains("still here")).count();
    // One line says that it searches.
    assert_eq!(heard, 999);
    assert!(ran.err.contains("warning: 4001 more lines of the plugin are left out"), "{:?}", ran.err.lines().last());
    assert!(!ran.err.contains('\x1b'), "a plugin writes to the terminal");
}

#[test]
fn every_kind_of_plugin_is_kept_apart() {
    for (flag, plugin_as, call) in [
        ("-DSEARCH", "--matcher", "search"),
        ("-DKIND=2", "--detector", "detect"),
        ("-DKIND=3", "--estimator", "estimate"),
        ("-DKIND=4", "--segmenter", "segment"),
    ] {
        let Some(trial) = Trial::new("faults.c", &[flag]) else { return };
        let (pose, photo) = (street().path("pose.json"), street().path("capture/labels.png"));
        let given = match plugin_as {
            "--matcher" => &[][..],
            "--segmenter" => &["--pose", text(&pose), "--photo", text(&photo)],
            _ => &["--pose", text(&pose)],
        };
        let ran = trial.run("update", plugin_as, &[&["--set", "faults.how=segv"], given].concat());
        trial.ended(&ran, &[&format!("plugin faults crashed in {call}: "), "SIGSEGV"]);
        let ending = ["--set", "faults.how=abort", "--set", "faults.when=destroy"];
        let ran = trial.run("update", plugin_as, &[&ending, given].concat());
        if flag == "-DSEARCH" {
            // Nothing is updated at a pose whose doubt is the plugin's own invention; the crash is told all the same.
            assert_eq!(ran.code, 12, "{}{}", ran.out, ran.err);
        }
        trial.ended(&ran, &["plugin faults crashed in destroy: "]);
    }
}

#[test]
fn a_plugin_that_crashes_as_it_is_opened_is_told_from_one_that_is_refused() {
    let Some(trial) = Trial::new("faults.c", &["-DAT_LOAD"]) else { return };
    for _ in 0..3 {
        // However often: nothing was asked of it yet, and what it needs may be missing.
        trial.ended(&trial.update("fine", "call", &[]), &["plugin faults crashed in load: ", "SIGABRT"]);
    }
}

#[test]
fn what_a_library_prints_does_not_reach_the_result() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    let ran = trial.localize("print", "call", &["--json"]);
    assert!([0, 22].contains(&ran.code), "{}", ran.err);
    assert!(serde_json::from_str::<serde_json::Value>(&ran.out).is_ok(), "{}", ran.out);
    assert!(!ran.err.contains("must not print"), "{}", ran.err);
}

#[test]
fn what_a_plugin_has_started_ends_with_it() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    let note = trial.bench.path("note");
    let setting = format!("faults.note={}", text(&note));
    trial.ended(&trial.update("fork", "call", &["--set", &setting]), &["SIGABRT"]);
    assert!(!is_running(&std::fs::read_to_string(&note).unwrap()));
}

#[test]
fn a_plugin_ends_with_its_host() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    let capture = street().path("capture/capture.json");
    let mut host = Command::new(env!("CARGO_BIN_EXE_resurvey"))
        .args(["localize", text(&trial.bench.path("map.rsv")), text(&capture), "--matcher", "faults"])
        .args(["--plugin-dir", text(&trial.bench.path("plugins")), "--allow-plugin", &trial.sha256])
        .args(["--set", "faults.how=hang", "--set", "faults.when=create"])
        .env("XDG_DATA_HOME", trial.bench.path("data"))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let plugin = waited(|| child_of(host.id())).expect("the process of the plugin starts");
    host.kill().unwrap();
    host.wait().unwrap();
    assert!(waited(|| (!is_running(&plugin)).then_some(())).is_some());
}

#[test]
fn ctrl_c_ends_a_run_and_its_plugin_and_leaves_the_map() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    let capture = street().path("capture/capture.json");
    let host = Command::new(env!("CARGO_BIN_EXE_resurvey"))
        .args(["update", text(&trial.bench.path("map.rsv")), text(&capture), "--matcher", "faults"])
        .args(["--plugin-dir", text(&trial.bench.path("plugins")), "--allow-plugin", &trial.sha256])
        .args(NARROW)
        .args(["--set", "faults.how=hang", "--set", "faults.when=call"])
        .env("XDG_DATA_HOME", trial.bench.path("data"))
        .env("TMPDIR", trial.bench.path("tmp"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let plugin = waited(|| child_of(host.id())).expect("the process of the plugin starts");
    let started = Instant::now();
    assert!(Command::new("kill").args(["-INT", &host.id().to_string()]).status().unwrap().success());
    let ended = host.wait_with_output().unwrap();
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let ran = Ran { code: ended.status.code().unwrap_or(-1), out: words(&ended.stdout), err: words(&ended.stderr) };
    assert_eq!((ran.code, ran.out.as_str()), (130, ""), "{}", ran.err);
    assert!(ran.err.contains("interrupted") && ran.err.contains("is not in the map"), "{}", ran.err);
    assert!(started.elapsed() < Duration::from_secs(30));
    assert!(trial.bench.is_unchanged());
    assert!(!is_running(&plugin));
}

/// What `look` finds within some seconds.
fn waited<T>(look: impl Fn() -> Option<T>) -> Option<T> {
    let started = Instant::now();
    loop {
        match look() {
            None if started.elapsed() < Duration::from_secs(20) => std::thread::sleep(Duration::from_millis(5)),
            found => return found,
        }
    }
}

/// A process whose parent is `host`.
fn child_of(host: u32) -> Option<String> {
    let processes = std::fs::read_dir("/proc").ok()?.flatten().map(|entry| entry.file_name());
    let numbers = processes.filter_map(|name| name.into_string().ok());
    let parent = format!("PPid:\t{host}");
    numbers.into_iter().find(|number| {
        let status = std::fs::read_to_string(format!("/proc/{number}/status")).unwrap_or_default();
        status.lines().any(|line| line == parent)
    })
}

#[test]
fn two_crashes_quarantine_the_file_until_they_are_forgotten() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    trial.ended(&trial.update("segv", "call", &[]), &["crashed in score"]);
    let ran = trial.localize("fine", "call", &[]);
    assert!([0, 22].contains(&ran.code), "one crash is not enough: {}", ran.err);
    trial.ended(&trial.update("abort", "create", &[]), &["crashed in create"]);
    let remove = format!("resurvey plugins remove {}", trial.sha256);
    let words = ["refused libfaults.so at quarantine: its process crashed 2 times, in score and create", &remove];
    trial.ended(&trial.update("fine", "call", &[]), &words);
    trial.ended(&trial.update("fine", "call", &["--in-process"]), &words);
    for words in [
        &["plugins", "remove", &trial.sha256][..],
        &["plugins", "install", "--no-check", text(&trial.bench.path("plugins/libfaults.so"))],
    ] {
        let trusted = Command::new(env!("CARGO_BIN_EXE_resurvey"))
            .args(words)
            .env("XDG_DATA_HOME", trial.bench.path("data"))
            .output()
            .unwrap();
        assert!(trusted.status.success(), "{}", String::from_utf8_lossy(&trusted.stderr));
        let ran = trial.localize("fine", "call", &[]);
        assert!([0, 22].contains(&ran.code), "{}", ran.err);
        trial.localize("segv", "call", &[]);
        trial.localize("segv", "call", &[]);
        trial.ended(&trial.update("fine", "call", &[]), &["at quarantine"]);
    }
}

#[test]
fn in_process_is_for_those_who_ask_for_it() {
    let Some(trial) = Trial::new("faults.c", &[]) else { return };
    let ran = trial.localize("fine", "call", &["--in-process"]);
    assert!([0, 22].contains(&ran.code), "{}", ran.err);
    // Its exit is that of the program: what a process of its own is for.
    assert_eq!(trial.localize("exit", "call", &["--in-process"]).code, 0);
}

const DECLARATION: &str = r##"#!/bin/sh
# resurvey-plugin: {"wire": 1, "kind": "matcher", "name": "faults", "version": "1", "summary": "A script"}
"##;
const HELLO: &str = r#"echo '{"hello": {"wire": 1, "name": "faults", "version": "1", "kind": "matcher", "summary": "A script", "form": "score"}}'
"#;

#[test]
fn an_executable_that_does_not_speak_the_wire_is_told_what_it_said() {
    for (lines, words) in [
        ("echo Loading the model", &["broke the wire in load", "\"Loading the model\""][..]),
        ("printf 'half a line'", &["broke the wire in load", "\"half a line\"", "in the middle of a line"]),
        ("echo '{\"done\": {}}'; sleep 9", &["broke the wire in load", "belongs to this call", "done"]),
        ("exit 3", &["crashed in load", "exit code 3"]),
        ("echo no interpreter >&2; exit 1", &["crashed in load", "its last words: no interpreter"]),
        ("head -c 2000000 /dev/zero", &["broke the wire in load"]),
    ] {
        let trial = Trial::script(&format!("{DECLARATION}{lines}\n"));
        trial.ended(&trial.run("update", "--matcher", &NARROW), &[&["plugin faults "], words].concat());
    }
    let trial = Trial::script(&format!("{DECLARATION}{HELLO}echo oops\nsleep 9\n"));
    trial.ended(&trial.run("update", "--matcher", &NARROW), &["broke the wire in create", "\"oops\""]);
    let trial = Trial::script(&format!("{DECLARATION}{}", HELLO.replace("A script", "Another")));
    trial.ended(&trial.run("update", "--matcher", &NARROW), &["its hello says summary \"Another\""]);
}

#[test]
fn an_executable_that_cannot_be_started_is_refused_and_has_not_crashed() {
    let trial = Trial::script(&DECLARATION.replace("/bin/sh", "/no/such/interpreter"));
    for _ in 0..3 {
        let words = ["refused resurvey-plugin-faults at file: it cannot be started: ", "interpreter", "its first line"];
        trial.ended(&trial.run("update", "--matcher", &NARROW), &words);
    }
}

#[test]
fn an_executable_runs_only_when_it_is_allowed() {
    let mut trial = Trial::script(&format!("{DECLARATION}touch ran\n"));
    trial.sha256 = "0".repeat(64);
    trial.ended(&trial.run("update", "--matcher", &NARROW), &["not on the list of allowed plugins"]);
    restrict(&trial.bench.path("plugins/resurvey-plugin-faults"), 0o644);
    trial.sha256 = sha256(&std::fs::read(trial.bench.path("plugins/resurvey-plugin-faults")).unwrap());
    trial.ended(&trial.run("update", "--matcher", &NARROW), &["at permissions", "chmod u+x"]);
    assert!(!Path::new("ran").exists());
}

/// The share of pixels whose class is the same, in nothing but the standard library.
const AGREEMENT: &str = r##"#!/usr/bin/env python3
# resurvey-plugin: {"wire": 1, "kind": "matcher", "name": "faults", "version": "1", "summary": "Share of equal pixels"}
import json, mmap, os, socket, struct
wire = socket.socket(fileno=os.dup(1)); os.dup2(2, 1)
lines, memory = wire.makefile("r"), mmap.mmap(os.dup(0), 0)
say = lambda message: wire.sendall((json.dumps(message) + "\n").encode())
say({"hello": {"wire": 1, "name": "faults", "version": "1", "kind": "matcher", "summary": "Share of equal pixels",
               "form": "score", "settings_schema": ""}})
print("this goes to the host's pipe")
for line in lines:
    (name, body), = json.loads(line).items()
    if name == "score":
        if body["memory"] > len(memory): memory = mmap.mmap(0, body["memory"])
        photo, labels = body["photo"], body["views"]["labels"]
        size = photo["shape"][0] * photo["shape"][1]
        a = memory[photo["offset"]:photo["offset"] + size]
        for view in range(labels["shape"][0]):
            at = labels["offset"] + view * labels["strides"][0]
            same = sum(x == y for x, y in zip(a, memory[at:at + size]) if x != 255)
            score = same / sum(x != 255 for x in a)
            struct.pack_into("<d", memory, body["scores"]["offset"] + 8 * view, score)
    say({"done": {}})
"##;

#[test]
fn a_matcher_in_python_scores_as_the_one_in_c() {
    if Command::new("python3").arg("--version").output().is_err() {
        let _ = writeln!(std::io::stderr(), "SKIPPED: no python3; a plugin in Python was not tested");
        return;
    }
    let Some(c) = Trial::new("matcher.c", &["-DNOTHING"]) else { return };
    let python = Trial::script(AGREEMENT);
    let narrow = ["--set", "search.radius_m=4", "--set", "search.yaw_range_deg=4", "--json"];
    let in_python = python.run("localize", "--matcher", &narrow);
    let in_c = Command::new(env!("CARGO_BIN_EXE_resurvey"))
        .args(["localize", text(&c.bench.path("map.rsv")), text(&street().path("capture/capture.json"))])
        .args(["--plugin-dir", text(&c.bench.path("plugins")), "--allow-plugin", &c.sha256, "--matcher", "agreement"])
        .args(narrow)
        .output()
        .unwrap();
    let document = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).unwrap();
    let (in_python, in_c) = (document(in_python.out.as_bytes()), document(&in_c.stdout));
    for key in ["pose", "score", "covariance", "candidates"] {
        assert_eq!(in_python[key], in_c[key], "{key}");
    }
}
