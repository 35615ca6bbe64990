//! What a transaction expects of the live map, and where it is wrong.

use super::commit_error::{CommitError, ConflictingChange};
use super::error::Fault;
use super::forgotten::check_state;
use super::index;
use super::map_file::WriteFault;
use super::plan::starts_from;
use super::states::feature_at;
use crate::version::{Delta, FeatureState, Fid, UpdateTransaction, VersionId};
use rusqlite::{Connection, named_params};
use std::collections::BTreeMap;

/// A row of `feature_version` that is live.
pub(super) struct LiveRow {
    /// Its key.
    pub(super) id: i64,
    /// What the feature is now.
    pub(super) state: FeatureState,
}

/// The live rows of the features that `deltas` change.
pub(super) fn live_rows(connection: &Connection, deltas: &[Delta]) -> Result<BTreeMap<Fid, LiveRow>, Fault> {
    // The literal condition makes the partial index usable.
    const SQL: &str = "SELECT id, state FROM feature_version
        WHERE fid = :fid AND to_version IS NULL ORDER BY id";
    let mut statement = connection.prepare_cached(SQL)?;
    let mut live = BTreeMap::new();
    for fid in deltas.iter().map(Delta::fid) {
        let mut rows = statement.query(named_params! {":fid": fid.0 as i64})?;
        let Some(row) = rows.next()? else { continue };
        let state = FeatureState::from_bytes(row.get_ref(1)?.as_blob().map_err(rusqlite::Error::from)?);
        let state = state.map_err(|error| Fault::Damage(format!("live state of feature {fid}: {error}")))?;
        live.insert(fid, LiveRow { id: row.get(0)?, state });
    }
    Ok(live)
}

/// Refuses the transaction when a `before` is not live, or when something changed in the viewed region since its base.
pub(super) fn check_conflicts(
    connection: &Connection,
    transaction: &UpdateTransaction,
    live: &BTreeMap<Fid, LiveRow>,
    head: VersionId,
) -> Result<(), WriteFault<CommitError>> {
    let mut changed = BTreeMap::new();
    if let Some(region) = &transaction.viewed_region {
        // Of what changed since a forgotten version not every trace is left.
        check_state(connection, transaction.base)?;
        for fid in index::changed_since(connection, region, transaction.base)? {
            changed.insert(fid, false);
        }
    }
    for delta in &transaction.deltas {
        let found = live.get(&delta.fid()).map(|row| &row.state);
        if !starts_from(delta, found) {
            changed.insert(delta.fid(), true);
        }
    }
    if changed.is_empty() {
        return Ok(());
    }
    let describe = |(fid, is_target): (Fid, bool)| -> Result<ConflictingChange, Fault> {
        let found = feature_at(connection, fid, head)?.map(|feature| feature.state);
        Ok(ConflictingChange { fid, changed_in: last_change(connection, fid)?, found, is_target })
    };
    let changed = changed.into_iter().map(describe).collect::<Result<_, Fault>>()?;
    Err(WriteFault::Refused(CommitError::Conflict { base: transaction.base, head, changed, looked_at: Vec::new() }))
}

/// The last version that began or ended a state of `fid`.
fn last_change(connection: &Connection, fid: Fid) -> Result<Option<VersionId>, Fault> {
    const SQL: &str = "SELECT max(coalesce(to_version, from_version)) FROM feature_version WHERE fid = :fid ORDER BY 1";
    let mut statement = connection.prepare_cached(SQL)?;
    let last: Option<i64> = statement.query_row(named_params! {":fid": fid.0 as i64}, |row| row.get(0))?;
    Ok(last.map(|version| VersionId(version.unsigned_abs())))
}
