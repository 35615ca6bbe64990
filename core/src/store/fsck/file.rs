//! The file as SQLite sees it: pages, tables, references, the row of `meta`.

use super::problem::Findings;
use crate::store::error::Fault;
use crate::store::index::IndexOrigin;
use crate::store::map_file::FORMAT;
use crate::store::migrate::format_of;
use resurvey_schema::sql::MIGRATIONS;
use rusqlite::Connection;
use std::collections::BTreeMap;

/// Pages, indexes, column types and CHECK constraints.
pub(super) fn sqlite(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    complaints(connection)?.into_iter().for_each(|complaint| findings.add("file", complaint));
    Ok(())
}

/// What SQLite's own check complains of.
pub(in crate::store) fn complaints(connection: &Connection) -> Result<Vec<String>, Fault> {
    let mut statement = connection.prepare("PRAGMA integrity_check")?;
    let messages = statement.query_map([], |row| row.get(0))?.collect::<Result<Vec<String>, _>>()?;
    Ok(messages.into_iter().filter(|message| message != "ok").collect())
}

/// Tables, indexes and triggers are those of the format, and no others.
pub(super) fn schema(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    let made = Connection::open_in_memory()?;
    for migration in MIGRATIONS.iter().take(format_of(connection)?) {
        made.execute_batch(migration)?;
    }
    let (expected, found) = (definitions(&made)?, definitions(connection)?);
    for (name, definition) in &expected {
        match found.get(name) {
            None => findings.add(name, "is missing"),
            Some(other) if other != definition => findings.add(name, "is defined in another way"),
            Some(_) => {}
        }
    }
    for name in found.keys().filter(|name| !expected.contains_key(*name)) {
        findings.add(name, "does not belong to the format");
    }
    Ok(())
}

fn definitions(connection: &Connection) -> Result<BTreeMap<String, Option<String>>, Fault> {
    // ANALYZE leaves sqlite_stat tables, which are harmless.
    const SQL: &str =
        "SELECT type || ' ' || name, sql FROM sqlite_schema WHERE name NOT LIKE 'sqlite_stat%' ORDER BY 1";
    let mut statement = connection.prepare(SQL)?;
    let definitions = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
    Ok(definitions.collect::<Result<_, _>>()?)
}

/// Every reference from one table to another has its row.
pub(super) fn references(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    let mut statement = connection.prepare("PRAGMA foreign_key_check")?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let (table, id, parent): (String, Option<i64>, String) = (row.get(0)?, row.get(1)?, row.get(2)?);
        let id = id.map_or(String::new(), |id| format!(" {id}"));
        findings.add(format!("{table}{id}"), format!("refers to a row of {parent} that is not there"));
    }
    Ok(())
}

/// One row, of this format; an index origin as soon as there is a feature.
pub(super) fn meta(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    let count: i64 = connection.query_row("SELECT count(*) FROM meta ORDER BY 1", [], |row| row.get(0))?;
    if count != 1 {
        findings.add("meta", format!("expected one row, found {count}"));
        return Ok(());
    }
    let format: String = connection.query_row("SELECT format FROM meta ORDER BY 1", [], |row| row.get(0))?;
    if format != FORMAT {
        findings.add("meta", format!("expected format {FORMAT:?}, found {format:?}"));
    }
    const FEATURES: &str = "SELECT EXISTS (SELECT 1 FROM feature_version) ORDER BY 1";
    let has_features: bool = connection.query_row(FEATURES, [], |row| row.get(0))?;
    if has_features && IndexOrigin::read(connection)?.is_none() {
        findings.add("meta", "there are features but no origin of the index");
    }
    Ok(())
}
