//! Committing: optimistic, in one immediate transaction, all or nothing.

use super::commit_error::CommitError;
use super::conflict::{check_conflicts, live_rows};
use super::error::Fault;
use super::feature_rows::{insert_geometries, last_fid, write_rows};
use super::interface::{History, Made};
use super::logs::record;
use super::looked_at::{insert_looked_at, looked_at_since};
use super::map_file::{MapFile, WriteFault};
use super::migrate::format_of;
use super::observations::Evidence;
use super::plan::{check_new_classes, check_numbers, check_request, check_states, plan};
use super::rows::{VersionRow, classes_at, head, insert_classes};
use super::seal;
use super::states::last_state;
use crate::version::{BoxMm, Digest, Fid, UpdateTransaction, VersionId, VersionKind, VersionRecord};
use jiff::Timestamp;
use rusqlite::{Connection, OptionalExtension, named_params};

/// The first format that knows what was asked for with a key.
const REQUEST_FORMAT: usize = 4;

type Refused = WriteFault<CommitError>;

fn refuse<T>(error: CommitError) -> Result<T, Refused> {
    Err(WriteFault::Refused(error))
}

/// Makes the next version of everything in `transaction`, or refuses it and changes nothing.
pub(super) fn commit(map: &MapFile, transaction: &UpdateTransaction, now: Timestamp) -> Result<Made, CommitError> {
    let evidence = transaction.evidence.as_ref().map(Evidence::of).transpose()?;
    let digest = evidence.as_ref().map(|evidence| evidence.digest);
    let asked = (transaction.kind, transaction.request);
    map.write(|connection| {
        if let Some(version) = map.repeated(transaction.idempotency_key.as_deref(), asked)? {
            return Ok(Made { version, repeated: true });
        }
        let record = make_unseen_version(connection, transaction, digest, now)?;
        if let Some(evidence) = evidence {
            evidence.insert(connection, transaction.base, Some(record.version), record.committed_at)?;
        }
        Ok(Made { version: record.version, repeated: false })
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
    match make_version(connection, transaction, (evidence, transaction.viewed_region.as_ref()), now) {
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

/// Writes the next version, all but the row of its evidence. `looked_at` is what its writer looked at.
pub(super) fn make_version(
    connection: &Connection,
    transaction: &UpdateTransaction,
    (evidence, looked_at): (Option<Digest>, Option<&BoxMm>),
    now: Timestamp,
) -> Result<VersionRecord, Refused> {
    let head = head(connection)?;
    check_key(connection, transaction)?;
    check(connection, transaction, head.version)?;
    let live = live_rows(connection, &transaction.deltas)?;
    check_conflicts(connection, transaction, &live, head.version)?;
    let last_fid = last_fid(connection)?;
    check_numbers(transaction, last_fid, |fid| -> Result<_, Refused> { Ok(last_state(connection, fid)?) })?;
    let state = |fid: Fid| live.get(&fid).map(|row| row.state.clone());
    let plan = plan(transaction, state, last_fid, &head, (evidence, now))?;
    let request = transaction.request.filter(|_| transaction.idempotency_key.is_some());
    VersionRow::insert(connection, &plan.record, request)?;
    if let Some(classes) = &transaction.classes {
        insert_classes(connection, plan.record.version, classes)?;
    }
    insert_looked_at(connection, plan.record.version, looked_at)?;
    seal::VERSION.seal(connection, &(plan.record.version.0 as i64))?;
    insert_geometries(connection, transaction)?;
    write_rows(connection, &plan, &live)?;
    Ok(plan.record)
}

/// Refuses a key that made another version.
fn check_key(connection: &Connection, transaction: &UpdateTransaction) -> Result<(), Refused> {
    let Some(key) = &transaction.idempotency_key else { return Ok(()) };
    let Some(version) = version_with(connection, key)? else { return Ok(()) };
    let made = (record(connection, version)?.kind, request_of(connection, version)?);
    let asked = (transaction.kind, transaction.request);
    refuse(CommitError::OtherRequest { key: key.clone(), version, made, asked })
}

/// Refuses what does not fit the map at its newest version, whatever else changed since the base.
pub(super) fn check(connection: &Connection, transaction: &UpdateTransaction, head: VersionId) -> Result<(), Refused> {
    check_request(transaction, head)?;
    let classes = check_new_classes(transaction, classes_at(connection, head)?)?;
    Ok(check_states(transaction, &classes)?)
}

/// The version that a transaction with this idempotency key made, if there is one.
pub(super) fn version_with(connection: &Connection, key: &str) -> Result<Option<VersionId>, Fault> {
    const SQL: &str = "SELECT version FROM version WHERE idempotency_key = :key ORDER BY version";
    let mut statement = connection.prepare_cached(SQL)?;
    let made = statement.query_row(named_params! {":key": key}, |row| row.get::<_, i64>(0)).optional()?;
    Ok(made.map(|version| VersionId(version.unsigned_abs())))
}

/// What was asked for with the key of `version`.
pub(super) fn request_of(connection: &Connection, version: VersionId) -> Result<Option<Digest>, Fault> {
    const SQL: &str = "SELECT request FROM version WHERE version = :version ORDER BY version";
    if format_of(connection)? < REQUEST_FORMAT {
        return Ok(None);
    }
    let mut statement = connection.prepare_cached(SQL)?;
    let request = statement.query_row(named_params! {":version": version.0 as i64}, |row| row.get(0)).optional()?;
    Ok(request.flatten().map(Digest))
}
