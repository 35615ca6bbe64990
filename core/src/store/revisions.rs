//! Names of versions: tags and dates.

use super::error::{Fault, StoreError};
use super::forgotten::check_state;
use super::map_file::WriteFault;
use super::rows::timestamp;
use super::seal;
use crate::version::{VersionId, is_tag_name};
use jiff::Timestamp;
use rusqlite::{Connection, OptionalExtension, named_params};

/// Names `version`.
pub(super) fn tag(
    connection: &Connection,
    name: &str,
    version: VersionId,
    now: Timestamp,
) -> Result<(), WriteFault<StoreError>> {
    const SQL: &str = "INSERT INTO tag (name, version, tagged_at) VALUES (:name, :version, :now)";
    check_tag_name(name)?;
    check_state(connection, version)?;
    if let Some(taken) = tagged(connection, name)? {
        return Err(StoreError::TagTaken { name: name.to_owned(), version: taken }.into());
    }
    let now = now.as_microsecond();
    connection.execute(SQL, named_params! {":name": name, ":version": version.0 as i64, ":now": now})?;
    Ok(seal::TAG.seal(connection, &name)?)
}

/// Refuses what cannot name a version.
pub(super) fn check_tag_name(name: &str) -> Result<(), StoreError> {
    if is_tag_name(name) { Ok(()) } else { Err(StoreError::TagName { name: name.to_owned() }) }
}

/// Takes the name away from the version it names, and returns that.
pub(super) fn untag(connection: &Connection, name: &str) -> Result<VersionId, WriteFault<StoreError>> {
    const SQL: &str = "DELETE FROM tag WHERE name = :name";
    let version = tagged(connection, name)?;
    connection.execute(SQL, named_params! {":name": name})?;
    version.ok_or_else(|| StoreError::NoSuchTag { name: name.to_owned() }.into())
}

/// Every tag and what it names, by name.
pub(super) fn tags(connection: &Connection) -> Result<Vec<(String, VersionId)>, Fault> {
    const SQL: &str = "SELECT name, version FROM tag ORDER BY name";
    let mut statement = connection.prepare_cached(SQL)?;
    let tags = statement.query_map([], |row| Ok((row.get(0)?, version(row.get(1)?))))?;
    Ok(tags.collect::<Result<_, _>>()?)
}

fn version(number: i64) -> VersionId {
    VersionId(number.unsigned_abs())
}

fn tagged(connection: &Connection, name: &str) -> Result<Option<VersionId>, Fault> {
    const SQL: &str = "SELECT version FROM tag WHERE name = :name ORDER BY name";
    let mut statement = connection.prepare_cached(SQL)?;
    Ok(statement.query_row(named_params! {":name": name}, |row| row.get(0).map(version)).optional()?)
}

/// The last version at or before `time`.
pub(super) fn version_at(connection: &Connection, time: Timestamp) -> Result<VersionId, Fault> {
    const SQL: &str = "SELECT version FROM version WHERE committed_at <= :time
        ORDER BY committed_at DESC, version DESC LIMIT 1";
    const FIRST: &str = "SELECT committed_at FROM version ORDER BY version LIMIT 1";
    let parameters = named_params! {":time": time.as_microsecond()};
    let found = connection.prepare_cached(SQL)?.query_row(parameters, |row| row.get(0).map(version)).optional()?;
    match found {
        Some(version) => Ok(version),
        None => {
            let first = timestamp(connection.prepare_cached(FIRST)?.query_row([], |row| row.get(0))?)?;
            Err(StoreError::BeforeFirst { asked: time, first }.into())
        }
    }
}
