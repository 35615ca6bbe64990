//! Writing the rows of features, their index and their geometry.

use super::commit_error::CommitError;
use super::conflict::LiveRow;
use super::error::Fault;
use super::index::{IndexBox, IndexChanges, IndexOrigin, hilbert_key};
use super::map_file::WriteFault;
use super::plan::{Plan, check_digests, needed_geometry};
use crate::version::{Delta, FeatureState, Fid, UpdateTransaction, VersionId};
use rusqlite::{CachedStatement, Connection, named_params, params};
use std::collections::BTreeMap;

/// Stores the geometry that new objects need and the map does not have.
pub(super) fn insert_geometries(
    connection: &Connection,
    transaction: &UpdateTransaction,
) -> Result<(), WriteFault<CommitError>> {
    const INSERT: &str =
        "INSERT INTO geometry (digest, bytes) VALUES (:digest, :bytes) ON CONFLICT (digest) DO NOTHING";
    const EXISTS: &str = "SELECT 1 FROM geometry WHERE digest = :digest ORDER BY digest";
    for (name, digest) in needed_geometry(transaction) {
        match transaction.geometries.get(&digest) {
            Some(bytes) => {
                connection.prepare_cached(INSERT)?.execute(named_params! {":digest": digest.0, ":bytes": bytes})?;
            }
            None if connection.prepare_cached(EXISTS)?.exists(named_params! {":digest": digest.0})? => {}
            None => return Err(CommitError::NoGeometry { name: name.to_owned(), digest }.into()),
        }
    }
    Ok(check_digests(transaction)?)
}

/// The highest number that a feature has or had.
pub(super) fn last_fid(connection: &Connection) -> Result<Fid, Fault> {
    // Of several times of forgetting, the newest version that was forgotten knew of every feature of the older ones.
    const SQL: &str = "SELECT max(coalesce((SELECT max(fid) FROM feature_version), 0),
        coalesce((SELECT last_fid FROM forgotten ORDER BY version DESC LIMIT 1), 0)) ORDER BY 1";
    let last: i64 = connection.prepare_cached(SQL)?.query_row([], |row| row.get(0))?;
    Ok(Fid(last.unsigned_abs()))
}

/// Ends the rows that the plan replaces and writes the new ones, neighbours together.
pub(super) fn write_rows(
    connection: &Connection,
    plan: &Plan,
    live: &BTreeMap<Fid, LiveRow>,
) -> Result<(), WriteFault<CommitError>> {
    let Some(envelope) = &plan.record.envelope else { return Ok(()) };
    let origin = match IndexOrigin::read(connection)? {
        Some(origin) => origin,
        None => {
            let origin = IndexOrigin::choose(envelope);
            origin.write(connection)?;
            origin
        }
    };
    let version = plan.record.version;
    let mut index = IndexChanges::of(version.0 as i64);
    end_rows(connection, live, version, origin, &mut index)?;
    let mut rows: Vec<(u64, &Delta, IndexBox)> = Vec::with_capacity(plan.deltas.len());
    for (delta, bounds) in plan.deltas.iter().zip(&plan.boxes) {
        let Some(bounds) = bounds else { continue };
        let Some(ends) = origin.to_index(bounds) else {
            let error = CommitError::OutsideIndex { feature: format!("feature {}", delta.fid()) };
            return Err(WriteFault::Refused(error));
        };
        rows.push((hilbert_key(&ends), delta, ends));
    }
    rows.sort_unstable_by_key(|(key, delta, _)| (*key, delta.fid()));
    let mut insert = Insert::prepare(connection, version)?;
    for (_, delta, ends) in rows {
        if let Some(after) = delta.after() {
            index.begin(insert.row(delta.fid(), after)?, ends);
        }
    }
    Ok(index.write(connection)?)
}

fn end_rows(
    connection: &Connection,
    live: &BTreeMap<Fid, LiveRow>,
    version: VersionId,
    origin: IndexOrigin,
    index: &mut IndexChanges,
) -> Result<(), Fault> {
    const END: &str = "UPDATE feature_version SET to_version = :version WHERE id = :id AND to_version IS NULL";
    let mut end = connection.prepare_cached(END)?;
    for (fid, LiveRow { id, state }) in live {
        let ends = state.bounds().ok().and_then(|bounds| origin.to_index(&bounds));
        let ended = end.execute(named_params! {":version": version.0 as i64, ":id": id})?;
        match ends.filter(|_| ended == 1) {
            Some(ends) => index.end(*id, &ends),
            None => return Err(Fault::Damage(format!("the live state of feature {fid} cannot end"))),
        }
    }
    Ok(())
}

/// The statement that writes one row, prepared once for all rows of a version.
struct Insert<'c> {
    connection: &'c Connection,
    version: i64,
    statement: CachedStatement<'c>,
}

impl<'c> Insert<'c> {
    fn prepare(connection: &'c Connection, version: VersionId) -> Result<Self, Fault> {
        // Looking up names costs a tenth of loading a city.
        const ROW: &str = "INSERT INTO feature_version (fid, from_version, kind, class, geometry, state)
            VALUES (?1, ?2, ?3, ?4, ?5, ?6)";
        Ok(Self { connection, version: version.0 as i64, statement: connection.prepare_cached(ROW)? })
    }

    /// Writes it and returns its id.
    fn row(&mut self, fid: Fid, state: &FeatureState) -> Result<i64, Fault> {
        let (class, geometry) = (state.class().map(|class| class.0), state.geometry().map(|digest| digest.0));
        let (fid, kind) = (fid.0 as i64, state.kind_name());
        self.statement.execute(params![fid, self.version, kind, class, geometry, state.to_bytes()])?;
        Ok(self.connection.last_insert_rowid())
    }
}
