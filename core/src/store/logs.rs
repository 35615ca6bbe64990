//! The records of versions, and which of them changed something where.

use super::StoreError;
use super::error::Fault;
use super::forgotten::{all_remains, is_kept};
use super::index::{self, Ids, LIVE};
use super::interface::steps;
use super::map_file::MapFile;
use super::observations::{self, RecordedObservation};
use super::rows::VersionRow;
use super::states::{check_version, lives};
use crate::version::{BoxMm, Counts, Fid, Step, VersionId, VersionRecord};
use rusqlite::{Connection, named_params};
use std::collections::BTreeMap;

/// One step in the life of a feature, with what was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// The version that made the step.
    pub record: VersionRecord,
    /// The step, as far as the states that are left tell.
    pub step: Step,
    /// The evidence, where the version has any.
    pub observation: Option<RecordedObservation>,
}

impl MapFile {
    /// The steps in the life of `fid`, newest first, each with its evidence.
    pub fn why(&self, fid: Fid) -> Result<Vec<Provenance>, StoreError> {
        self.read(|connection| {
            let mut provenance = Vec::new();
            for step in steps(lives(connection, fid)?, |version| is_kept(connection, version))?.into_iter().rev() {
                let observation = observations::of_version(connection, step.version)?;
                provenance.push(Provenance { record: record(connection, step.version)?, step, observation });
            }
            Ok(provenance)
        })
    }
}

/// Every version, newest first.
pub(super) fn all_records(connection: &Connection) -> Result<Vec<VersionRecord>, Fault> {
    let sql = format!("SELECT {} FROM version ORDER BY version DESC", VersionRow::COLUMNS);
    let mut statement = connection.prepare_cached(&sql)?;
    let mut rows = statement.query([])?;
    let mut records = Vec::new();
    while let Some(row) = rows.next()? {
        records.push(VersionRow::read(row)?);
    }
    Ok(records)
}

/// The versions that changed something in `region`, newest first, each with the counts of just that, where all of that is
/// left.
pub(super) fn records_in(connection: &Connection, region: &BoxMm) -> Result<Vec<VersionRecord>, Fault> {
    let remains = all_remains(connection)?;
    let mut records = Vec::new();
    for (version, counts) in counts_in(connection, region)?.into_iter().rev() {
        let counts = (!remains.contains_key(&version)).then_some(counts);
        records.push(VersionRecord { counts, ..record(connection, version)? });
    }
    Ok(records)
}

/// The version numbered `version`.
pub(super) fn record(connection: &Connection, version: VersionId) -> Result<VersionRecord, Fault> {
    let sql = format!("SELECT {} FROM version WHERE version = :version ORDER BY version", VersionRow::COLUMNS);
    let mut statement = connection.prepare_cached(&sql)?;
    let mut rows = statement.query(named_params! {":version": version.0 as i64})?;
    match rows.next()? {
        Some(row) => VersionRow::read(row),
        None => {
            check_version(connection, version)?;
            Err(Fault::Damage(format!("version {version} is missing")))
        }
    }
}

/// For every version, how many features it changed that lie in `region` before or after.
fn counts_in(connection: &Connection, region: &BoxMm) -> Result<BTreeMap<VersionId, Counts>, Fault> {
    // The state before, if there was one, is the last that began earlier.
    const BEGAN: &str = "SELECT f.fid, f.from_version,
            coalesce(f.from_version = (SELECT p.to_version FROM feature_version AS p
                WHERE p.fid = f.fid AND p.from_version < f.from_version ORDER BY p.from_version DESC LIMIT 1), 0), 1";
    const ENDED: &str = "SELECT f.fid, f.to_version, 1,
            EXISTS (SELECT 1 FROM feature_version AS n WHERE n.fid = f.fid AND n.from_version = f.to_version)";
    let mut changed = BTreeMap::new();
    let lives = index::lives_in(connection, region, 0..=LIVE)?;
    for (select, until) in [(BEGAN, LIVE), (ENDED, LIVE - 1)] {
        let ids = Ids::of(lives.iter().filter(|life| life.last <= until).map(|life| life.id));
        let sql = format!("{select} FROM {} ORDER BY f.id", Ids::ROWS);
        let mut statement = connection.prepare_cached(&sql)?;
        let mut rows = statement.query(named_params! {":ids": ids.json()})?;
        while let Some(row) = rows.next()? {
            let (fid, version): (i64, i64) = (row.get(0)?, row.get(1)?);
            changed.insert((version, fid), (row.get(2)?, row.get(3)?));
        }
    }
    let mut counts: BTreeMap<VersionId, Counts> = BTreeMap::new();
    for ((version, _), (has_before, has_after)) in changed {
        counts.entry(VersionId(version.unsigned_abs())).or_default().count(has_before, has_after);
    }
    Ok(counts)
}
