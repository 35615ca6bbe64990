//! Rules about packages: who depends on whom, and under which licences.

use crate::rules::Broken;
use serde_json::Value;
use std::process::Command;

/// What `cargo metadata` says about this machine's build, without network.
pub fn metadata() -> Value {
    let cargo = || Command::new(env!("CARGO"));
    let version = cargo().arg("-vV").output().expect("cargo runs");
    let text = String::from_utf8_lossy(&version.stdout).into_owned();
    let host = text.lines().find_map(|line| line.strip_prefix("host: ")).expect("cargo names its host");
    let output = cargo()
        .args(["metadata", "--format-version", "1", "--locked", "--offline", "--filter-platform", host])
        .current_dir(crate::source::root())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "cargo metadata: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("cargo prints JSON")
}

/// The arrows of `docs/architecture.md`: package, and the packages of this workspace that it is built from.
pub const ARROWS: [(&str, &[&str]); 14] = [
    (
        "resurvey",
        &[
            "resurvey-aligned",
            "resurvey-class-difference",
            "resurvey-core",
            "resurvey-descriptors",
            "resurvey-edges",
            "resurvey-palette",
            "resurvey-pixel",
            "resurvey-schema",
            "resurvey-semantic",
            "resurvey-silhouette",
            "resurvey-skyline",
        ],
    ),
    ("resurvey-aligned", &["resurvey-class-difference", "resurvey-plugin"]),
    ("resurvey-class-difference", &["resurvey-plugin"]),
    ("resurvey-core", &["resurvey-schema"]),
    ("resurvey-descriptors", &["resurvey-plugin"]),
    ("resurvey-fixtures", &["resurvey-plugin"]),
    ("resurvey-plugin", &["resurvey-schema"]),
    ("resurvey-schema", &[]),
    ("resurvey-semantic", &["resurvey-plugin"]),
    ("resurvey-edges", &["resurvey-plugin"]),
    ("resurvey-palette", &["resurvey-plugin"]),
    ("resurvey-pixel", &["resurvey-plugin"]),
    ("resurvey-silhouette", &["resurvey-plugin"]),
    ("resurvey-skyline", &["resurvey-plugin"]),
];

/// Arrows that are drawn and not there, or there and not drawn; and what `schema` takes from outside.
pub fn wrong_arrows(metadata: &Value, drawn: &[(&str, &[&str])]) -> Broken {
    let packages = own_packages(metadata);
    let own: Vec<&str> = packages.iter().map(|package| text(package, "name")).collect();
    let mut broken = Vec::new();
    for package in &packages {
        let name = text(package, "name");
        let built_from =
            package["dependencies"].as_array().into_iter().flatten().filter(|dependency| dependency["kind"].is_null());
        let built_from: Vec<&str> = built_from.map(|dependency| text(dependency, "name")).collect();
        let mut found: Vec<&str> = built_from.iter().copied().filter(|name| own.contains(name)).collect();
        found.sort_unstable();
        match drawn.iter().find(|(drawn, _)| *drawn == name) {
            None => broken.push(format!("{name}: a package that docs/architecture.md does not draw")),
            Some((_, expected)) if found != *expected => {
                broken.push(format!("{name}: expected to depend on {expected:?}, found {found:?}"));
            }
            Some(_) => {}
        }
        if name == "resurvey-schema" {
            let others = built_from.iter().filter(|other| **other != "serde");
            broken.extend(others.map(|other| format!("resurvey-schema: depends on {other}; only serde is allowed")));
        }
    }
    let gone = drawn.iter().filter(|(drawn, _)| !own.contains(drawn));
    broken.extend(gone.map(|(drawn, _)| format!("{drawn}: drawn, but no package")));
    broken
}

/// Every package of the build may be used, changed and shipped by anyone.
pub fn licences_that_bind(metadata: &Value) -> Broken {
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let bad = packages.filter(|package| !is_permissive(text(package, "license")));
    bad.map(|package| format!("{}: licence {:?} is not permissive", text(package, "name"), text(package, "license")))
        .collect()
}

fn own_packages(metadata: &Value) -> Vec<&Value> {
    metadata["packages"].as_array().into_iter().flatten().filter(|package| package["source"].is_null()).collect()
}

fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or_default()
}

/// Whether an SPDX expression can be met with permissive licences alone: `OR` needs one side, `AND` both.
pub fn is_permissive(expression: &str) -> bool {
    const LICENCES: [&str; 13] = [
        "MIT",
        "MIT-0",
        "Apache-2.0",
        "Apache-2.0 WITH LLVM-exception",
        "BSD-2-Clause",
        "BSD-3-Clause",
        "ISC",
        "Zlib",
        "0BSD",
        "BSL-1.0",
        "CC0-1.0",
        "Unicode-3.0",
        "Unlicense",
    ];
    let expression = expression.trim();
    if let Some(parts) = split_outside_brackets(expression, &[" OR ", "/"]) {
        return parts.into_iter().any(is_permissive);
    }
    if let Some(parts) = split_outside_brackets(expression, &[" AND "]) {
        return parts.into_iter().all(is_permissive);
    }
    match expression.strip_prefix('(').and_then(|inner| inner.strip_suffix(')')) {
        Some(inner) => is_permissive(inner),
        None => LICENCES.contains(&expression),
    }
}

/// The parts between any of `words` outside brackets; `None` when there is only one.
fn split_outside_brackets<'a>(text: &'a str, words: &[&str]) -> Option<Vec<&'a str>> {
    let (mut parts, mut depth, mut start, mut at) = (Vec::new(), 0_i32, 0, 0);
    while at < text.len() {
        match text.as_bytes()[at] {
            b'(' => depth += 1,
            b')' => depth -= 1,
            _ => {}
        }
        let word = words.iter().find(|word| depth == 0 && text[at..].starts_with(**word));
        if let Some(word) = word {
            parts.push(&text[start..at]);
            start = at + word.len();
        }
        at += word.map_or(1, |word| word.len());
    }
    parts.push(&text[start..]);
    (parts.len() > 1).then_some(parts)
}
