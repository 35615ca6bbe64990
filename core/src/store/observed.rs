//! The second time axis: what the map of a version says of the world at a time. Each version speaks of the time when the
//! world was seen so, or, where nobody said, of the time when it came into the map (Snodgrass, Developing Time-Oriented
//! Database Applications in SQL, 2000: valid time beside transaction time).

use super::error::{Fault, StoreError};
use super::forgotten::all_remains;
use super::index::IndexOrigin;
use super::rows::{FEATURE_COLUMNS, timestamp};
use super::snapshot::{Snapshot, features};
use crate::version::{BoxMm, Feature, Fid, VersionId};
use jiff::Timestamp;
use rusqlite::{Connection, named_params};
use std::collections::{BTreeMap, BTreeSet};

/// When the world was as each version says, by version.
type ObservedTimes = BTreeMap<VersionId, Timestamp>;

impl Snapshot<'_> {
    /// Every feature that was there at `time` as this version knows it, by rising number: of the versions up to this one
    /// that changed a feature, the one that was seen last at or before `time` decides.
    pub fn features_observed(&self, time: Timestamp) -> Result<Vec<Feature>, StoreError> {
        self.map.read(|connection| {
            let sql = format!(
                "SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE f.from_version <= :version
                ORDER BY f.fid, f.from_version"
            );
            let lives = features(connection, &sql, named_params! {":version": self.version.0 as i64})?;
            self.observed(connection, lives, time)
        })
    }

    /// As [`Snapshot::features_observed`], of those whose box shares a point with `region`.
    pub fn features_observed_in(&self, time: Timestamp, region: &BoxMm) -> Result<Vec<Feature>, StoreError> {
        const FIDS: &str = "SELECT DISTINCT f.fid FROM feature_index AS i
            CROSS JOIN feature_version AS f ON f.id = i.id
            WHERE i.e0 <= :e1 AND i.e1 >= :e0 AND i.n0 <= :n1 AND i.n1 >= :n0 AND i.h0 <= :h1 AND i.h1 >= :h0
                AND i.v0 <= :version ORDER BY f.fid";
        let version = self.version.0 as i64;
        self.map.read(|connection| {
            let Some(origin) = IndexOrigin::read(connection)? else { return Ok(Vec::new()) };
            let Some([e0, e1, n0, n1, h0, h1]) = origin.clamp(region) else { return Ok(Vec::new()) };
            let mut statement = connection.prepare_cached(FIDS)?;
            let parameters = named_params! {
                ":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":h0": h0, ":h1": h1, ":version": version,
            };
            let fids = statement.query_map(parameters, |row| row.get::<_, i64>(0))?.collect::<Result<Vec<_>, _>>()?;
            let sql = format!(
                "SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE f.fid = :fid AND f.from_version <= :version
                ORDER BY f.from_version"
            );
            let mut lives = Vec::new();
            for fid in fids {
                lives.extend(features(connection, &sql, named_params! {":fid": fid, ":version": version})?);
            }
            let mut found = self.observed(connection, lives, time)?;
            found.retain(|feature| feature.state.bounds().is_ok_and(|bounds| bounds.intersects(region)));
            Ok(found)
        })
    }

    /// Of `lives`, by feature and version, those that hold at `time`.
    fn observed(&self, connection: &Connection, lives: Vec<Feature>, time: Timestamp) -> Result<Vec<Feature>, Fault> {
        let times = observed_times(connection, self.version)?;
        check_remembered(connection, &times, time)?;
        let mut by_feature: BTreeMap<Fid, Vec<Feature>> = BTreeMap::new();
        lives.into_iter().for_each(|life| by_feature.entry(life.fid).or_default().push(life));
        Ok(by_feature.into_values().filter_map(|lives| decided(lives, &times, time)).collect())
    }
}

/// The life of one feature that holds at `time`, if any: the last event seen at or before it decides, the later version
/// where two were seen at once.
fn decided(lives: Vec<Feature>, times: &ObservedTimes, time: Timestamp) -> Option<Feature> {
    let begins: BTreeSet<VersionId> = lives.iter().map(|life| life.from).collect();
    let ends = lives.iter().filter_map(|life| life.to).filter(|to| !begins.contains(to));
    let events = begins.iter().copied().chain(ends).filter_map(|version| Some((*times.get(&version)?, version)));
    let (_, last) = events.filter(|(seen, _)| *seen <= time).max()?;
    lives.into_iter().find(|life| life.from == last)
}

fn observed_times(connection: &Connection, until: VersionId) -> Result<ObservedTimes, Fault> {
    const SQL: &str = "SELECT version, coalesce(observed_at, committed_at) FROM version WHERE version <= :until
        ORDER BY version";
    let mut statement = connection.prepare_cached(SQL)?;
    let mut rows = statement.query(named_params! {":until": until.0 as i64})?;
    let mut times = ObservedTimes::new();
    while let Some(row) = rows.next()? {
        times.insert(VersionId(row.get::<_, i64>(0)?.unsigned_abs()), timestamp(row.get(1)?)?);
    }
    Ok(times)
}

/// Refuses a time of which the versions that are left cannot tell: a forgotten version spoke of it, and the first that was
/// kept after it does not sum it up.
fn check_remembered(connection: &Connection, times: &ObservedTimes, time: Timestamp) -> Result<(), Fault> {
    let remains = all_remains(connection)?;
    let is_forgotten = |version: &VersionId| remains.get(version).is_some_and(|remains| !remains.has_state);
    let mut forgotten = times.iter().filter(|(version, _)| is_forgotten(version));
    let Some((last, _)) = forgotten.clone().next_back() else { return Ok(()) };
    if forgotten.all(|(_, seen)| *seen > time) {
        return Ok(());
    }
    let next = VersionId(last.0 + 1);
    let seen: Vec<Timestamp> = times.range(..=next).map(|(_, seen)| *seen).collect();
    if seen.is_sorted() && seen.last().is_some_and(|last| *last <= time) {
        return Ok(());
    }
    Err(StoreError::ForgottenTime { time, next }.into())
}
