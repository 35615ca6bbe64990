//! What a map says, to compare two of them.

use crate::common::{Answer, path, resurvey};
use serde_json::Value;
use std::path::Path;

/// The newest version of a map and everything in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Observed {
    /// The newest version.
    pub head: u64,
    /// What each version from 0 holds; null where it is forgotten.
    pub states: Vec<Value>,
}

impl Observed {
    /// Of a map that is whole.
    pub fn of(map: &Path) -> Self {
        let answer = run("fsck", map, &[]);
        assert_eq!((answer.code, &answer.json["ok"]), (0, &Value::Bool(true)), "{answer:?}");
        Self::without_check(map).unwrap_or_else(|answer| panic!("{answer:?}"))
    }

    /// Of a map that may not be, or the first answer that is not one.
    pub fn without_check(map: &Path) -> Result<Self, Answer> {
        let log = run("log", map, &["-n", "1"]);
        if log.code != 0 {
            return Err(log);
        }
        let head = log.json["versions"][0]["version"].as_u64().unwrap();
        let mut states = Vec::new();
        for version in 0..=head {
            let answer = run("query", map, &["--at", &version.to_string()]);
            match answer.code {
                0 => states.push(answer.json["features"].clone()),
                11 if answer.messages.contains("was forgotten") => states.push(Value::Null),
                _ => return Err(answer),
            }
        }
        Ok(Self { head, states })
    }
}

/// Runs `resurvey COMMAND MAP ARGUMENTS --json`.
pub fn run(command: &str, map: &Path, arguments: &[&str]) -> Answer {
    resurvey(&[&[command, path(map)], arguments].concat())
}
