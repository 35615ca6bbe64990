//! `docs/cli.md` names all that the program has.

use crate::bench::{Bench, resurvey, street, text};
use crate::evaluate::suite;
use serde_json::Value;
use std::collections::BTreeSet;

const PAGE: &str = include_str!("../../docs/cli.md");

/// Names of the subcommands that `words --help` lists.
fn subcommands(words: &[&str]) -> Vec<String> {
    let help = resurvey(&[words, &["--help"]].concat()).ok().out;
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let rows = listed.take_while(|line| !line.is_empty()).filter(|line| !line.starts_with("   "));
    rows.filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect()
}

/// Long options in the help of `words`.
fn options(words: &[&str]) -> Vec<String> {
    let help = resurvey(&[words, &["--help"]].concat()).ok().out;
    let starts = help
        .lines()
        .map(str::trim_start)
        .filter(|line| line.starts_with("--") || line.starts_with("-n,") || line.starts_with("-v,"));
    let long = starts
        .filter_map(|line| line.split(|c: char| c.is_whitespace() || c == ',').find(|word| word.starts_with("--")));
    long.map(|word| word.trim_end_matches(|c: char| !c.is_alphanumeric()).to_owned()).collect()
}

#[test]
fn the_page_names_every_command_and_every_option() {
    let commands = subcommands(&[]);
    assert!(commands.len() >= 14, "{commands:?}");
    let mut missing = Vec::new();
    for command in &commands {
        if !PAGE.contains(&format!("`{command} ")) {
            missing.push(command.clone());
        }
        if command == "help" {
            continue;
        }
        let mut lines = vec![vec![command.as_str()]];
        let below = subcommands(&[command]);
        for sub in below.iter().filter(|sub| *sub != "help") {
            if !PAGE.contains(&format!("`{command} {sub}")) {
                missing.push(format!("{command} {sub}"));
            }
            lines.push(vec![command, sub]);
        }
        for words in lines {
            let found = options(&words);
            assert!(found.len() >= 4, "{words:?} has at least --json, --plugin-dir, --allow-plugin, --help: {found:?}");
            missing.extend(found.into_iter().filter(|option| !PAGE.contains(option.as_str())));
        }
    }
    assert!(missing.is_empty(), "docs/cli.md says nothing of {missing:?}");
}

/// Keys anywhere in `value` but in the settings of a plugin, which `plugins info` documents.
fn keys(value: &Value, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                found.insert(key.clone());
                if !key.starts_with("settings") {
                    keys(value, found);
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| keys(value, found)),
        _ => {}
    }
}

#[test]
fn the_page_names_every_key_of_every_document() {
    let (bench, updated) = Bench::with_banner();
    let fid = updated["changes"][0]["fid"].to_string();
    let capture = street().path("capture/capture.json");
    let (pose, view, out) = (street().path("pose.json"), bench.path("view"), bench.path("out.glb"));
    let documents = [
        updated,
        bench.json("query", &["--wgs84"]),
        bench.json("log", &[]),
        bench.json("why", &[&fid]),
        bench.json("fsck", &[]),
        bench.json("fsck", &["--repair"]),
        bench.json("gc", &[]),
        bench.json("diff", &["1..2"]),
        bench.json("export", &["--diff", "1..2", text(&out)]),
        bench.run("localize", &[text(&capture), "--set", "semantic.radius_m=2", "--json"]).json(),
        bench.json("render", &["--pose", text(&pose), "--out", text(&view)]),
        bench.json("export", &[text(&out)]),
        bench.json("import", &[text(&out)]),
        resurvey(&["init", text(&bench.path("new.rsv")), "--json"]).ok().json(),
        resurvey(&["eval", "table-v", "--json"]).ok().json(),
        resurvey(&["plugins", "list", "--json"]).ok().json(),
        resurvey(&["plugins", "info", "semantic", "--json"]).ok().json(),
        resurvey(&["man", text(&bench.path("man")), "--json"]).ok().json(),
        // One matcher against itself has every key of a comparison.
        resurvey(&["eval", text(suite()), "--matcher", "prior", "--matcher", "prior", "--updates", "--json"])
            .ok()
            .json(),
    ];
    let reviewed = Bench::with_street();
    let proposed = [text(&capture), "--pose", text(&pose), "--propose"];
    let reviews = [
        reviewed.json("update", &proposed),
        reviewed.json("proposals", &["show", "1"]),
        reviewed.json("proposals", &["accept", "1"]),
        reviewed.json("proposals", &["list", "--all"]),
        reviewed.json("tag", &["surveyed"]),
        reviewed.json("tag", &[]),
        reviewed.json("revert", &["head"]),
        reviewed.run("revert", &["2", "--json"]).json(),
    ];
    let mut found = BTreeSet::new();
    reviews.iter().for_each(|document| keys(document, &mut found));
    documents.iter().for_each(|document| keys(document, &mut found));
    assert!(found.len() > 80, "{found:?}");
    // Code or a quoted key.
    found.retain(|key| !PAGE.contains(&format!("\"{key}\"")) && !PAGE.contains(&format!("`{key}`")));
    assert!(found.is_empty(), "docs/cli.md says nothing of {found:?}");
}

#[test]
fn the_help_of_every_command_says_what_changes() {
    for command in [
        "init",
        "import",
        "localize",
        "render",
        "update",
        "query",
        "log",
        "diff",
        "revert",
        "tag",
        "why",
        "proposals",
        "changes",
        "apply",
        "export",
        "eval",
        "fsck",
        "gc",
    ] {
        let help = resurvey(&[command, "--help"]).ok().out;
        let first = help.lines().next().unwrap();
        let words = ["changes", "new version", "map file", "writes"];
        assert!(words.iter().any(|word| first.contains(word)), "{command}: {first}");
    }
}
