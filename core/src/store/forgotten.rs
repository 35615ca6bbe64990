//! Versions of which gc removed something: what is left of them, and who may still ask for them.

use super::error::{Fault, StoreError};
use super::migrate::format_of;
use super::states::check_version;
use crate::version::{Digest, VersionId};
use rusqlite::{Connection, OptionalExtension, named_params};
use std::collections::BTreeMap;

/// The first format with the table `forgotten`.
const FORMAT: usize = 2;

/// What is left of a version that gc touched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Remains {
    /// Whether the state of the map is whole, and only what the version did is gone.
    pub(super) has_state: bool,
    /// Digest of its canonical operations.
    pub(super) operations: Digest,
}

/// Whether the map can have forgotten anything.
pub(super) fn has_table(connection: &Connection) -> Result<bool, Fault> {
    Ok(format_of(connection)? >= FORMAT)
}

/// What is left of `version`; `None` when all of it is there.
pub(super) fn remains_of(connection: &Connection, version: VersionId) -> Result<Option<Remains>, Fault> {
    const SQL: &str = "SELECT has_state, operations FROM forgotten WHERE version = :version ORDER BY version";
    if !has_table(connection)? {
        return Ok(None);
    }
    let mut statement = connection.prepare_cached(SQL)?;
    let read = |row: &rusqlite::Row| Ok(Remains { has_state: row.get(0)?, operations: Digest(row.get(1)?) });
    Ok(statement.query_row(named_params! {":version": version.0 as i64}, read).optional()?)
}

/// Whether the state of `version` is there.
pub(super) fn is_kept(connection: &Connection, version: VersionId) -> Result<bool, Fault> {
    Ok(remains_of(connection, version)?.is_none_or(|remains| remains.has_state))
}

/// What is left of every version that gc touched.
pub(super) fn all_remains(connection: &Connection) -> Result<BTreeMap<VersionId, Remains>, Fault> {
    const SQL: &str = "SELECT version, has_state, operations FROM forgotten ORDER BY version";
    if !has_table(connection)? {
        return Ok(BTreeMap::new());
    }
    let mut statement = connection.prepare_cached(SQL)?;
    let rows = statement.query_map([], |row| {
        let version = VersionId(row.get::<_, i64>(0)?.unsigned_abs());
        Ok((version, Remains { has_state: row.get(1)?, operations: Digest(row.get(2)?) }))
    })?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// Refuses a version above the newest, and one whose state is forgotten.
pub(super) fn check_state(connection: &Connection, version: VersionId) -> Result<(), Fault> {
    const NEXT: &str = "SELECT min(v.version) FROM version AS v WHERE v.version > :version
        AND NOT EXISTS (SELECT 1 FROM forgotten AS f WHERE f.version = v.version AND f.has_state = 0) ORDER BY 1";
    check_version(connection, version)?;
    if is_kept(connection, version)? {
        return Ok(());
    }
    let mut statement = connection.prepare_cached(NEXT)?;
    let next: i64 = statement.query_row(named_params! {":version": version.0 as i64}, |row| row.get(0))?;
    Err(StoreError::Forgotten { version, next: VersionId(next.unsigned_abs()) }.into())
}
