//! Running all checks and collecting what they find.

use super::{blobs, evidence, features, file, history, seals};
use crate::store::error::{Fault, StoreError};
use crate::store::map_file::MapFile;
use rusqlite::Connection;
use std::fmt;
use std::path::Path;

/// One thing that does not hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Short stable name of the check.
    pub check: &'static str,
    /// Which row or value.
    pub place: String,
    /// What was expected and what was found.
    pub detail: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}: {}", self.check, self.place, self.detail)
    }
}

/// What one check has found; it lists so many and counts the rest.
pub(super) struct Findings {
    check: &'static str,
    problems: Vec<Problem>,
    left_out: u64,
}

const LISTED_PER_CHECK: usize = 100;

impl Findings {
    pub(super) fn add(&mut self, place: impl Into<String>, detail: impl Into<String>) {
        if self.problems.len() < LISTED_PER_CHECK {
            self.problems.push(Problem { check: self.check, place: place.into(), detail: detail.into() });
        } else {
            self.left_out += 1;
        }
    }

    fn finish(mut self) -> Vec<Problem> {
        if self.left_out > 0 {
            let detail = format!("{} more of this check", self.left_out);
            self.problems.push(Problem { check: self.check, place: "map".to_owned(), detail });
        }
        self.problems
    }
}

type Check = (&'static str, fn(&Connection, &mut Findings) -> Result<(), Fault>);

/// Every check of what must be true, by its name, the ground before what stands on it.
const CHECKS: [Check; 17] = [
    ("sqlite", file::sqlite),
    ("schema", file::schema),
    ("references", file::references),
    ("meta", file::meta),
    ("states", features::states),
    ("life-spans", features::life_spans),
    ("index", features::index),
    ("geometry", blobs::geometry),
    ("classes", history::classes),
    ("versions", history::versions),
    ("forgotten", history::forgotten),
    ("forgotten", seals::states),
    ("observations", evidence::observations),
    ("observations", blobs::label_images),
    ("proposals", evidence::proposals),
    ("tags", evidence::tags),
    ("seals", seals::seals),
];

/// Checks for what nobody uses, which harms nobody either.
const LEFT_OVER: [Check; 2] = [("geometry", blobs::unused_geometry), ("observations", blobs::unused_label_images)];

impl MapFile {
    /// Checks everything that must hold in the map as it is now; empty when all is well. Reads the whole file.
    pub fn fsck(&self) -> Result<Vec<Problem>, StoreError> {
        self.read(|connection| {
            let mut problems = damage(connection, &self.path)?;
            problems.extend(found_by(&LEFT_OVER, connection, &self.path)?);
            Ok(problems)
        })
    }
}

/// All that is not true in the map at `path`; what nobody uses is none of it.
pub(in crate::store) fn damage(connection: &Connection, path: &Path) -> Result<Vec<Problem>, Fault> {
    found_by(&CHECKS, connection, path)
}

fn found_by(checks: &[Check], connection: &Connection, path: &Path) -> Result<Vec<Problem>, Fault> {
    let mut problems = Vec::new();
    for (name, check) in checks {
        let mut findings = Findings { check: name, problems: Vec::new(), left_out: 0 };
        if let Err(fault) = check(connection, &mut findings) {
            // Damage that keeps a check from going on is itself what it found.
            match fault.at(path) {
                StoreError::Damaged { detail, .. } | StoreError::Internal { detail, .. } => {
                    findings.add("map", detail);
                }
                error => return Err(error.into()),
            }
        }
        problems.extend(findings.finish());
    }
    Ok(problems)
}
