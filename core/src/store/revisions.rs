//! Names of versions: numbers, tags, `head`, dates.

use super::error::{Fault, StoreError};
use super::forgotten::check_state;
use super::map_file::{MapFile, WriteFault};
use super::rows::{head, timestamp};
use super::snapshot::check_version;
use crate::version::{Revision, VersionId, is_tag_name};
use jiff::Timestamp;
use rusqlite::{Connection, OptionalExtension, named_params};

impl MapFile {
    /// The version that `revision` names: `12`, `v12`, `head`, a tag, `@2026-03-01` (the end of that day, UTC) or
    /// `@2026-03-01T10:00:00+08:00`.
    pub fn resolve(&self, revision: &str) -> Result<VersionId, StoreError> {
        self.resolve_revision(&Revision::parse(revision)?)
    }

    /// The two versions that `REV..REV` names.
    pub fn resolve_range(&self, range: &str) -> Result<(VersionId, VersionId), StoreError> {
        let (from, to) = Revision::parse_range(range)?;
        Ok((self.resolve_revision(&from)?, self.resolve_revision(&to)?))
    }

    /// Names `version`.
    pub fn tag(&self, name: &str, version: VersionId, now: Timestamp) -> Result<(), StoreError> {
        const SQL: &str = "INSERT INTO tag (name, version, tagged_at) VALUES (:name, :version, :now)";
        if !is_tag_name(name) {
            return Err(StoreError::TagName { name: name.to_owned() });
        }
        self.write(|connection| -> Result<(), WriteFault<StoreError>> {
            check_state(connection, version)?;
            if let Some(taken) = tagged(connection, name)? {
                return Err(StoreError::TagTaken { name: name.to_owned(), version: taken }.into());
            }
            let now = now.as_microsecond();
            connection.execute(SQL, named_params! {":name": name, ":version": version.0 as i64, ":now": now})?;
            Ok(())
        })
    }

    /// Takes the name away from the version it names, and returns that.
    pub fn untag(&self, name: &str) -> Result<VersionId, StoreError> {
        const SQL: &str = "DELETE FROM tag WHERE name = :name";
        self.write(|connection| -> Result<VersionId, WriteFault<StoreError>> {
            let version = tagged(connection, name)?;
            connection.execute(SQL, named_params! {":name": name})?;
            version.ok_or_else(|| StoreError::NoSuchTag { name: name.to_owned() }.into())
        })
    }

    /// Every tag and what it names, by name.
    pub fn tags(&self) -> Result<Vec<(String, VersionId)>, StoreError> {
        const SQL: &str = "SELECT name, version FROM tag ORDER BY name";
        self.read(|connection| {
            let mut statement = connection.prepare_cached(SQL)?;
            let tags = statement.query_map([], |row| Ok((row.get(0)?, version(row.get(1)?))))?;
            Ok(tags.collect::<Result<_, _>>()?)
        })
    }

    fn resolve_revision(&self, revision: &Revision) -> Result<VersionId, StoreError> {
        self.read(|connection| match revision {
            Revision::Number(version) => check_version(connection, *version).map(|()| *version),
            Revision::Head => head(connection).map(|record| record.version),
            Revision::At(time) => at(connection, *time),
            Revision::Tag(name) => {
                tagged(connection, name)?.ok_or_else(|| StoreError::NoSuchTag { name: name.clone() }.into())
            }
        })
    }
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
fn at(connection: &Connection, time: Timestamp) -> Result<VersionId, Fault> {
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
