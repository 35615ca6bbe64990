//! Plugins, completions, manual pages, and how the binary ends when nobody reads.

use crate::bench::{Bench, resurvey, street, text};
use std::io::Read;
use std::process::{Command, Stdio};

#[test]
fn the_built_in_plugins_are_listed_with_the_documented_keys() {
    let list = resurvey(&["plugins", "list", "--json"]).ok().json();
    let plugins = list["plugins"].as_array().unwrap();
    for (name, kind) in [
        ("semantic", "matcher"),
        ("skyline", "matcher"),
        ("pixel", "matcher"),
        ("silhouette", "matcher"),
        ("edges", "matcher"),
        ("class-difference", "detector"),
        ("aligned", "detector"),
        ("descriptors", "estimator"),
        ("palette", "segmenter"),
    ] {
        let plugin = plugins.iter().find(|plugin| plugin["name"] == name).unwrap();
        let keys: Vec<&String> = plugin.as_object().unwrap().keys().collect();
        assert_eq!(keys, ["name", "kind", "version", "summary", "sha256", "path", "builtin", "process"]);
        assert_eq!((&plugin["kind"], &plugin["builtin"]), (&kind.into(), &true.into()));
        assert!(plugin["path"].is_null() && plugin["sha256"].as_str().unwrap().len() == 64);
        let info = resurvey(&["plugins", "info", name, "--json"]).ok().json();
        assert_eq!((&info["name"], &info["sha256"]), (&plugin["name"], &plugin["sha256"]));
        assert!(info["settings_schema"]["properties"].is_object(), "{info}");
        let lines = resurvey(&["plugins", "info", name]).ok().out;
        assert!(lines.starts_with(&format!("{name} ")) && lines.contains(&format!("  {name}.")), "{lines}");
    }
    let table = resurvey(&["plugins", "list"]).ok().out;
    assert!(table.contains("semantic") && table.contains("built in"), "{table}");
}

#[test]
fn every_shell_gets_a_completion_script_with_the_commands() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = resurvey(&["completions", shell]).ok().out;
        for command in ["init", "import", "update", "plugins"] {
            assert!(script.contains(command), "{shell} has no {command}");
        }
    }
}

#[test]
fn every_command_gets_a_manual_page() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("a/man1");
    let document = resurvey(&["man", text(&out), "--json"]).ok().json();
    let files: Vec<&str> = document["files"].as_array().unwrap().iter().map(|file| file.as_str().unwrap()).collect();
    for page in ["resurvey.1", "resurvey-update.1", "resurvey-plugins-list.1"] {
        assert!(files.contains(&page), "{page} is not among {files:?}");
        let text = std::fs::read_to_string(out.join(page)).unwrap();
        assert!(text.contains(".TH") && text.contains("SYNOPSIS"), "{page}: {text}");
    }
    std::fs::write(directory.path().join("file"), "").unwrap();
    resurvey(&["man", text(&directory.path().join("file"))]).refused(10, &["file"]);
}

fn binary(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_resurvey"));
    command.args(words).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let map = street().path("plain.rsv");
    for words in [
        &["query", text(&map), "--json"][..],
        &["query", text(&map), "--format", "csv"],
        &["log", text(&map)],
        &["plugins", "list"],
        &["completions", "bash"],
        &["import", "--help"],
        &["--help"],
    ] {
        let mut child = binary(words).spawn().unwrap();
        drop(child.stdout.take());
        let mut messages = String::new();
        child.stderr.take().unwrap().read_to_string(&mut messages).unwrap();
        assert_eq!(
            (child.wait().unwrap().code(), messages.contains("pipe")),
            (Some(0), false),
            "{words:?}: {messages}"
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_under_the_output_is_said_and_is_not_exit_0() {
    let map = street().path("plain.rsv");
    for words in [&["query", text(&map), "--json"][..], &["--help"]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output = binary(words).stdout(full).output().unwrap();
        assert_eq!(output.status.code(), Some(10), "{words:?}");
        let messages = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(messages.contains("standard output"), "{words:?}: {messages}");
    }
}

#[test]
fn the_binary_exits_with_the_code_of_the_library() {
    let bench = Bench::with_street();
    let map = bench.path("map.rsv");
    let code = |words: &[&str]| binary(words).output().unwrap().status.code();
    assert_eq!(code(&["fsck", text(&map)]), Some(0));
    assert_eq!(code(&["updaet"]), Some(2));
    assert_eq!(code(&["import", text(&map), "/nowhere.3ds"]), Some(10));
    assert_eq!(code(&["fsck", "/nowhere.rsv"]), Some(11));
    assert_eq!(code(&["fsck", text(&street().path("pose.json"))]), Some(13));
}

#[test]
fn a_change_set_is_read_from_standard_input() {
    let bench = Bench::with_empty_map();
    let map = bench.path("map.rsv");
    let set = "{\"format\":\"resurvey.changes/1\",\"base_version\":null}\n\
               {\"op\":\"add\",\"after\":{\"class\":\"chair\",\"position\":[835600,817800,4.5]}}\n";
    let mut child = binary(&["apply", text(&map), "-"]).stdin(Stdio::piped()).spawn().unwrap();
    std::io::Write::write_all(&mut child.stdin.take().unwrap(), set.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(String::from_utf8_lossy(&output.stdout), "version 1: 1 added, 0 modified, 0 removed\n");
}
