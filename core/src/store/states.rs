//! The states of features at one version, out of their rows.

use super::error::{Fault, StoreError};
use super::rows::{FEATURE_COLUMNS, feature, head};
use crate::version::{Digest, Feature, FeatureState, Fid, VersionId};
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

/// What `fid` is, or was last; `None` when no version has it.
pub(super) fn last_state(connection: &Connection, fid: Fid) -> Result<Option<FeatureState>, Fault> {
    let sql = format!(
        "SELECT {FEATURE_COLUMNS} FROM feature_version AS f WHERE f.fid = :fid ORDER BY f.from_version DESC LIMIT 1"
    );
    Ok(features(connection, &sql, named_params! {":fid": fid.0 as i64})?.pop().map(|feature| feature.state))
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
