//! Features: their states, life spans and index.

use super::problem::Findings;
use crate::store::error::Fault;
use crate::store::index::{Flaw, Source, flaws};
use crate::store::rows::classes_at;
use crate::version::{FeatureState, VersionId};
use resurvey_schema::ClassTable;
use rusqlite::{Connection, Row};
use std::collections::BTreeMap;

fn state(row: &Row, column: &str) -> Result<Result<FeatureState, String>, Fault> {
    let bytes = row.get_ref(column)?.as_blob().map_err(rusqlite::Error::from)?;
    Ok(match FeatureState::from_bytes(bytes) {
        Ok(state) if state.to_bytes() == bytes => Ok(state),
        Ok(_) => Err("the state is not in its canonical form".to_owned()),
        Err(error) => Err(format!("the state cannot be read: {error}")),
    })
}

/// Every state is canonical, fits the classes of its version, and agrees with the columns made from it.
pub(super) fn states(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    const SQL: &str = "SELECT id, fid, from_version, kind, class, geometry, state FROM feature_version ORDER BY id";
    let tables = class_tables(connection)?;
    let mut statement = connection.prepare(SQL)?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let (id, fid, from): (i64, i64, i64) = (row.get("id")?, row.get("fid")?, row.get("from_version")?);
        let place = || format!("feature {fid} from version {from}");
        if id < 1 || fid < 1 || from < 1 {
            let detail = format!("row {id} of feature {fid} from version {from}: expected numbers from 1");
            findings.add(place(), detail);
        }
        let state = match state(row, "state")? {
            Ok(state) => state,
            Err(detail) => {
                findings.add(place(), detail);
                continue;
            }
        };
        let columns: (String, Option<u8>, Option<[u8; 32]>) =
            (row.get("kind")?, row.get("class")?, row.get("geometry")?);
        let made =
            (state.kind_name().to_owned(), state.class().map(|class| class.0), state.geometry().map(|digest| digest.0));
        if columns != made {
            findings.add(place(), "kind, class or geometry differ from the state");
        }
        let Some((_, classes)) = tables.range(..=from).next_back() else { continue };
        if let Err(error) = state.validate(classes) {
            findings.add(place(), error.to_string());
        }
    }
    Ok(())
}

fn class_tables(connection: &Connection) -> Result<BTreeMap<i64, ClassTable>, Fault> {
    let mut statement = connection.prepare("SELECT DISTINCT from_version FROM class ORDER BY from_version")?;
    let mut rows = statement.query([])?;
    let mut tables = BTreeMap::new();
    while let Some(row) = rows.next()? {
        let from: i64 = row.get(0)?;
        // A table that cannot be read is found by the check of the classes.
        if let Ok(classes) = classes_at(connection, VersionId(from.unsigned_abs())) {
            tables.insert(from, classes);
        }
    }
    Ok(tables)
}

/// The life spans of a feature do not overlap, so that it has one open row at most.
pub(super) fn life_spans(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    const SQL: &str = "SELECT fid, from_version, to_version FROM feature_version ORDER BY fid, from_version";
    let mut statement = connection.prepare(SQL)?;
    let mut rows = statement.query([])?;
    let mut last: Option<(i64, i64, Option<i64>)> = None;
    while let Some(row) = rows.next()? {
        let (fid, from, to): (i64, i64, Option<i64>) = (row.get(0)?, row.get(1)?, row.get(2)?);
        if let Some((last_fid, last_from, last_to)) = last
            && last_fid == fid
            && last_to.is_none_or(|last_to| last_to > from)
        {
            let end = last_to.map_or("open".to_owned(), |to| format!("until {to}"));
            findings.add(
                format!("feature {fid} from version {from}"),
                format!("overlaps the state from version {last_from}, {end}"),
            );
        }
        last = Some((fid, from, to));
    }
    Ok(())
}

/// The index holds the box and the versions of every row, and nothing else.
pub(super) fn index(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    for flaw in flaws(connection, &Source::read(connection)?)?.0 {
        let (Flaw::Wrong { place, detail } | Flaw::Stray { place, detail }) = flaw;
        findings.add(place, detail);
    }
    Ok(())
}
