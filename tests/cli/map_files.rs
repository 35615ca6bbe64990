//! Map files that are no maps, newer, damaged, read-only or in use: exit codes 11, 13 and 21.

use crate::bench::{Bench, noise, resurvey, street, text};
use jiff::Timestamp;
use resurvey_core::store::{History, MapFile};
use resurvey_core::version::VersionId;
use rusqlite::Connection;
use std::fs;
use std::process::Command;

/// Command lines that open a map, by their words after it; the last three write.
fn commands(bench: &Bench) -> Vec<Vec<String>> {
    let capture = text(&street().path("capture/capture.json")).to_owned();
    let pose = text(&street().path("pose.json")).to_owned();
    let model = text(&street().model("3ds")).to_owned();
    let changes = bench.file("set.jsonl", "{\"format\":\"resurvey.changes/1\",\"base_version\":null}\n");
    let out = |name: &str| text(&bench.path(name)).to_owned();
    let lines: [&[&str]; 11] = [
        &["query"],
        &["log"],
        &["why", "1"],
        &["fsck"],
        &["export", &out("out.glb")],
        &["render", "--pose", &pose, "--out", &out("view")],
        &["localize", &capture],
        &["update", &capture, "--pose", &pose, "--dry-run"],
        &["update", &capture, "--pose", &pose],
        &["import", &model],
        &["apply", &changes],
    ];
    lines.iter().map(|line| line.iter().map(|&word| word.to_owned()).collect()).collect()
}

/// Asserts that every command refuses the file called `name` and leaves it as it is.
fn refuse_all(bench: &Bench, name: &str, code: u8, words: &[&str]) {
    let path = bench.path(name);
    let before = fs::read(&path).ok();
    for line in commands(bench) {
        let mut words_of_line = vec![line[0].as_str(), text(&path)];
        words_of_line.extend(line[1..].iter().map(String::as_str));
        resurvey(&words_of_line).refused(code, &[&[name][..], words].concat());
        assert_eq!(fs::read(&path).ok(), before, "{line:?} changed {name}");
    }
    assert!(!bench.path("out.glb").exists() && !bench.path("view").exists());
}

#[test]
fn a_map_that_is_not_there_is_exit_11_and_is_not_made() {
    let bench = Bench::with_empty_map();
    refuse_all(&bench, "none.rsv", 11, &["no such map", "resurvey init"]);
    assert!(!bench.path("none.rsv").exists());
}

#[test]
fn a_file_that_is_no_map_is_exit_13_and_stays_as_it_is() {
    let bench = Bench::with_empty_map();
    bench.file("text.rsv", "a map, honestly");
    bench.file("empty.rsv", "");
    bench.file("random.rsv", noise(8192));
    Connection::open(bench.path("other.rsv"))
        .unwrap()
        .execute_batch("CREATE TABLE t (x); PRAGMA user_version = 1")
        .unwrap();
    fs::create_dir(bench.path("directory.rsv")).unwrap();
    for (name, word) in [
        ("text.rsv", "another kind of file"),
        ("empty.rsv", "an empty file"),
        ("random.rsv", "another kind of file"),
        ("other.rsv", "a SQLite database of another program"),
        ("directory.rsv", "a directory"),
    ] {
        refuse_all(&bench, name, 13, &["not a map", word]);
    }
}

#[test]
fn a_map_of_a_newer_format_is_exit_13_and_asks_for_an_upgrade() {
    let bench = Bench::with_street();
    Connection::open(bench.path("map.rsv")).unwrap().pragma_update(None, "user_version", 9999).unwrap();
    refuse_all(&bench, "map.rsv", 13, &["format 9999", "upgrade resurvey"]);
}

#[test]
fn a_map_cut_off_or_overwritten_inside_is_never_taken_for_whole() {
    let bench = Bench::with_street();
    let whole = fs::read(bench.path("map.rsv")).unwrap();
    bench.file("cut.rsv", &whole[..whole.len() / 2 + 100]);
    refuse_all(&bench, "cut.rsv", 13, &["damaged", "it ends after"]);
    // Every page but the first is noise.
    let page = usize::from(u16::from_be_bytes([whole[16], whole[17]]));
    let mut damaged = whole.clone();
    let length = damaged.len() - page;
    damaged[page..].copy_from_slice(&noise(length));
    bench.file("damaged.rsv", &damaged);
    for line in commands(&bench) {
        let path = bench.path("damaged.rsv");
        let words: Vec<&str> =
            [line[0].as_str(), text(&path)].into_iter().chain(line[1..].iter().map(String::as_str)).collect();
        let run = resurvey(&words);
        assert_eq!(run.code, 13, "{line:?}: {}{}", run.out, run.err);
    }
    // Whole pages are missing.
    bench.file("short.rsv", &whole[..page * 4]);
    let path = bench.path("short.rsv");
    let run = resurvey(&["fsck", text(&path), "--json"]);
    assert_eq!(run.code, 13, "{}{}", run.out, run.err);
}

#[test]
fn fsck_prints_what_is_wrong_and_exits_with_13() {
    let bench = Bench::with_street();
    let connection = Connection::open(bench.path("map.rsv")).unwrap();
    connection.execute_batch("PRAGMA foreign_keys = OFF; DELETE FROM geometry").unwrap();
    drop(connection);
    let run = bench.run("fsck", &["--json"]);
    assert_eq!(run.code, 13, "{}", run.err);
    assert_eq!(run.json()["ok"], false);
    assert!(!run.json()["problems"].as_array().unwrap().is_empty());
    assert!(bench.run("fsck", &[]).out.contains("problems"));
}

#[cfg(unix)]
#[test]
fn a_read_only_map_answers_and_refuses_to_be_written_with_exit_13() {
    use std::os::unix::fs::PermissionsExt;
    let bench = Bench::with_street();
    let set = |mode| fs::set_permissions(bench.path("map.rsv"), fs::Permissions::from_mode(mode)).unwrap();
    set(0o444);
    let lines = commands(&bench);
    for line in &lines[8..] {
        let words: Vec<&str> = line[1..].iter().map(String::as_str).collect();
        bench.refuses(&line[0], &words, 13, &["read-only", "can be written"]);
    }
    assert_eq!(bench.json("query", &[])["version"], 1);
    let words: Vec<&str> = lines[7][1..].iter().map(String::as_str).collect();
    bench.run("update", &words).ok();
    assert!(bench.is_unchanged());
    set(0o644);
}

#[test]
fn a_map_that_another_writes_is_exit_21_after_a_wait() {
    let bench = Bench::with_street();
    let writer = Connection::open(bench.path("map.rsv")).unwrap();
    writer.execute_batch("BEGIN IMMEDIATE").unwrap();
    let changes = bench.file(
        "set.jsonl",
        "{\"format\":\"resurvey.changes/1\",\"base_version\":null}\n\
         {\"op\":\"add\",\"after\":{\"class\":\"chair\",\"position\":[835600,817800,4.5]}}\n",
    );
    bench.refuses("apply", &[&changes], 21, &["another process is writing", "try again"]);
    let busy = bench.run("apply", &[&changes, "--json"]);
    assert_eq!((busy.code, busy.json()), (21, serde_json::json!({"decision": "busy", "version": null})));
    // Readers are not held up.
    assert_eq!(bench.json("query", &[])["version"], 1);
    writer.execute_batch("ROLLBACK").unwrap();
    drop(writer);
    bench.run("apply", &[&changes]).ok();
    assert_eq!(bench.head(), 2);
}

#[test]
fn a_map_that_one_process_has_open_twice_loses_nothing_to_another_process() {
    // POSIX takes all locks of a process from a file as soon as it closes one descriptor of it
    // (https://sqlite.org/howtocorrupt.html, 2.2). A process that ends then finds the map unused, and removes the log that
    // this one writes to.
    let bench = Bench::with_empty_map();
    let path = bench.path("map.rsv");
    let tag_elsewhere = |name: &str| {
        let run = Command::new(env!("CARGO_BIN_EXE_resurvey")).arg("tag").arg(&path).arg(name).output().unwrap();
        assert!(run.status.success());
    };
    let first = MapFile::open(&path).unwrap();
    drop(MapFile::open(&path).unwrap());
    drop(MapFile::open_read_only(&path).unwrap());
    tag_elsewhere("before");
    first.tag("during", VersionId(0), Timestamp::UNIX_EPOCH).unwrap();
    tag_elsewhere("after");
    drop(first);
    let tags = bench.json("tag", &[]);
    let names: Vec<&str> = tags["tags"].as_array().unwrap().iter().map(|tag| tag["tag"].as_str().unwrap()).collect();
    assert_eq!(names, ["after", "before", "during"]);
}

#[test]
fn a_file_too_damaged_to_open_is_told_by_fsck_as_any_damage() {
    let bench = Bench::with_street();
    let whole = fs::read(bench.path("map.rsv")).unwrap();
    let mut headless = whole.clone();
    headless[..100].fill(0);
    let files = [
        ("cut.rsv", &whole[..whole.len() / 2 + 100], "it ends after"),
        ("headless.rsv", &headless, "another kind of file"),
        ("empty.rsv", &[], "an empty file"),
    ];
    for (name, bytes, word) in files {
        let file = bench.file(name, bytes);
        for words in [&["fsck", file.as_str(), "--json"][..], &["fsck", &file, "--json", "--repair"]] {
            let run = resurvey(words);
            assert_eq!(run.code, 13, "{}", run.err);
            let document = run.json();
            let problem = document["problems"][0].as_str().unwrap();
            assert!(document["ok"] == false && problem.starts_with("file: ") && problem.contains(word), "{document}");
            assert!(!run.err.contains("resurvey fsck"), "fsck sends to itself: {}", run.err);
        }
    }
    let missing = resurvey(&["fsck", text(&bench.path("none.rsv")), "--json"]);
    missing.refused(11, &["no such map"]);
}
