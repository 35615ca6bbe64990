//! Plugins that are programs: their declaration is a line of text in the file, read before anything runs.

use super::declaration::{Declared, Fault, allowed_name};
use super::error::Stage;
use super::info::Kind;
use resurvey_schema::abi::HEADER_BYTES;
use resurvey_schema::wire::{DECLARATION, EXECUTABLE_PREFIX, WIRE_VERSION};
use serde::Deserialize;
use std::path::Path;

/// What the line says.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    wire: u32,
    kind: String,
    name: String,
    version: String,
    summary: String,
}

/// Whether a file of this name in a directory of plugins is one that is a program.
pub(super) fn is_named_executable(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(EXECUTABLE_PREFIX))
}

/// The declaration in `bytes`; `None` when there is no such line.
pub(super) fn read_executable(bytes: &[u8]) -> Option<Result<Declared, Fault>> {
    let mark = format!("{DECLARATION}{{");
    let at = bytes.windows(mark.len()).position(|window| window == mark.as_bytes())?;
    let object = &bytes[at + DECLARATION.len()..];
    let line = object.split(|byte| *byte == b'\n').next().unwrap_or_default();
    // In a binary more bytes follow the object; in a script the line ends with it.
    let mut objects = serde_json::Deserializer::from_slice(line).into_iter::<Line>();
    Some(match objects.next() {
        Some(Ok(line)) => declared(line),
        Some(Err(error)) => Err(fault(Stage::Header, format!("its line {DECLARATION:?} cannot be read: {error}"))),
        None => Err(fault(Stage::Header, format!("its line {DECLARATION:?} is empty"))),
    })
}

fn declared(line: Line) -> Result<Declared, Fault> {
    if line.wire != WIRE_VERSION {
        let reason = format!("plugin speaks wire {}, this host speaks {WIRE_VERSION}", line.wire);
        return Err((Stage::Abi, reason, "upgrade resurvey, or install a build for this wire".to_owned()));
    }
    if !allowed_name(&line.name) {
        return Err(fault(Stage::Header, format!("expected a name of a–z, 0–9 and dashes, found {:?}", line.name)));
    }
    let kinds = [Kind::Matcher, Kind::Detector, Kind::Estimator, Kind::Segmenter];
    let Some(kind) = kinds.into_iter().find(|kind| kind.to_string() == line.kind) else {
        let known = "matcher, detector, estimator and segmenter";
        let reason = format!("plugin is of kind {:?}, this host knows {known}", line.kind);
        return Err((Stage::Abi, reason, "upgrade resurvey".to_owned()));
    };
    let texts = [("version", &line.version), ("summary", &line.summary)];
    if let Some((what, _)) = texts.into_iter().find(|(_, text)| text.chars().any(char::is_control)) {
        return Err(fault(Stage::Header, format!("its {what} is not a line of text")));
    }
    let Line { name, version, summary, .. } = line;
    Ok(Declared { symbol: String::new(), header: [0; HEADER_BYTES], kind, name, version, summary })
}

fn fault(stage: Stage, reason: String) -> Fault {
    (stage, reason, "look at \"Executables\" in docs/plugin-wire.md".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r##"#!/usr/bin/env python3
# resurvey-plugin: {"wire": 1, "kind": "matcher", "name": "sky", "version": "1", "summary": "Compares skies"}
print("ran")
"##;

    #[test]
    fn a_script_says_in_a_comment_what_it_is() {
        let declared = read_executable(GOOD.as_bytes()).unwrap().unwrap();
        assert_eq!((declared.name.as_str(), declared.kind, declared.version.as_str()), ("sky", Kind::Matcher, "1"));
        assert!(declared.is_executable());
        let line = GOOD.lines().nth(1).unwrap();
        let binary = [b"\x7fELF\0\0".as_slice(), line.as_bytes(), b"\0\xff\xfe\n"].concat();
        assert!(read_executable(&binary).unwrap().is_ok());
        assert!(read_executable(b"#!/bin/sh\necho hello").is_none());
    }

    #[test]
    fn a_declaration_that_cannot_be_used_says_why() {
        for (from, to, stage, words) in [
            ("\"wire\": 1", "\"wire\": 2", Stage::Abi, "speaks wire 2"),
            ("matcher", "painter", Stage::Abi, "of kind \"painter\""),
            ("\"sky\"", "\"Sky\"", Stage::Header, "found \"Sky\""),
            ("\"version\": \"1\"", "\"versions\": 1", Stage::Header, "cannot be read"),
            ("\"version\": \"1\"", "\"version\": \"1\\n2\"", Stage::Header, "its version is not a line"),
        ] {
            let text = GOOD.replace(from, to);
            let (found, reason, _) = read_executable(text.as_bytes()).unwrap().unwrap_err();
            assert_eq!(found, stage, "{reason}");
            assert!(reason.contains(words), "{reason}");
        }
    }
}
