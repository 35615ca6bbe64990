//! Digests of whole states, of versions to which gc removed the way.

use super::error::Fault;
use super::rows::classes_at;
use super::seal::FORGOTTEN;
use crate::version::{Digest, Fid, VersionId, WholeState};
use rusqlite::{Connection, named_params};

/// A version to which the way is forgotten.
pub(super) struct KeptState {
    pub(super) version: VersionId,
    /// The version before it whose state is whole.
    pub(super) before: VersionId,
    /// What its state was when the hash chain proved it; `None` where that was not written down.
    pub(super) digest: Option<Digest>,
}

/// Every such version.
pub(super) fn kept_states(connection: &Connection) -> Result<Vec<KeptState>, Fault> {
    const SQL: &str = "SELECT f.version, f.state, coalesce((SELECT max(v.version) FROM version AS v
            WHERE v.version < f.version
            AND NOT EXISTS (SELECT 1 FROM forgotten AS g WHERE g.version = v.version AND g.has_state = 0)), 0)
        FROM forgotten AS f WHERE f.has_state = 1 ORDER BY f.version";
    let mut statement = connection.prepare(SQL)?;
    let version = |number: i64| VersionId(number.unsigned_abs());
    let states = statement.query_map([], |row| {
        let digest = row.get::<_, Option<[u8; 32]>>(1)?.map(Digest);
        Ok(KeptState { version: version(row.get(0)?), before: version(row.get(2)?), digest })
    })?;
    Ok(states.collect::<Result<_, _>>()?)
}

impl KeptState {
    /// Digest of the state as it is now, and of the ends of lives since the version before. Reads all of it.
    pub(super) fn found(&self, connection: &Connection) -> Result<Digest, Fault> {
        const FEATURES: &str = "SELECT fid, from_version, state FROM feature_version
            WHERE from_version <= :version AND (to_version IS NULL OR to_version > :version)
            ORDER BY fid, from_version";
        const ENDED: &str = "SELECT fid, from_version, to_version FROM feature_version
            WHERE to_version > :before AND to_version <= :version AND to_version IS NOT NULL
            ORDER BY fid, from_version";
        let (version, before) = (self.version.0 as i64, self.before.0 as i64);
        let number = |number: i64| number.unsigned_abs();
        let mut whole = WholeState::start(&classes_at(connection, self.version)?);
        let mut statement = connection.prepare_cached(FEATURES)?;
        let mut rows = statement.query(named_params! {":version": version})?;
        while let Some(row) = rows.next()? {
            let state = row.get_ref(2)?.as_blob().map_err(rusqlite::Error::from)?;
            whole.feature(Fid(number(row.get(0)?)), VersionId(number(row.get(1)?)), state);
        }
        whole.end_features();
        let mut statement = connection.prepare_cached(ENDED)?;
        let mut rows = statement.query(named_params! {":version": version, ":before": before})?;
        while let Some(row) = rows.next()? {
            let [from, to] = [row.get::<_, i64>(1)?, row.get(2)?].map(|version| VersionId(number(version)));
            whole.ended(Fid(number(row.get(0)?)), from, to);
        }
        Ok(whole.finish())
    }
}

/// Writes down what the state of each version is to which the way is forgotten, and seals what is known of forgotten
/// versions.
pub(super) fn write_kept_states(connection: &Connection) -> Result<(), Fault> {
    const GONE: &str = "UPDATE forgotten SET state = NULL WHERE has_state = 0 AND state IS NOT NULL";
    const KEPT: &str = "UPDATE forgotten SET state = :state WHERE version = :version";
    connection.execute(GONE, [])?;
    for kept in kept_states(connection)? {
        let state = kept.found(connection)?;
        connection.execute(KEPT, named_params! {":state": state.0, ":version": kept.version.0 as i64})?;
    }
    FORGOTTEN.seal_all(connection)
}
