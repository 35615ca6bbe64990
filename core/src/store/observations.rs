//! Evidence: what was seen behind a version, and behind attempts that made none.

use super::error::{Fault, StoreError};
use super::map_file::{MapFile, WriteFault};
use super::rows::{digest, timestamp};
use super::seal;
use super::states::check_version;
use crate::version::{Digest, Observation, PluginBuild, VersionId};
use jiff::Timestamp;
use rusqlite::{Connection, OptionalExtension, Row, ToSql, named_params};

/// An observation as the map keeps it.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedObservation {
    /// Its number.
    pub id: u64,
    /// The version it made, if any.
    pub version: Option<VersionId>,
    /// The version it was compared with.
    pub base: VersionId,
    /// When it came into the map.
    pub recorded_at: Timestamp,
    /// Digest of its text, by which other observations name it.
    pub digest: Digest,
    /// Digest of its label image, for [`MapFile::label_image`].
    pub labels: Option<Digest>,
    /// What was seen, without the label image.
    pub observation: Observation,
}

const COLUMNS: &str = "id, version, base_version, recorded_at, labels, body, digest";

impl MapFile {
    /// Keeps an attempt against `base` that made no version, and returns its number.
    pub fn record_observation(
        &self,
        base: VersionId,
        observation: &Observation,
        now: Timestamp,
    ) -> Result<u64, StoreError> {
        let evidence = Evidence::of(observation)?;
        self.write(|connection| -> Result<u64, WriteFault<StoreError>> {
            check_version(connection, base)?;
            Ok(evidence.insert(connection, base, None, now)?)
        })
    }

    /// Every observation, newest first.
    pub fn observations(&self) -> Result<Vec<RecordedObservation>, StoreError> {
        let sql = format!("SELECT {COLUMNS} FROM observation ORDER BY id DESC");
        self.read(|connection| select(connection, &sql, &[]))
    }

    /// The observation numbered `id`.
    pub fn observation(&self, id: u64) -> Result<Option<RecordedObservation>, StoreError> {
        let sql = format!("SELECT {COLUMNS} FROM observation WHERE id = :id ORDER BY id");
        let id = i64::try_from(id).unwrap_or(i64::MAX);
        self.read(|connection| Ok(select(connection, &sql, &[(":id", &id)])?.pop()))
    }

    /// The first observation whose text has this digest.
    pub fn observation_named(&self, digest: Digest) -> Result<Option<RecordedObservation>, StoreError> {
        let sql = format!("SELECT {COLUMNS} FROM observation WHERE digest = :digest ORDER BY id LIMIT 1");
        self.read(|connection| Ok(select(connection, &sql, &[(":digest", &digest.0)])?.pop()))
    }

    /// The observation behind `version`, if it has one.
    pub fn observation_of(&self, version: VersionId) -> Result<Option<RecordedObservation>, StoreError> {
        self.read(|connection| of_version(connection, version))
    }

    /// The versions, newest first, in whose observation `build` took part, or in one that confirmed it.
    pub fn versions_by(&self, build: &PluginBuild) -> Result<Vec<VersionId>, StoreError> {
        let sql = format!("SELECT {COLUMNS} FROM observation WHERE version IS NOT NULL ORDER BY version DESC");
        let mut versions = Vec::new();
        for recorded in self.read(|connection| select(connection, &sql, &[]))? {
            let mut took_part = build.took_part(&recorded.observation);
            for digest in &recorded.observation.confirmations {
                let other = self.observation_named(*digest)?;
                took_part |= other.is_some_and(|other| build.took_part(&other.observation));
            }
            versions.extend(recorded.version.filter(|_| took_part));
        }
        Ok(versions)
    }

    /// The label image that `digest` names, as PNG; `None` when it was not kept.
    pub fn label_image(&self, digest: Digest) -> Result<Option<Vec<u8>>, StoreError> {
        const SQL: &str = "SELECT bytes FROM label_image WHERE digest = :digest ORDER BY digest";
        self.read(|connection| {
            let mut statement = connection.prepare_cached(SQL)?;
            Ok(statement.query_row(named_params! {":digest": digest.0}, |row| row.get(0)).optional()?)
        })
    }
}

/// The observation behind `version`.
pub(super) fn of_version(connection: &Connection, version: VersionId) -> Result<Option<RecordedObservation>, Fault> {
    let sql = format!("SELECT {COLUMNS} FROM observation WHERE version = :version ORDER BY id");
    Ok(select(connection, &sql, &[(":version", &(version.0 as i64))])?.pop())
}

fn select(
    connection: &Connection,
    sql: &str,
    parameters: &[(&str, &dyn ToSql)],
) -> Result<Vec<RecordedObservation>, Fault> {
    let mut statement = connection.prepare_cached(sql)?;
    let mut rows = statement.query(parameters)?;
    let mut observations = Vec::new();
    while let Some(row) = rows.next()? {
        observations.push(read(row)?);
    }
    Ok(observations)
}

fn read(row: &Row) -> Result<RecordedObservation, Fault> {
    let id = row.get::<_, i64>("id")?.unsigned_abs();
    let body: String = row.get("body")?;
    let observation = Observation::from_json(&body);
    Ok(RecordedObservation {
        id,
        version: row.get::<_, Option<i64>>("version")?.map(|version| VersionId(version.unsigned_abs())),
        base: VersionId(row.get::<_, i64>("base_version")?.unsigned_abs()),
        recorded_at: timestamp(row.get("recorded_at")?)?,
        digest: digest(row, "digest")?,
        labels: row.get::<_, Option<[u8; 32]>>("labels")?.map(Digest),
        observation: observation.map_err(|detail| Fault::Damage(format!("observation {id}: {detail}")))?,
    })
}

/// The digest under which `observation` is kept.
pub(super) fn evidence_digest(observation: &Observation) -> Result<Digest, StoreError> {
    Evidence::of(observation).map(|evidence| evidence.digest)
}

/// An observation in the form that is kept and digested.
pub(super) struct Evidence<'o> {
    observation: &'o Observation,
    body: String,
    /// Digest of the body.
    pub(super) digest: Digest,
}

impl<'o> Evidence<'o> {
    pub(super) fn of(observation: &'o Observation) -> Result<Self, StoreError> {
        let body = observation.to_json().map_err(|error| StoreError::Observation { detail: error.to_string() })?;
        let digest = Digest::of(body.as_bytes());
        Ok(Self { observation, body, digest })
    }

    /// Writes it down and returns its number.
    pub(super) fn insert(
        &self,
        connection: &Connection,
        base: VersionId,
        version: Option<VersionId>,
        now: Timestamp,
    ) -> Result<u64, Fault> {
        const SQL: &str = "INSERT INTO observation
                (version, base_version, recorded_at, capture, decision, labels, body, digest)
            VALUES (:version, :base, :recorded_at, :capture, :decision, :labels, :body, :digest)";
        let labels =
            self.observation.labels.as_deref().map(|image| insert_label_image(connection, image)).transpose()?;
        connection.prepare_cached(SQL)?.execute(named_params! {
            ":version": version.map(|version| version.0 as i64), ":base": base.0 as i64,
            ":recorded_at": now.as_microsecond(), ":capture": self.observation.capture.0,
            ":decision": self.observation.decision.name(), ":labels": labels.map(|digest| digest.0),
            ":body": self.body, ":digest": self.digest.0,
        })?;
        let id = connection.last_insert_rowid();
        seal::OBSERVATION.seal(connection, &id)?;
        Ok(id.unsigned_abs())
    }
}

fn insert_label_image(connection: &Connection, image: &[u8]) -> Result<Digest, Fault> {
    const SQL: &str =
        "INSERT INTO label_image (digest, bytes) VALUES (:digest, :bytes) ON CONFLICT (digest) DO NOTHING";
    let digest = Digest::of(image);
    connection.prepare_cached(SQL)?.execute(named_params! {":digest": digest.0, ":bytes": image})?;
    Ok(digest)
}

/// Digest of the observation numbered `id`.
pub(super) fn digest_of(connection: &Connection, id: u64) -> Result<Digest, Fault> {
    const SQL: &str = "SELECT digest FROM observation WHERE id = :id ORDER BY id";
    Ok(connection.prepare_cached(SQL)?.query_row(named_params! {":id": id as i64}, |row| digest(row, "digest"))?)
}

/// Says that the observation numbered `id` made `version`. One that made a version already, because several proposals
/// stand on it, is written down once more.
pub(super) fn link(connection: &Connection, id: u64, version: VersionId) -> Result<(), Fault> {
    const LINK: &str = "UPDATE observation SET version = :version WHERE id = :id AND version IS NULL";
    const COPY: &str = "INSERT INTO observation
            (version, base_version, recorded_at, capture, decision, labels, body, digest)
        SELECT :version, base_version, recorded_at, capture, decision, labels, body, digest FROM observation
        WHERE id = :id ORDER BY id";
    let linked =
        connection.prepare_cached(LINK)?.execute(named_params! {":version": version.0 as i64, ":id": id as i64})?;
    if linked > 0 {
        return seal::OBSERVATION.seal(connection, &(id as i64));
    }
    connection.prepare_cached(COPY)?.execute(named_params! {":version": version.0 as i64, ":id": id as i64})?;
    seal::OBSERVATION.seal(connection, &connection.last_insert_rowid())
}
