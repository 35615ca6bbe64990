//! What a version did, worked out again from the rows that end and begin with it.

use super::error::Fault;
use super::rows::{FEATURE_COLUMNS, classes_at};
use super::states::features;
use crate::version::{Delta, Digest, FeatureState, Fid, Frame, Operations, VersionId};
use resurvey_schema::ClassTable;
use rusqlite::{Connection, named_params};
use std::collections::BTreeMap;

/// What the rows that end and begin at `version` say it did.
pub(super) fn deltas_of(connection: &Connection, version: VersionId) -> Result<Vec<Delta>, Fault> {
    const ENDED: &str = "f.to_version = :version AND f.to_version IS NOT NULL";
    const BEGAN: &str = "f.from_version = :version";
    let select = |condition| {
        let sql = format!("SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE {condition} ORDER BY f.fid");
        features(connection, &sql, named_params! {":version": version.0 as i64})
    };
    let mut sides: BTreeMap<Fid, (Option<FeatureState>, Option<FeatureState>)> = BTreeMap::new();
    select(ENDED)?.into_iter().for_each(|feature| sides.entry(feature.fid).or_default().0 = Some(feature.state));
    select(BEGAN)?.into_iter().for_each(|feature| sides.entry(feature.fid).or_default().1 = Some(feature.state));
    Ok(sides.into_iter().filter_map(|(fid, (before, after))| Delta::from_sides(fid, before, after)).collect())
}

/// Digest of the canonical operations of `version`, which are `deltas` and what else it brought.
pub(super) fn operations_digest(
    connection: &Connection,
    version: VersionId,
    deltas: &[Delta],
) -> Result<Digest, Fault> {
    let frame = if version == VersionId(0) { Some(frame(connection)?) } else { None };
    let classes = new_classes(connection, version)?;
    let mut operations = Operations::start(frame.as_ref(), classes.as_ref(), deltas.len() as u64);
    deltas.iter().for_each(|delta| operations.add(delta));
    Ok(operations.finish())
}

fn frame(connection: &Connection) -> Result<Frame, Fault> {
    const SQL: &str = "SELECT crs, vertical_datum FROM meta ORDER BY only_row";
    Ok(connection.query_row(SQL, [], |row| Ok(Frame { crs: row.get(0)?, vertical_datum: row.get(1)? }))?)
}

/// The class table that `version` brought, if it brought one.
pub(super) fn new_classes(connection: &Connection, version: VersionId) -> Result<Option<ClassTable>, Fault> {
    const SQL: &str = "SELECT EXISTS (SELECT 1 FROM class WHERE from_version = :version) ORDER BY 1";
    let mut statement = connection.prepare_cached(SQL)?;
    let is_new: bool = statement.query_row(named_params! {":version": version.0 as i64}, |row| row.get(0))?;
    if is_new { classes_at(connection, version).map(Some) } else { Ok(None) }
}
