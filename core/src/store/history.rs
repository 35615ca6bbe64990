//! Questions about history: versions, logs, differences, provenance.

use super::error::{Fault, StoreError};
use super::forgotten::check_state;
use super::index::IndexOrigin;
use super::map_file::MapFile;
use super::observations::{self, RecordedObservation};
use super::rows::{FEATURE_COLUMNS, VersionRow};
use super::snapshot::{check_version, feature_at, features};
use crate::version::{BoxMm, Counts, Delta, Feature, FeatureState, Fid, VersionId, VersionRecord};
use rusqlite::{Connection, ToSql, named_params};
use std::collections::BTreeMap;

/// One step in the life of a feature, with what was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// The version that made the step.
    pub record: VersionRecord,
    /// The step.
    pub delta: Delta,
    /// The evidence, where the version has any.
    pub observation: Option<RecordedObservation>,
}

/// Both sides of a feature while they are being found.
type Sides = (Option<FeatureState>, Option<FeatureState>);

impl MapFile {
    /// The version numbered `version`.
    pub fn version(&self, version: VersionId) -> Result<VersionRecord, StoreError> {
        self.read(|connection| record(connection, version))
    }

    /// Every version, newest first.
    pub fn log(&self) -> Result<Vec<VersionRecord>, StoreError> {
        let sql = format!("SELECT {} FROM version ORDER BY version DESC", VersionRow::COLUMNS);
        self.read(|connection| {
            let mut statement = connection.prepare_cached(&sql)?;
            let mut rows = statement.query([])?;
            let mut records = Vec::new();
            while let Some(row) = rows.next()? {
                records.push(VersionRow::read(row)?);
            }
            Ok(records)
        })
    }

    /// The versions that changed something in `region`, newest first, each with the counts of just that.
    pub fn log_in(&self, region: &BoxMm) -> Result<Vec<VersionRecord>, StoreError> {
        self.read(|connection| {
            let mut records = Vec::new();
            for (version, counts) in counts_in(connection, region)?.into_iter().rev() {
                records.push(VersionRecord { counts, ..record(connection, version)? });
            }
            Ok(records)
        })
    }

    /// The versions that changed the feature `fid`, newest first, each with the counts of just that.
    pub fn log_of(&self, fid: Fid) -> Result<Vec<VersionRecord>, StoreError> {
        self.read(|connection| {
            let mut records = Vec::new();
            for (version, delta) in steps(connection, fid)?.into_iter().rev() {
                records.push(VersionRecord { counts: Counts::of([&delta]), ..record(connection, version)? });
            }
            Ok(records)
        })
    }

    /// The steps in the life of `fid`, newest first, each with its evidence.
    pub fn why(&self, fid: Fid) -> Result<Vec<Provenance>, StoreError> {
        self.read(|connection| {
            let mut provenance = Vec::new();
            for (version, delta) in steps(connection, fid)?.into_iter().rev() {
                let observation = observations::of_version(connection, version)?;
                provenance.push(Provenance { record: record(connection, version)?, delta, observation });
            }
            Ok(provenance)
        })
    }

    /// What `version` did, by rising feature number.
    pub fn changes_of(&self, version: VersionId) -> Result<Vec<Delta>, StoreError> {
        self.changes(VersionId(version.0.saturating_sub(1)), version)
    }

    /// What differs between `from` and `to`, by rising feature number: the way back where `to` is the earlier one. What
    /// changed and changed back is no difference.
    pub fn changes(&self, from: VersionId, to: VersionId) -> Result<Vec<Delta>, StoreError> {
        const ADDED: &str = "WHERE f.from_version > :a AND f.from_version <= :b
            AND (f.to_version IS NULL OR f.to_version > :b) ORDER BY f.fid";
        const REMOVED: &str = "WHERE f.from_version <= :a AND f.to_version IS NOT NULL
            AND f.to_version > :a AND f.to_version <= :b ORDER BY f.fid";
        self.read(|connection| {
            difference(connection, from, to, |early, late| {
                let parameters = named_params! {":a": early.0 as i64, ":b": late.0 as i64};
                let select = |condition| {
                    let sql = format!("SELECT {FEATURE_COLUMNS} FROM feature_version AS f {condition}");
                    features(connection, &sql, parameters)
                };
                Ok((select(REMOVED)?, select(ADDED)?))
            })
        })
    }

    /// As [`MapFile::changes`], of the features that lie in `region` before or after.
    pub fn changes_in(&self, from: VersionId, to: VersionId, region: &BoxMm) -> Result<Vec<Delta>, StoreError> {
        const ADDED: &str = "AND i.v0 > :a AND i.v0 <= :b AND i.v1 >= :b ORDER BY f.fid";
        const REMOVED: &str = "AND i.v0 <= :a AND i.v1 >= :a AND i.v1 < :b ORDER BY f.fid";
        self.read(|connection| {
            difference(connection, from, to, |early, late| {
                let versions: [(&str, &dyn ToSql); 2] = [(":a", &(early.0 as i64)), (":b", &(late.0 as i64))];
                let select = |condition| in_region(connection, region, condition, &versions);
                Ok((select(REMOVED)?, select(ADDED)?))
            })
        })
    }
}

/// The version numbered `version`.
fn record(connection: &Connection, version: VersionId) -> Result<VersionRecord, Fault> {
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

/// The features in `region` that meet `condition` on the index `i` and the row `f`, over all versions.
fn in_region(
    connection: &Connection,
    region: &BoxMm,
    condition: &str,
    parameters: &[(&str, &dyn ToSql)],
) -> Result<Vec<Feature>, Fault> {
    let Some(origin) = IndexOrigin::read(connection)? else { return Ok(Vec::new()) };
    let Some(ends) = origin.clamp(region) else { return Ok(Vec::new()) };
    let sql = format!(
        "SELECT {FEATURE_COLUMNS} FROM feature_index AS i CROSS JOIN feature_version AS f ON f.id = i.id
        WHERE i.e0 <= :e1 AND i.e1 >= :e0 AND i.n0 <= :n1 AND i.n1 >= :n0 AND i.h0 <= :h1 AND i.h1 >= :h0 {condition}"
    );
    let names = [":e0", ":e1", ":n0", ":n1", ":h0", ":h1"];
    let box_parameters = names.into_iter().zip(ends.iter().map(|end| end as &dyn ToSql));
    let all: Vec<_> = box_parameters.chain(parameters.iter().copied()).collect();
    features(connection, &sql, &all)
}

/// Pairs what `select` finds to have gone and come between two versions into deltas from `from` to `to`.
fn difference(
    connection: &Connection,
    from: VersionId,
    to: VersionId,
    select: impl FnOnce(VersionId, VersionId) -> Result<(Vec<Feature>, Vec<Feature>), Fault>,
) -> Result<Vec<Delta>, Fault> {
    check_state(connection, from.max(to))?;
    check_state(connection, from.min(to))?;
    let (early, late) = (from.min(to), from.max(to));
    let (gone, come) = select(early, late)?;
    let mut sides: BTreeMap<Fid, Sides> = BTreeMap::new();
    gone.into_iter().for_each(|feature| sides.entry(feature.fid).or_default().0 = Some(feature.state));
    come.into_iter().for_each(|feature| sides.entry(feature.fid).or_default().1 = Some(feature.state));
    let mut deltas = Vec::new();
    for (fid, (before, after)) in sides {
        // The other side may lie outside the region.
        let before = or_state_at(connection, before, fid, early)?;
        let after = or_state_at(connection, after, fid, late)?;
        if before != after {
            let delta = Delta::from_sides(fid, before, after);
            deltas.extend(delta.map(|delta| if from > to { delta.undone() } else { delta }));
        }
    }
    Ok(deltas)
}

fn or_state_at(
    connection: &Connection,
    known: Option<FeatureState>,
    fid: Fid,
    version: VersionId,
) -> Result<Option<FeatureState>, Fault> {
    match known {
        Some(state) => Ok(Some(state)),
        None => Ok(feature_at(connection, fid, version)?.map(|feature| feature.state)),
    }
}

/// Every version that changed `fid` and how, oldest first.
fn steps(connection: &Connection, fid: Fid) -> Result<Vec<(VersionId, Delta)>, Fault> {
    let sql = format!("SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE f.fid = :fid ORDER BY f.from_version");
    let lives = features(connection, &sql, named_params! {":fid": fid.0 as i64})?;
    if lives.is_empty() {
        return Err(StoreError::NeverAFeature { fid }.into());
    }
    let mut sides: BTreeMap<VersionId, Sides> = BTreeMap::new();
    for life in lives {
        sides.entry(life.from).or_default().1 = Some(life.state.clone());
        if let Some(to) = life.to {
            sides.entry(to).or_default().0 = Some(life.state);
        }
    }
    let step = |(version, (before, after))| Some((version, Delta::from_sides(fid, before, after)?));
    Ok(sides.into_iter().filter_map(step).collect())
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
    if let Some(ends) = IndexOrigin::read(connection)?.and_then(|origin| origin.clamp(region)) {
        for (select, condition) in [(BEGAN, ""), (ENDED, "AND i.v1 < 2147483647")] {
            let sql = format!(
                "{select} FROM feature_index AS i CROSS JOIN feature_version AS f ON f.id = i.id
                WHERE i.e0 <= ?2 AND i.e1 >= ?1 AND i.n0 <= ?4 AND i.n1 >= ?3 AND i.h0 <= ?6 AND i.h1 >= ?5
                    {condition} ORDER BY f.id"
            );
            let mut statement = connection.prepare_cached(&sql)?;
            let mut rows = statement.query(ends)?;
            while let Some(row) = rows.next()? {
                let (fid, version): (i64, i64) = (row.get(0)?, row.get(1)?);
                changed.insert((version, fid), (row.get(2)?, row.get(3)?));
            }
        }
    }
    let mut counts: BTreeMap<VersionId, Counts> = BTreeMap::new();
    for ((version, _), (has_before, has_after)) in changed {
        counts.entry(VersionId(version.unsigned_abs())).or_default().count(has_before, has_after);
    }
    Ok(counts)
}
