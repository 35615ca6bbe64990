//! Committing: optimistic, in one immediate transaction, all or nothing.

use super::commit_error::CommitError;
use super::conflict::{LiveRow, check_conflicts, live_rows};
use super::error::{Fault, StoreError};
use super::feature_rows::{insert_geometries, last_fid, write_rows};
use super::looked_at::{insert_looked_at, looked_at_since};
use super::map_file::{MapFile, WriteFault};
use super::observations::Evidence;
use super::rows::{VersionRow, check_classes, classes_at, head, insert_classes};
use crate::version::{
    BoxMm, Counts, Delta, Digest, FeatureState, Fid, InvalidState, Operations, UpdateTransaction, VersionId,
    VersionKind, VersionRecord, version_hash,
};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use rusqlite::{Connection, OptionalExtension, named_params};
use std::collections::{BTreeMap, BTreeSet};

type Refused = WriteFault<CommitError>;

fn refuse<T>(error: CommitError) -> Result<T, Refused> {
    Err(WriteFault::Refused(error))
}

/// Makes the next version of everything in `transaction`, or refuses it and changes nothing.
pub(super) fn commit(map: &MapFile, transaction: &UpdateTransaction, now: Timestamp) -> Result<VersionId, CommitError> {
    let evidence = transaction.evidence.as_ref().map(Evidence::of).transpose()?;
    let digest = evidence.as_ref().map(|evidence| evidence.digest);
    map.write(|connection| {
        if let Some(made) = made_before(connection, transaction)? {
            return Ok(made);
        }
        let record = make_unseen_version(connection, transaction, digest, now)?;
        if let Some(evidence) = evidence {
            evidence.insert(connection, transaction.base, Some(record.version), record.committed_at)?;
        }
        Ok(record.version)
    })
}

/// Writes the next version, unless someone looked at a place that it changes since its base. An undo is not weighed
/// against what was seen: it says that what was seen there is wrong.
pub(super) fn make_unseen_version(
    connection: &Connection,
    transaction: &UpdateTransaction,
    evidence: Option<Digest>,
    now: Timestamp,
) -> Result<VersionRecord, Refused> {
    let seen = match transaction.kind {
        VersionKind::Revert => Vec::new(),
        _ => looked_at_since(connection, transaction)?,
    };
    match make_version(connection, transaction, evidence, now) {
        Err(WriteFault::Refused(CommitError::Conflict { base, head, changed, .. })) => {
            refuse(CommitError::Conflict { base, head, changed, looked_at: seen })
        }
        Ok(record) if !seen.is_empty() => refuse(CommitError::Conflict {
            base: transaction.base,
            head: VersionId(record.version.0 - 1),
            changed: Vec::new(),
            looked_at: seen,
        }),
        other => other,
    }
}

/// What the transaction does to the rows, worked out and checked.
pub(super) struct Plan {
    /// By rising feature number.
    pub(super) deltas: Vec<Delta>,
    /// The rows they end.
    pub(super) live: BTreeMap<Fid, LiveRow>,
    /// Box of the state after each delta.
    pub(super) boxes: Vec<Option<BoxMm>>,
    /// Box around all states, before and after.
    pub(super) envelope: Option<BoxMm>,
}

/// Writes the next version, all but the row of its evidence.
pub(super) fn make_version(
    connection: &Connection,
    transaction: &UpdateTransaction,
    evidence: Option<Digest>,
    now: Timestamp,
) -> Result<VersionRecord, Refused> {
    let head = head(connection)?;
    check_request(transaction, &head)?;
    let classes = check_new_classes(connection, transaction, head.version)?;
    check_states(transaction, &classes)?;
    let live = live_rows(connection, &transaction.deltas)?;
    check_conflicts(connection, transaction, &live, head.version)?;
    let plan = plan(connection, transaction, live)?;

    let mut operations = Operations::start(None, transaction.classes.as_ref(), plan.deltas.len() as u64);
    plan.deltas.iter().for_each(|delta| operations.add(delta));
    let record = VersionRecord {
        version: VersionId(head.version.0 + 1),
        kind: transaction.kind,
        committed_at: now.max(head.committed_at),
        observed_at: transaction.observed_at,
        author: transaction.author.clone(),
        message: transaction.message.clone(),
        base: Some(transaction.base),
        reverts: transaction.reverts,
        counts: Counts::of(&plan.deltas),
        envelope: plan.envelope,
        idempotency_key: transaction.idempotency_key.clone(),
        evidence,
        hash: version_hash(Some(head.hash), operations.finish(), evidence),
    };
    VersionRow::insert(connection, &record)?;
    if let Some(classes) = &transaction.classes {
        insert_classes(connection, record.version, classes)?;
    }
    insert_looked_at(connection, record.version, transaction.viewed_region.as_ref())?;
    insert_geometries(connection, transaction)?;
    write_rows(connection, &plan, record.version)?;
    Ok(record)
}

/// The version that the same idempotency key made before.
fn made_before(connection: &Connection, transaction: &UpdateTransaction) -> Result<Option<VersionId>, Fault> {
    transaction.idempotency_key.as_deref().map_or(Ok(None), |key| version_with(connection, key))
}

/// The version that a transaction with this idempotency key made, if there is one.
pub(super) fn version_with(connection: &Connection, key: &str) -> Result<Option<VersionId>, Fault> {
    const SQL: &str = "SELECT version FROM version WHERE idempotency_key = :key ORDER BY version";
    let mut statement = connection.prepare_cached(SQL)?;
    let made = statement.query_row(named_params! {":key": key}, |row| row.get::<_, i64>(0)).optional()?;
    Ok(made.map(|version| VersionId(version.unsigned_abs())))
}

pub(super) fn check_request(transaction: &UpdateTransaction, head: &VersionRecord) -> Result<(), Refused> {
    for version in [Some(transaction.base), transaction.reverts].into_iter().flatten() {
        if version > head.version {
            return refuse(StoreError::NoSuchVersion { version, head: head.version }.into());
        }
    }
    if transaction.kind == VersionKind::Init {
        return refuse(CommitError::Kind);
    }
    if transaction.is_empty() {
        return refuse(CommitError::Empty);
    }
    let mut seen = BTreeSet::new();
    for delta in &transaction.deltas {
        let fid = delta.fid();
        if !(1..=Fid::MAX.0).contains(&fid.0) {
            return refuse(CommitError::FidRange { fid });
        }
        if !seen.insert(fid) {
            return refuse(CommitError::Twice { fid });
        }
        if delta.before() == delta.after() {
            return refuse(CommitError::NoChange { fid });
        }
    }
    Ok(())
}

/// The class table that the states of the transaction must fit.
fn check_new_classes(
    connection: &Connection,
    transaction: &UpdateTransaction,
    head: VersionId,
) -> Result<ClassTable, Refused> {
    let old = classes_at(connection, head)?;
    let Some(new) = &transaction.classes else { return Ok(old) };
    check_classes(new).map_err(|error| WriteFault::Refused(error.into()))?;
    match old.iter().find(|class| new.get(class.index).is_none_or(|kept| kept.kind != class.kind)) {
        Some(lost) => refuse(CommitError::ClassLost { class: lost.name.clone() }),
        None => Ok(new.clone()),
    }
}

pub(super) fn check_states(transaction: &UpdateTransaction, classes: &ClassTable) -> Result<(), Refused> {
    let invalid = |feature: String| move |error| WriteFault::Refused(CommitError::State { feature, error });
    for (position, state) in transaction.additions.iter().enumerate() {
        state.validate(classes).map_err(invalid(format!("addition {position}")))?;
    }
    for delta in &transaction.deltas {
        let after = delta.after().map_or(Ok(()), |state| state.validate(classes));
        after.map_err(invalid(format!("feature {}", delta.fid())))?;
    }
    Ok(())
}

/// Numbers the additions and orders all deltas by feature number, each with its exact state before.
fn plan(
    connection: &Connection,
    transaction: &UpdateTransaction,
    live: BTreeMap<Fid, LiveRow>,
) -> Result<Plan, Refused> {
    let mut last = transaction.deltas.iter().map(|delta| delta.fid().0).fold(last_fid(connection)?.0, u64::max);
    let mut deltas = Vec::with_capacity(transaction.deltas.len() + transaction.additions.len());
    for delta in &transaction.deltas {
        let before = live.get(&delta.fid()).map(|row| row.state.clone());
        deltas.extend(Delta::from_sides(delta.fid(), before, delta.after().cloned()));
    }
    for state in &transaction.additions {
        last += 1;
        if last > Fid::MAX.0 {
            return refuse(CommitError::FidRange { fid: Fid(last) });
        }
        deltas.push(Delta::add(Fid(last), state.clone()));
    }
    deltas.sort_by_key(Delta::fid);
    let mut envelope: Option<BoxMm> = None;
    let mut boxes = Vec::with_capacity(deltas.len());
    for delta in &deltas {
        let bounds = |state: Option<&FeatureState>| state.map(FeatureState::bounds).transpose();
        let invalid = |error| {
            let error = InvalidState::Box(error);
            WriteFault::Refused(CommitError::State { feature: format!("feature {}", delta.fid()), error })
        };
        let (before, after) = (bounds(delta.before()).map_err(invalid)?, bounds(delta.after()).map_err(invalid)?);
        for bounds in [before, after].into_iter().flatten() {
            envelope = Some(envelope.map_or(bounds, |envelope| envelope.union(&bounds)));
        }
        boxes.push(after);
    }
    Ok(Plan { deltas, live, boxes, envelope })
}
