//! Writing the rows of features, their index and their geometry.

use super::commit::Plan;
use super::commit_error::CommitError;
use super::conflict::LiveRow;
use super::error::Fault;
use super::index::{IndexBox, IndexOrigin, LIVE, hilbert_key};
use super::map_file::WriteFault;
use crate::version::{Delta, Digest, FeatureState, Fid, UpdateTransaction, VersionId};
use rusqlite::{Connection, named_params};

/// Stores the geometry that new objects need and the map does not have.
pub(super) fn insert_geometries(
    connection: &Connection,
    transaction: &UpdateTransaction,
) -> Result<(), WriteFault<CommitError>> {
    const INSERT: &str =
        "INSERT INTO geometry (digest, bytes) VALUES (:digest, :bytes) ON CONFLICT (digest) DO NOTHING";
    const EXISTS: &str = "SELECT 1 FROM geometry WHERE digest = :digest ORDER BY digest";
    let after = transaction.deltas.iter().filter_map(Delta::after);
    for state in transaction.additions.iter().chain(after) {
        let FeatureState::Object { name, geometry, .. } = state else { continue };
        match transaction.geometries.get(geometry) {
            Some(bytes) => {
                connection.prepare_cached(INSERT)?.execute(named_params! {":digest": geometry.0, ":bytes": bytes})?;
            }
            None if connection.prepare_cached(EXISTS)?.exists(named_params! {":digest": geometry.0})? => {}
            None => {
                let error = CommitError::NoGeometry { name: name.clone(), digest: *geometry };
                return Err(WriteFault::Refused(error));
            }
        }
    }
    for (given, bytes) in &transaction.geometries {
        let found = Digest::of(bytes);
        if found != *given {
            return Err(WriteFault::Refused(CommitError::WrongDigest { given: *given, found }));
        }
    }
    Ok(())
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
    version: VersionId,
) -> Result<(), WriteFault<CommitError>> {
    end_rows(connection, plan, version)?;
    let Some(envelope) = &plan.envelope else { return Ok(()) };
    let origin = match IndexOrigin::read(connection)? {
        Some(origin) => origin,
        None => {
            let origin = IndexOrigin::choose(envelope);
            origin.write(connection)?;
            origin
        }
    };
    let mut rows: Vec<(u64, &Delta, IndexBox)> = Vec::with_capacity(plan.deltas.len());
    for (delta, bounds) in plan.deltas.iter().zip(&plan.boxes) {
        let Some(bounds) = bounds else { continue };
        let Some(ends) = origin.to_index(bounds) else {
            let error = CommitError::OutsideIndex { feature: format!("feature {}", delta.fid()) };
            return Err(WriteFault::Refused(error));
        };
        rows.push((hilbert_key(&ends), delta, ends));
    }
    rows.sort_by_key(|(key, delta, _)| (*key, delta.fid()));
    for (_, delta, ends) in rows {
        if let Some(after) = delta.after() {
            insert_row(connection, delta.fid(), version, after, &ends)?;
        }
    }
    Ok(())
}

fn end_rows(connection: &Connection, plan: &Plan, version: VersionId) -> Result<(), Fault> {
    const END: &str = "UPDATE feature_version SET to_version = :version WHERE id = :id AND to_version IS NULL";
    const END_INDEX: &str = "UPDATE feature_index SET v1 = :last WHERE id = :id";
    for (fid, LiveRow { id, .. }) in &plan.live {
        let ended = connection.prepare_cached(END)?.execute(named_params! {":version": version.0 as i64, ":id": id})?;
        let last = version.0 as i64 - 1;
        let indexed = connection.prepare_cached(END_INDEX)?.execute(named_params! {":last": last, ":id": id})?;
        if (ended, indexed) != (1, 1) {
            return Err(Fault::Damage(format!("the live row of feature {fid} has {indexed} rows in the index")));
        }
    }
    Ok(())
}

fn insert_row(
    connection: &Connection,
    fid: Fid,
    version: VersionId,
    state: &FeatureState,
    ends: &IndexBox,
) -> Result<(), Fault> {
    const ROW: &str = "INSERT INTO feature_version (fid, from_version, kind, class, geometry, state)
        VALUES (:fid, :version, :kind, :class, :geometry, :state)";
    const INDEX: &str = "INSERT INTO feature_index (id, e0, e1, n0, n1, h0, h1, v0, v1)
        VALUES (:id, :e0, :e1, :n0, :n1, :h0, :h1, :v0, :v1)";
    connection.prepare_cached(ROW)?.execute(named_params! {
        ":fid": fid.0 as i64, ":version": version.0 as i64, ":kind": state.kind_name(),
        ":class": state.class().map(|class| class.0), ":geometry": state.geometry().map(|digest| digest.0),
        ":state": state.to_bytes(),
    })?;
    let [e0, e1, n0, n1, h0, h1] = ends;
    connection.prepare_cached(INDEX)?.execute(named_params! {
        ":id": connection.last_insert_rowid(), ":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":h0": h0, ":h1": h1,
        ":v0": version.0 as i64, ":v1": LIVE,
    })?;
    Ok(())
}
