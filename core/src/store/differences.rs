//! What differs between two versions, out of the rows that begin and end between them.

use super::error::Fault;
use super::forgotten::check_state;
use super::index;
use super::rows::FEATURE_COLUMNS;
use super::states::{feature_at, features};
use crate::version::{BoxMm, Delta, Feature, FeatureState, Fid, VersionId};
use rusqlite::{Connection, named_params};
use std::collections::BTreeMap;

/// Both sides of a feature while they are being found.
type Sides = (Option<FeatureState>, Option<FeatureState>);

/// What differs between `from` and `to`.
pub(super) fn changes(connection: &Connection, from: VersionId, to: VersionId) -> Result<Vec<Delta>, Fault> {
    const ADDED: &str = "WHERE f.from_version > :a AND f.from_version <= :b
        AND (f.to_version IS NULL OR f.to_version > :b) ORDER BY f.fid";
    const REMOVED: &str = "WHERE f.from_version <= :a AND f.to_version IS NOT NULL
        AND f.to_version > :a AND f.to_version <= :b ORDER BY f.fid";
    difference(connection, from, to, |early, late| {
        let parameters = named_params! {":a": early.0 as i64, ":b": late.0 as i64};
        let select = |condition| {
            let sql = format!("SELECT {FEATURE_COLUMNS} FROM feature_version AS f {condition}");
            features(connection, &sql, parameters)
        };
        Ok((select(REMOVED)?, select(ADDED)?))
    })
}

/// As [`changes`], of the features that lie in `region` before or after.
pub(super) fn changes_in(
    connection: &Connection,
    from: VersionId,
    to: VersionId,
    region: &BoxMm,
) -> Result<Vec<Delta>, Fault> {
    difference(connection, from, to, |early, late| index::difference(connection, [early, late], region))
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
