//! Rules about README, `docs` and the pinned DDL.

use crate::rules::Broken;
use crate::source::Source;
use sha2::{Digest, Sha256};
use std::path::Path;

/// Relative links of Markdown files lead to a file, and their anchors to a heading.
pub fn dead_links(sources: &[Source], exists: impl Fn(&str) -> bool) -> Broken {
    let mut broken = Vec::new();
    for source in sources.iter().filter(|source| source.path.ends_with(".md")) {
        let folder = Path::new(&source.path).parent().unwrap_or(Path::new(""));
        for (line, target) in links(&source.text) {
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let path = if file.is_empty() { source.path.clone() } else { normal(&folder.join(file)) };
            if !exists(&path) {
                broken.push(format!("{}:{line}: dead link {target}", source.path));
            } else if let Some(page) = sources.iter().find(|page| page.path == path).filter(|_| !anchor.is_empty())
                && !headings(&page.text).contains(&anchor.to_owned())
            {
                broken.push(format!("{}:{line}: {path} has no heading #{anchor}", source.path));
            }
        }
    }
    broken
}

/// Line and target of every relative link outside code.
fn links(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut in_fence = false;
    for (index, line) in text.lines().enumerate() {
        in_fence ^= line.trim_start().starts_with("```");
        if in_fence {
            continue;
        }
        let prose: String = line.split('`').step_by(2).collect::<Vec<_>>().join("``");
        for part in prose.split("](").skip(1) {
            let target = part.split([')', ' ']).next().unwrap_or_default();
            let is_outside = target.contains("://") || target.starts_with("mailto:");
            if !is_outside {
                found.push((index + 1, target.to_owned()));
            }
        }
    }
    found
}

/// `a/b/../c` as `a/c`.
fn normal(path: &Path) -> String {
    let mut parts: Vec<String> = Vec::new();
    for part in path.components() {
        match part.as_os_str().to_string_lossy().as_ref() {
            "." => {}
            ".." if parts.last().is_some_and(|last| last != "..") => drop(parts.pop()),
            part => parts.push(part.to_owned()),
        }
    }
    parts.join("/")
}

/// Anchors of the headings, as GitHub makes them.
fn headings(text: &str) -> Vec<String> {
    let heading = |line: &str| {
        let title = line.trim_start_matches('#').trim().to_lowercase();
        let kept = title.chars().filter(|letter| letter.is_alphanumeric() || " -_".contains(*letter));
        kept.map(|letter| if letter == ' ' { '-' } else { letter }).collect()
    };
    text.lines().filter(|line| line.starts_with('#')).map(heading).collect()
}

/// Everything in the paper that has a number.
pub fn paper_items() -> Vec<String> {
    let equations = (1..=16).map(|number| format!("Eq. {number}"));
    let algorithms = (1..=3).map(|number| format!("Alg. {number}"));
    let tables = ["I", "II", "III", "IV", "V"].map(|number| format!("Table {number}"));
    equations.chain(algorithms).chain(tables).collect()
}

/// Every numbered item of the paper has a row `| item | what | function | test |`, whose cells name
/// `path/file.rs::item` that exist; the last one a test.
pub fn paper_map_gaps(map: &str, sources: &[Source]) -> Broken {
    let mut broken = Vec::new();
    for item in paper_items() {
        let row = map.lines().find(|line| line.split('|').nth(1).is_some_and(|cell| cell.trim() == item));
        let Some(row) = row else {
            broken.push(format!("docs/paper-map.md: no row for {item}"));
            continue;
        };
        let cells: Vec<&str> = row.split('|').collect();
        for (cell, kind) in [(3, "function"), (4, "test")] {
            let names = names(cells.get(cell).copied().unwrap_or_default());
            if names.is_empty() {
                broken.push(format!("docs/paper-map.md: {item} names no {kind}"));
            }
            for (path, name) in names {
                if !is_defined(sources, &path, &name, kind == "test") {
                    broken.push(format!("docs/paper-map.md: {item}: there is no {kind} {path}::{name}"));
                }
            }
        }
    }
    broken
}

/// The `path.rs::name` in backticks of a cell.
fn names(cell: &str) -> Vec<(String, String)> {
    let quoted = cell.split('`').skip(1).step_by(2);
    quoted
        .filter_map(|text| text.split_once(".rs::").map(|(path, name)| (format!("{path}.rs"), name.to_owned())))
        .collect()
}

fn is_defined(sources: &[Source], path: &str, name: &str, is_test: bool) -> bool {
    let Some(source) = sources.iter().find(|source| source.path == path) else { return false };
    let lines: Vec<&str> = source.text.lines().collect();
    let defines = |line: &str| {
        ["fn ", "struct ", "enum ", "trait ", "const "].into_iter().any(|keyword| {
            line.split_once(keyword).is_some_and(|(_, after)| {
                after
                    .strip_prefix(name)
                    .is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
            })
        })
    };
    lines.iter().enumerate().any(|(index, line)| {
        let mut above = lines[..index].iter().rev().map(|above| above.trim());
        let mut has_attribute = || {
            let mut attributes = above.by_ref().take_while(|above| above.starts_with("#[") || above.starts_with("//"));
            attributes.any(|above| above == "#[test]")
        };
        defines(line) && (!is_test || has_attribute())
    })
}

/// Every file of `schema/sql` has a line `sha256  name` with its digest, and every line its file.
pub fn unpinned_sql(files: &[Source], pins: &str) -> Broken {
    let digest = |source: &Source| {
        Sha256::digest(source.text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect::<String>()
    };
    let name = |source: &Source| source.path.rsplit('/').next().unwrap_or_default().to_owned();
    let lines: Vec<(&str, &str)> =
        pins.lines().filter(|line| !line.starts_with('#')).filter_map(|line| line.split_once("  ")).collect();
    let mut broken = Vec::new();
    for file in files {
        let line = format!("{}  {}", digest(file), name(file));
        match lines.iter().find(|(_, pinned)| *pinned == name(file)) {
            None => broken.push(format!("{}: not pinned; add to tests/tidy/sql.sha256: {line}", file.path)),
            Some((pin, _)) if *pin != digest(file) => {
                broken.push(format!("{}: changed after release; make a new numbered file (now {line})", file.path));
            }
            Some(_) => {}
        }
    }
    let missing = lines.iter().filter(|(_, pinned)| !files.iter().any(|file| name(file) == *pinned));
    broken.extend(missing.map(|(_, pinned)| format!("schema/sql/{pinned}: released, but gone")));
    broken
}
