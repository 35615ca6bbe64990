//! History: dense versions, rising times, counts, envelopes, and the hash chain.

use super::problem::Findings;
use crate::store::error::Fault;
use crate::store::forgotten::{all_remains, remains_of};
use crate::store::gc::{Unreachable, unreachable};
use crate::store::kept_states::kept_states;
use crate::store::migrate::format_of;
use crate::store::operations::{deltas_of, operations_digest};
use crate::store::rows::{VersionRow, classes_at, head};
use crate::store::seal::SEALED_FORMAT;
use crate::version::{BoxMm, Counts, Delta, Digest, VersionId, VersionKind, VersionRecord, version_hash};
use resurvey_schema::ClassTable;
use rusqlite::Connection;
use std::collections::BTreeSet;

/// Every class table can be read, and none drops a class of the one before or changes its kind.
pub(super) fn classes(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    let mut statement = connection.prepare("SELECT DISTINCT from_version FROM class ORDER BY from_version")?;
    let mut rows = statement.query([])?;
    let mut last: Option<ClassTable> = None;
    while let Some(row) = rows.next()? {
        let from = VersionId(row.get::<_, i64>(0)?.unsigned_abs());
        let table = match classes_at(connection, from) {
            Ok(table) => table,
            Err(Fault::Damage(detail)) => {
                findings.add(format!("version {from}"), detail);
                continue;
            }
            Err(fault) => return Err(fault),
        };
        let is_lost =
            |class: &&resurvey_schema::Class| table.get(class.index).is_none_or(|kept| kept.kind != class.kind);
        if let Some(lost) = last.iter().flat_map(ClassTable::iter).find(is_lost) {
            findings.add(format!("version {from}"), format!("class {:?} is lost or of another kind", lost.name));
        }
        last = Some(table);
    }
    Ok(())
}

/// Versions are dense from 0, their times do not fall, and each says of itself what its rows say.
pub(super) fn versions(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    let mut statement = connection.prepare(&format!("SELECT {} FROM version ORDER BY version", VersionRow::COLUMNS))?;
    let mut rows = statement.query([])?;
    let mut last: Option<VersionRecord> = None;
    while let Some(row) = rows.next()? {
        let record = VersionRow::read(row)?;
        check_place(&record, last.as_ref(), findings);
        check_contents(connection, &record, last.as_ref(), findings)?;
        last = Some(record);
    }
    if last.is_none() {
        findings.add("version 0", "is missing");
    }
    Ok(())
}

/// What can be seen from the row and the one before.
fn check_place(record: &VersionRecord, last: Option<&VersionRecord>, findings: &mut Findings) {
    let place = || format!("version {}", record.version);
    let expected = last.map_or(0, |last| last.version.0 + 1);
    if record.version.0 != expected {
        findings.add(format!("version {expected}"), format!("is missing; the next is {}", record.version));
    }
    if let Some(last) = last.filter(|last| last.committed_at > record.committed_at) {
        findings.add(
            place(),
            format!("was made at {}, before version {} at {}", record.committed_at, last.version, last.committed_at),
        );
    }
    let is_first = record.version == VersionId(0);
    if is_first != (record.kind == VersionKind::Init) || is_first != record.base.is_none() {
        findings.add(place(), "version 0, and no other, is of kind init and without a base");
    }
    if (record.kind == VersionKind::Revert) != record.reverts.is_some() {
        findings.add(place(), "a version of kind revert, and no other, names what it undoes");
    }
}

/// What has to be recomputed from the rows of features and classes.
fn check_contents(
    connection: &Connection,
    record: &VersionRecord,
    last: Option<&VersionRecord>,
    findings: &mut Findings,
) -> Result<(), Fault> {
    let place = || format!("version {}", record.version);
    let Some(Recomputed { operations, deltas }) = recomputed(connection, record.version)? else {
        findings.add(place(), "cannot be recomputed, because a state or its class table cannot be read");
        return Ok(());
    };
    if let Some(deltas) = deltas {
        check_sums(record, &deltas, findings);
    }
    let hash = version_hash(last.map(|last| last.hash), operations, record.evidence);
    if hash != record.hash {
        findings.add(place(), format!("has hash {}, its operations and evidence give {hash}", record.hash));
    }
    Ok(())
}

/// What a version did.
struct Recomputed {
    /// Digest of all of it.
    operations: Digest,
    /// What it did to features; `None` where that is forgotten.
    deltas: Option<Vec<Delta>>,
}

/// What `version` did; `None` where it cannot be read.
fn recomputed(connection: &Connection, version: VersionId) -> Result<Option<Recomputed>, Fault> {
    if let Some(remains) = remains_of(connection, version)? {
        return Ok(Some(Recomputed { operations: remains.operations, deltas: None }));
    }
    let read = deltas_of(connection, version).and_then(|deltas| {
        Ok(Recomputed { operations: operations_digest(connection, version, &deltas)?, deltas: Some(deltas) })
    });
    match read {
        // What it is is found by the checks of states and classes.
        Err(Fault::Damage(_)) => Ok(None),
        other => other.map(Some),
    }
}

/// Versions that are not what their hash says, or, where the way to a state is forgotten, what the digest of that says.
pub(in crate::store) fn doubtful(connection: &Connection) -> Result<BTreeSet<VersionId>, Fault> {
    let mut statement = connection.prepare(&format!("SELECT {} FROM version ORDER BY version", VersionRow::COLUMNS))?;
    let mut rows = statement.query([])?;
    let (mut parent, mut all, mut doubtful) = (None, Vec::new(), BTreeSet::new());
    while let Some(row) = rows.next()? {
        let version = VersionId(row.get::<_, i64>(0)?.unsigned_abs());
        all.push(version);
        let Ok(VersionRecord { evidence, hash, .. }) = VersionRow::read(row) else {
            doubtful.insert(version);
            parent = None;
            continue;
        };
        let is_so = |done: Recomputed| version_hash(parent, done.operations, evidence) == hash;
        if !recomputed(connection, version)?.is_some_and(is_so) {
            doubtful.insert(version);
        }
        parent = Some(hash);
    }
    if format_of(connection)? >= SEALED_FORMAT {
        for kept in kept_states(connection)? {
            if !kept.found(connection).is_ok_and(|found| kept.digest == Some(found)) {
                doubtful.extend(all.iter().filter(|version| (kept.before < **version) && (**version <= kept.version)));
            }
        }
    }
    Ok(doubtful)
}

fn check_sums(record: &VersionRecord, deltas: &[Delta], findings: &mut Findings) {
    let place = || format!("version {}", record.version);
    let (counts, said) = (Counts::of(deltas), record.counts.unwrap_or_default());
    if counts != said {
        findings.add(place(), format!("says {said:?}, its features say {counts:?}"));
    }
    let envelope = envelope_of(deltas);
    if envelope != record.envelope {
        findings.add(place(), format!("has envelope {:?}, its features have {envelope:?}", record.envelope));
    }
}

/// Head and tagged versions are there, what follows a forgotten version says so, and no state is kept for forgotten
/// versions alone.
pub(super) fn forgotten(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    const TAGS: &str = "SELECT name, version FROM tag ORDER BY name";
    let remains = all_remains(connection)?;
    let is_gone = |version: &VersionId| remains.get(version).is_some_and(|remains| !remains.has_state);
    let head = head(connection)?.version;
    if is_gone(&head) {
        findings.add(format!("version {head}"), "is the newest and forgotten");
    }
    let mut statement = connection.prepare(TAGS)?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        let (name, version): (String, i64) = (row.get(0)?, row.get(1)?);
        if is_gone(&VersionId(version.unsigned_abs())) {
            findings.add(format!("tag {name:?}"), format!("names version {version}, which is forgotten"));
        }
    }
    for (version, remains_here) in &remains {
        let before = VersionId(version.0.wrapping_sub(1));
        if remains_here.has_state && !is_gone(&before) {
            findings.add(format!("version {version}"), format!("is cut off from version {before}, which is there"));
        }
        let next = VersionId(version.0 + 1);
        if !remains_here.has_state && next <= head && !remains.contains_key(&next) {
            findings.add(format!("version {next}"), "follows a forgotten version and does not say so");
        }
    }
    for Unreachable { fid, from, .. } in unreachable(connection)? {
        findings.add(format!("feature {fid} from version {from}"), "is in no version that is kept");
    }
    Ok(())
}

fn envelope_of(deltas: &[Delta]) -> Option<BoxMm> {
    let states = deltas.iter().flat_map(|delta| delta.before().into_iter().chain(delta.after()));
    states.filter_map(|state| state.bounds().ok()).reduce(|all, bounds| all.union(&bounds))
}
