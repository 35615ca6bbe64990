//! What a map says, to compare two of them.

use crate::common::{Answer, path, resurvey};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

/// The newest version of a map and everything in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Observed {
    /// The newest version.
    pub head: u64,
    /// What each version from 0 holds; null where it is forgotten.
    pub states: Vec<Value>,
    /// The log, tags, proposals with their evidence, what was there at some times, and the evidence of every descriptor.
    pub told: Vec<Value>,
}

/// Before, between and after what the maps of the tests saw.
const TIMES: [&str; 3] = ["2026-02-01", "2026-06-01T03:00:00Z", "2100-01-01"];

impl Observed {
    /// Of a map that is whole.
    pub fn of(map: &Path) -> Self {
        let answer = run("fsck", map, &[]);
        assert_eq!((answer.code, &answer.json["ok"]), (0, &Value::Bool(true)), "{answer:?}");
        Self::without_check(map).unwrap_or_else(|answer| panic!("{answer:?}"))
    }

    /// Of a map that may not be, or the first answer that is not one.
    pub fn without_check(map: &Path) -> Result<Self, Answer> {
        let log = answer(map, "log", &[])?;
        let head = log["versions"][0]["version"].as_u64().unwrap();
        let versions = (0..=head).map(|version| answer(map, "query", &["--at", &version.to_string()]));
        let states =
            versions.map(|state| state.map(|state| state["features"].clone())).collect::<Result<Vec<_>, _>>()?;
        let proposals = answer(map, "proposals", &["list", "--all"])?;
        let mut told = Vec::new();
        for proposal in proposals["proposals"].as_array().into_iter().flatten() {
            told.push(answer(map, "proposals", &["show", &proposal["id"].to_string()])?);
        }
        told.extend([log, answer(map, "tag", &[])?, proposals]);
        for time in TIMES {
            told.push(answer(map, "query", &["--observed-at", time])?);
        }
        let descriptors = states.iter().flat_map(|state| state.as_array().into_iter().flatten());
        let fids: BTreeSet<u64> =
            descriptors.filter(|one| one["kind"] != "object").filter_map(|one| one["fid"].as_u64()).collect();
        for fid in fids {
            told.push(answer(map, "why", &[&fid.to_string()])?);
        }
        Ok(Self { head, states, told })
    }

    /// Whether both say the same, but for the times at which the program ran.
    pub fn is(&self, other: &Self) -> bool {
        let timeless = |observed: &Self| {
            let mut told = observed.told.clone();
            told.iter_mut().for_each(without_run_times);
            (observed.head, observed.states.clone(), told)
        };
        timeless(self) == timeless(other)
    }
}

fn without_run_times(value: &mut Value) {
    match value {
        Value::Object(fields) => {
            fields.retain(|key, _| !["committed_at", "recorded_at", "proposed_at"].contains(&key.as_str()));
            fields.values_mut().for_each(without_run_times);
        }
        Value::Array(values) => values.iter_mut().for_each(without_run_times),
        _ => {}
    }
}

/// The document that answers; null where what is asked for is forgotten.
fn answer(map: &Path, command: &str, arguments: &[&str]) -> Result<Value, Answer> {
    let answer = run(command, map, arguments);
    match answer.code {
        0 => Ok(answer.json),
        11 if answer.messages.contains("forgotten") => Ok(Value::Null),
        _ => Err(answer),
    }
}

/// Runs `resurvey COMMAND MAP ARGUMENTS --json`.
pub fn run(command: &str, map: &Path, arguments: &[&str]) -> Answer {
    resurvey(&[&[command, path(map)], arguments].concat())
}
