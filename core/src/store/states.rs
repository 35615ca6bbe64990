//! The states of features at one version, out of their rows.

use super::error::{Fault, StoreError};
use super::index::IndexOrigin;
use super::rows::{FEATURE_COLUMNS, feature, head};
use crate::version::{BoxMm, Digest, Feature, Fid, VersionId};
use rusqlite::{Connection, OptionalExtension, ToSql, named_params};

/// The bytes of the geometry that `digest` names.
pub(super) fn geometry(connection: &Connection, digest: Digest) -> Result<Vec<u8>, Fault> {
    const SQL: &str = "SELECT bytes FROM geometry WHERE digest = :digest ORDER BY digest";
    let mut statement = connection.prepare_cached(SQL)?;
    let bytes = statement.query_row(named_params! {":digest": digest.0}, |row| row.get(0)).optional()?;
    bytes.ok_or(StoreError::NoSuchGeometry { digest }.into())
}

/// Every feature at `version`.
pub(super) fn all_features(connection: &Connection, version: VersionId) -> Result<Vec<Feature>, Fault> {
    let sql = format!(
        "SELECT {FEATURE_COLUMNS} FROM feature_version AS f
        WHERE f.from_version <= :version AND (f.to_version IS NULL OR f.to_version > :version) ORDER BY f.fid"
    );
    features(connection, &sql, named_params! {":version": version.0 as i64})
}

/// The features at `version` whose box shares a point with `region`.
pub(super) fn features_in(connection: &Connection, version: VersionId, region: &BoxMm) -> Result<Vec<Feature>, Fault> {
    let Some(origin) = IndexOrigin::read(connection)? else { return Ok(Vec::new()) };
    let Some([e0, e1, n0, n1, h0, h1]) = origin.clamp(region) else { return Ok(Vec::new()) };
    // The cross join keeps the index on the outside whatever the planner's statistics say.
    let sql = format!(
        "SELECT {FEATURE_COLUMNS} FROM feature_index AS i CROSS JOIN feature_version AS f ON f.id = i.id
        WHERE i.e0 <= :e1 AND i.e1 >= :e0 AND i.n0 <= :n1 AND i.n1 >= :n0 AND i.h0 <= :h1 AND i.h1 >= :h0
            AND i.v0 <= :version AND i.v1 >= :version ORDER BY f.fid"
    );
    let parameters = named_params! {
        ":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":h0": h0, ":h1": h1, ":version": version.0 as i64,
    };
    features(connection, &sql, parameters)
}

/// The smallest box around all features at `version`. Reads the whole index.
pub(super) fn bounds(connection: &Connection, version: VersionId) -> Result<Option<BoxMm>, Fault> {
    const SQL: &str = "SELECT min(e0), max(e1), min(n0), max(n1), min(h0), max(h1) FROM feature_index
        WHERE v0 <= :version AND v1 >= :version ORDER BY 1";
    let Some(origin) = IndexOrigin::read(connection)? else { return Ok(None) };
    let mut statement = connection.prepare_cached(SQL)?;
    let mut rows = statement.query(named_params! {":version": version.0 as i64})?;
    let Some(row) = rows.next()? else { return Ok(None) };
    let mut ends = [0; 6];
    for (column, end) in ends.iter_mut().enumerate() {
        let Some(value) = row.get::<_, Option<i64>>(column)? else { return Ok(None) };
        *end = value;
    }
    Ok(origin.box_at(&ends))
}

/// Refuses a version above the newest.
pub(super) fn check_version(connection: &Connection, version: VersionId) -> Result<(), Fault> {
    let head = head(connection)?.version;
    if version > head { Err(StoreError::NoSuchVersion { version, head }.into()) } else { Ok(()) }
}

/// The feature `fid` at `version`, if it was there.
pub(super) fn feature_at(connection: &Connection, fid: Fid, version: VersionId) -> Result<Option<Feature>, Fault> {
    let sql = format!(
        "SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE f.fid = :fid AND f.from_version <= :version
            AND (f.to_version IS NULL OR f.to_version > :version) ORDER BY f.from_version DESC LIMIT 1"
    );
    let parameters = named_params! {":fid": fid.0 as i64, ":version": version.0 as i64};
    Ok(features(connection, &sql, parameters)?.pop())
}

/// Every life span of `fid`, oldest first.
pub(super) fn lives(connection: &Connection, fid: Fid) -> Result<Vec<Feature>, Fault> {
    let sql = format!("SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE f.fid = :fid ORDER BY f.from_version");
    let lives = features(connection, &sql, named_params! {":fid": fid.0 as i64})?;
    if lives.is_empty() { Err(StoreError::NeverAFeature { fid }.into()) } else { Ok(lives) }
}

/// The features that `sql` selects as [`FEATURE_COLUMNS`].
pub(super) fn features(
    connection: &Connection,
    sql: &str,
    parameters: &[(&str, &dyn ToSql)],
) -> Result<Vec<Feature>, Fault> {
    let mut statement = connection.prepare_cached(sql)?;
    let mut rows = statement.query(parameters)?;
    let mut features = Vec::new();
    while let Some(row) = rows.next()? {
        features.push(feature(row)?);
    }
    Ok(features)
}
