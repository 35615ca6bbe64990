//! The second time axis: what the map of a version says of the world at a time. Each version speaks of the time when the
//! world was seen so, or, where nobody said, of the time when it came into the map (Snodgrass, Developing Time-Oriented
//! Database Applications in SQL, 2000: valid time beside transaction time).

use super::error::{Fault, StoreError};
use super::forgotten::{all_remains, check_state};
use super::index::{self, Ids};
use super::rows::{FEATURE_COLUMNS, timestamp};
use super::states::features;
use crate::version::{BoxMm, Feature, Fid, VersionId};
use jiff::Timestamp;
use rusqlite::{Connection, named_params};
use std::collections::{BTreeMap, BTreeSet};

/// When the world was as each version says, by version.
pub(super) type ObservedTimes = BTreeMap<VersionId, Timestamp>;

/// The features that were there at `time` as `version` knows it; with a region those whose box shares a point with it.
pub(super) fn features_observed(
    connection: &Connection,
    version: VersionId,
    time: Timestamp,
    region: Option<&BoxMm>,
) -> Result<Vec<Feature>, Fault> {
    check_state(connection, version)?;
    let lives = match region {
        Some(region) => lives_in(connection, version, region)?,
        None => {
            let sql = format!(
                "SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE f.from_version <= :version
                ORDER BY f.fid, f.from_version"
            );
            features(connection, &sql, named_params! {":version": version.0 as i64})?
        }
    };
    let times = observed_times(connection, version)?;
    check_remembered(connection, &times, time)?;
    let mut found = decided(lives, &times, time);
    if let Some(region) = region {
        found.retain(|feature| feature.state.bounds().is_ok_and(|bounds| bounds.intersects(region)));
    }
    Ok(found)
}

/// All lives up to `version` of the features that were ever in `region`.
fn lives_in(connection: &Connection, version: VersionId, region: &BoxMm) -> Result<Vec<Feature>, Fault> {
    let ids = Ids::of(index::lives_in(connection, region, 0..=version.0 as i64)?.iter().map(|life| life.id));
    let mut statement =
        connection.prepare_cached(&format!("SELECT DISTINCT f.fid FROM {} ORDER BY f.fid", Ids::ROWS))?;
    let fids = statement.query_map(named_params! {":ids": ids.json()}, |row| row.get::<_, i64>(0))?;
    let fids = fids.collect::<Result<Vec<_>, _>>()?;
    let sql = format!(
        "SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE f.fid = :fid AND f.from_version <= :version
        ORDER BY f.from_version"
    );
    let mut lives = Vec::new();
    for fid in fids {
        lives.extend(features(connection, &sql, named_params! {":fid": fid, ":version": version.0 as i64})?);
    }
    Ok(lives)
}

/// Of `lives`, by feature and version, those that hold at `time`.
pub(super) fn decided(lives: Vec<Feature>, times: &ObservedTimes, time: Timestamp) -> Vec<Feature> {
    let mut by_feature: BTreeMap<Fid, Vec<Feature>> = BTreeMap::new();
    lives.into_iter().for_each(|life| by_feature.entry(life.fid).or_default().push(life));
    by_feature.into_values().filter_map(|lives| decided_life(lives, times, time)).collect()
}

/// The life of one feature that holds at `time`, if any: the last event seen at or before it decides, the later version
/// where two were seen at once.
fn decided_life(lives: Vec<Feature>, times: &ObservedTimes, time: Timestamp) -> Option<Feature> {
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
