//! Regions that the writers of versions looked at: a change in one of them from an older base contradicts what was seen.

use super::error::Fault;
use super::forgotten::has_table;
use super::plan::touched;
use super::rows::{box_columns, read_box};
use crate::version::{BoxMm, UpdateTransaction, VersionId};
use rusqlite::{Connection, named_params};

/// Writes down what the writer of `version` looked at.
pub(super) fn insert_looked_at(
    connection: &Connection,
    version: VersionId,
    region: Option<&BoxMm>,
) -> Result<(), Fault> {
    const SQL: &str = "INSERT INTO looked_at (version, e0, e1, n0, n1, h0, h1)
        VALUES (:version, :e0, :e1, :n0, :n1, :h0, :h1)";
    let Some(region) = region else { return Ok(()) };
    let [e0, e1, n0, n1, h0, h1] = box_columns(Some(region));
    connection.prepare_cached(SQL)?.execute(named_params! {
        ":version": version.0 as i64, ":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":h0": h0, ":h1": h1,
    })?;
    Ok(())
}

/// Versions after the base of `transaction` whose writers looked at a place that it changes.
pub(super) fn looked_at_since(
    connection: &Connection,
    transaction: &UpdateTransaction,
) -> Result<Vec<VersionId>, Fault> {
    const SQL: &str = "SELECT version, e0, e1, n0, n1, h0, h1 FROM looked_at WHERE version > :base ORDER BY version";
    if !has_table(connection)? {
        return Ok(Vec::new());
    }
    let touched = touched(transaction);
    let mut statement = connection.prepare_cached(SQL)?;
    let mut rows = statement.query(named_params! {":base": transaction.base.0 as i64})?;
    let mut versions = Vec::new();
    while let Some(row) = rows.next()? {
        let region = read_box(row)?;
        if region.is_some_and(|region| touched.iter().any(|bounds| bounds.intersects(&region))) {
            versions.push(VersionId(row.get::<_, i64>(0)?.unsigned_abs()));
        }
    }
    Ok(versions)
}
