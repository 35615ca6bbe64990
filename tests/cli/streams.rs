//! A reader that goes away and a disk that is full: what was to be written is written to the map, and the code says how
//! that ended.

use crate::bench::{Bench, Run, resurvey, street, text};
use crate::change_sets::{chair, furnished, set};
use serde_json::json;
use std::io::{self, ErrorKind, Write};

/// Standard output that fails at the first byte.
struct Broken(ErrorKind);

impl Write for Broken {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(self.0.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Runs `resurvey COMMAND map.rsv ARGUMENTS` with standard output that fails like this.
fn run(bench: &Bench, how: ErrorKind, command: &str, arguments: &[&str]) -> Run {
    let (map, mut err) = (bench.path("map.rsv"), Vec::new());
    let words = ["resurvey", command, text(&map)].into_iter().chain(arguments.iter().copied());
    let host = resurvey::Host { program: Some(env!("CARGO_BIN_EXE_resurvey").into()), ..Default::default() };
    let code = resurvey::run_as(host, words, &mut Broken(how), &mut err);
    Run { code, out: String::new(), err: String::from_utf8(err).unwrap() }
}

#[test]
fn a_reader_that_goes_away_never_changes_the_exit_code() {
    let bench = furnished();
    let stale = bench.file("stale.jsonl", set(Some(1), &[json!({"op": "remove", "fid": 9, "before": chair()})]));
    for (command, words, code) in [
        ("apply", &[stale.as_str()][..], 21),
        ("apply", &[&stale, "--json"], 21),
        ("apply", &["/nowhere.jsonl"], 10),
        ("revert", &["0", "--json"], 20),
        ("query", &["--at", "9"], 11),
        ("query", &[], 0),
        ("log", &["--json"], 0),
    ] {
        let run = run(&bench, ErrorKind::BrokenPipe, command, words);
        assert_eq!(run.code, code, "{command} {words:?}: {}", run.err);
        assert!(!run.err.contains("standard output"), "{}", run.err);
    }
    let map = bench.path("map.rsv");
    rusqlite::Connection::open(&map).unwrap().execute_batch("CREATE TABLE strange (x)").unwrap();
    assert_eq!(run(&bench, ErrorKind::BrokenPipe, "fsck", &[]).code, 13);
    assert_eq!(run(&bench, ErrorKind::BrokenPipe, "fsck", &["--json"]).code, 13);
}

#[test]
fn a_reader_that_goes_away_does_not_stop_the_captures_that_follow() {
    let bench = Bench::with_street();
    let (capture, reports) = (street().path("capture/capture.json"), bench.path("reports"));
    let quick = ["--set", "semantic.radius_m=2", "--set", "gate.min_score=1", "--report", text(&reports)];
    let words = [&[text(&capture), text(&capture)], &quick[..]].concat();
    assert_eq!(run(&bench, ErrorKind::BrokenPipe, "update", &words).code, 22);
    assert!(std::fs::read_to_string(reports.join("index.html")).unwrap().contains("2 captures"));
}

#[test]
fn a_version_whose_result_cannot_be_written_is_named_with_exit_10() {
    let bench = furnished();
    let file = bench.file("set.jsonl", set(None, &[json!({"op": "add", "after": chair()})]));
    let applied = run(&bench, ErrorKind::StorageFull, "apply", &[&file]);
    assert_eq!((applied.code, bench.head()), (10, 2), "{}", applied.err);
    assert!(applied.err.contains("version 2 was committed; standard output: "), "{}", applied.err);
    let reverted = run(&bench, ErrorKind::StorageFull, "revert", &["2", "--json"]);
    assert!(reverted.err.contains("version 3 was committed; standard output: "), "{}", reverted.err);
    // What was refused is refused, whoever hears it.
    let refused = run(&bench, ErrorKind::StorageFull, "revert", &["0"]);
    assert_eq!(refused.code, 20, "{}", refused.err);
    let log = run(&bench, ErrorKind::StorageFull, "log", &[]);
    assert_eq!(log.code, 10);
    assert!(log.err.starts_with("resurvey: standard output: "), "{}", log.err);
    assert_eq!(bench.head(), 3);
}

#[cfg(unix)]
#[test]
fn the_program_itself_survives_a_closed_pipe() {
    let bench = furnished();
    let (reader, writer) = io::pipe().unwrap();
    drop(reader);
    let file = bench.file("set.jsonl", set(Some(1), &[json!({"op": "remove", "fid": 9, "before": chair()})]));
    let map = bench.path("map.rsv");
    let status = std::process::Command::new(env!("CARGO_BIN_EXE_resurvey"))
        .args(["apply", text(&map), &file, "--json"])
        .stdout(writer)
        .stderr(std::process::Stdio::null())
        .status();
    assert_eq!(status.unwrap().code(), Some(21));
    resurvey(&["fsck", text(&map)]).ok();
}

/// Standard output that remembers what had come when it was flushed.
#[derive(Default)]
struct Flushed {
    text: Vec<u8>,
    at_flush: Vec<String>,
}

impl Write for Flushed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.text.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.at_flush.push(String::from_utf8_lossy(&self.text).into_owned());
        Ok(())
    }
}

#[test]
fn a_capture_is_told_before_the_next_one_is_worked_on() {
    let bench = Bench::with_street();
    let (map, capture) = (bench.path("map.rsv"), street().path("capture/capture.json"));
    let quick = ["--set", "semantic.radius_m=2", "--set", "gate.min_score=1"];
    let words = [&["resurvey", "update", text(&map), text(&capture), text(&capture)], &quick[..]].concat();
    let mut out = Flushed::default();
    assert_eq!(resurvey::run(words, &mut out, &mut Vec::new()), 22);
    let told: Vec<usize> = out.at_flush.iter().map(|text| text.matches("capture.json: unreliable").count()).collect();
    assert_eq!(told, [1, 2, 2]);
}
