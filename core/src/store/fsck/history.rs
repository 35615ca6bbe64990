//! History: dense versions, rising times, counts, envelopes, and the hash chain.

use super::problem::Findings;
use crate::store::error::Fault;
use crate::store::rows::{FEATURE_COLUMNS, VersionRow, classes_at};
use crate::store::snapshot::features;
use crate::version::{
    BoxMm, Counts, Delta, FeatureState, Fid, Frame, Operations, VersionId, VersionKind, VersionRecord, version_hash,
};
use resurvey_schema::ClassTable;
use rusqlite::{Connection, named_params};
use std::collections::BTreeMap;

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
}

/// What has to be recomputed from the rows of features and classes.
fn check_contents(
    connection: &Connection,
    record: &VersionRecord,
    last: Option<&VersionRecord>,
    findings: &mut Findings,
) -> Result<(), Fault> {
    let place = || format!("version {}", record.version);
    let deltas = match deltas_of(connection, record.version) {
        Ok(deltas) => deltas,
        // A state that cannot be read is found by the check of the states.
        Err(Fault::Damage(_)) => {
            findings.add(place(), "cannot be recomputed, because a state cannot be read");
            return Ok(());
        }
        Err(fault) => return Err(fault),
    };
    let counts = Counts::of(&deltas);
    if counts != record.counts {
        findings.add(place(), format!("says {:?}, its features say {counts:?}", record.counts));
    }
    let envelope = envelope_of(&deltas);
    if envelope != record.envelope {
        findings.add(place(), format!("has envelope {:?}, its features have {envelope:?}", record.envelope));
    }
    let frame = if last.is_none() { Some(frame(connection)?) } else { None };
    let classes = new_classes(connection, record.version)?;
    let mut operations = Operations::start(frame.as_ref(), classes.as_ref(), deltas.len() as u64);
    deltas.iter().for_each(|delta| operations.add(delta));
    let hash = version_hash(last.map(|last| last.hash), operations.finish(), record.evidence);
    if hash != record.hash {
        findings.add(place(), format!("has hash {}, its operations and evidence give {hash}", record.hash));
    }
    Ok(())
}

/// What the rows that end and begin at `version` say it did.
fn deltas_of(connection: &Connection, version: VersionId) -> Result<Vec<Delta>, Fault> {
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

fn envelope_of(deltas: &[Delta]) -> Option<BoxMm> {
    let states = deltas.iter().flat_map(|delta| delta.before().into_iter().chain(delta.after()));
    states.filter_map(|state| state.bounds().ok()).reduce(|all, bounds| all.union(&bounds))
}

fn frame(connection: &Connection) -> Result<Frame, Fault> {
    const SQL: &str = "SELECT crs, vertical_datum FROM meta ORDER BY only_row";
    Ok(connection.query_row(SQL, [], |row| Ok(Frame { crs: row.get(0)?, vertical_datum: row.get(1)? }))?)
}

/// The class table that `version` brought, if it brought one.
fn new_classes(connection: &Connection, version: VersionId) -> Result<Option<ClassTable>, Fault> {
    const SQL: &str = "SELECT EXISTS (SELECT 1 FROM class WHERE from_version = :version) ORDER BY 1";
    let mut statement = connection.prepare_cached(SQL)?;
    let is_new: bool = statement.query_row(named_params! {":version": version.0 as i64}, |row| row.get(0))?;
    if is_new { classes_at(connection, version).map(Some) } else { Ok(None) }
}
