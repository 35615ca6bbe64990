//! Rows of the tables as values of `version`.

use super::error::{Fault, StoreError};
use crate::version::{
    BoxMm, CanonicalError, Counts, Digest, Feature, FeatureState, Fid, VersionId, VersionKind, VersionRecord,
};
use jiff::Timestamp;
use resurvey_schema::{Class, ClassId, ClassKind, ClassTable};
use rusqlite::{Connection, Row, named_params};

/// The time `microseconds` after the epoch.
pub(super) fn timestamp(microseconds: i64) -> Result<Timestamp, Fault> {
    Timestamp::from_microsecond(microseconds).map_err(|error| Fault::Damage(error.to_string()))
}

/// Columns of `feature_version`, named `f`, that [`feature`] reads.
pub(super) const FEATURE_COLUMNS: &str = "f.fid, f.from_version, f.to_version, f.state";

/// Reads [`FEATURE_COLUMNS`] from the first columns of `row`.
pub(super) fn feature(row: &Row) -> Result<Feature, Fault> {
    let (fid, from) = (Fid(number(row, 0)?), VersionId(number(row, 1)?));
    let to: Option<i64> = row.get(2)?;
    let state = FeatureState::from_bytes(row.get_ref(3)?.as_blob().map_err(rusqlite::Error::from)?);
    let state = state.map_err(|error: CanonicalError| {
        Fault::Damage(format!("state of feature {fid} from version {from}: {error}"))
    })?;
    Ok(Feature { fid, from, to: to.map(|to| VersionId(to.unsigned_abs())), state })
}

fn number(row: &Row, column: usize) -> Result<u64, Fault> {
    Ok(row.get::<_, i64>(column)?.unsigned_abs())
}

/// The digest in `column`.
pub(super) fn digest(row: &Row, column: &str) -> Result<Digest, rusqlite::Error> {
    row.get(column).map(Digest)
}

/// Reading and writing rows of `version`.
pub(super) struct VersionRow;

impl VersionRow {
    /// Every column.
    pub(super) const COLUMNS: &str = "version, kind, committed_at, observed_at, author, message, base_version, reverts,
        added, modified, removed, e0, e1, n0, n1, h0, h1, idempotency_key, evidence, hash";

    pub(super) fn read(row: &Row) -> Result<VersionRecord, Fault> {
        let kind: String = row.get("kind")?;
        let kind = VersionKind::ALL.into_iter().find(|known| known.name() == kind);
        let version = |name| -> Result<Option<VersionId>, Fault> {
            Ok(row.get::<_, Option<i64>>(name)?.map(|number| VersionId(number.unsigned_abs())))
        };
        let count = |name| -> Result<u64, Fault> { Ok(row.get::<_, i64>(name)?.unsigned_abs()) };
        Ok(VersionRecord {
            version: VersionId(count("version")?),
            kind: kind.ok_or_else(|| Fault::Damage("a version of unknown kind".to_owned()))?,
            committed_at: timestamp(row.get("committed_at")?)?,
            observed_at: row.get::<_, Option<i64>>("observed_at")?.map(timestamp).transpose()?,
            author: row.get("author")?,
            message: row.get("message")?,
            base: version("base_version")?,
            reverts: version("reverts")?,
            counts: Some(Counts { added: count("added")?, modified: count("modified")?, removed: count("removed")? }),
            envelope: read_box(row)?,
            idempotency_key: row.get("idempotency_key")?,
            evidence: row.get::<_, Option<[u8; 32]>>("evidence")?.map(Digest),
            hash: digest(row, "hash")?,
        })
    }

    /// Writes it, with what was asked for.
    pub(super) fn insert(
        connection: &Connection,
        record: &VersionRecord,
        request: Option<Digest>,
    ) -> Result<(), Fault> {
        const SQL: &str = "INSERT INTO version (version, kind, committed_at, observed_at, author, message,
                base_version, reverts, added, modified, removed, e0, e1, n0, n1, h0, h1, idempotency_key, evidence, hash,
                request)
            VALUES (:version, :kind, :committed_at, :observed_at, :author, :message,
                :base_version, :reverts, :added, :modified, :removed, :e0, :e1, :n0, :n1, :h0, :h1, :key, :evidence, :hash,
                :request)";
        let [e0, e1, n0, n1, h0, h1] = box_columns(record.envelope.as_ref());
        let counts = record.counts.unwrap_or_default();
        connection.prepare_cached(SQL)?.execute(named_params! {
            ":version": record.version.0 as i64, ":kind": record.kind.name(),
            ":committed_at": record.committed_at.as_microsecond(),
            ":observed_at": record.observed_at.map(Timestamp::as_microsecond),
            ":author": record.author, ":message": record.message,
            ":base_version": record.base.map(|version| version.0 as i64),
            ":reverts": record.reverts.map(|version| version.0 as i64),
            ":added": counts.added as i64, ":modified": counts.modified as i64,
            ":removed": counts.removed as i64,
            ":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":h0": h0, ":h1": h1,
            ":key": record.idempotency_key, ":evidence": record.evidence.map(|digest| digest.0), ":hash": record.hash.0,
            ":request": request.map(|digest| digest.0),
        })?;
        Ok(())
    }
}

/// The columns e0, e1, n0, n1, h0, h1 of `bounds`.
pub(super) fn box_columns(bounds: Option<&BoxMm>) -> [Option<i64>; 6] {
    let Some(bounds) = bounds else { return [None; 6] };
    let ([e0, n0, h0], [e1, n1, h1]) = (bounds.min(), bounds.max());
    [e0, e1, n0, n1, h0, h1].map(Some)
}

/// The box in the columns e0, e1, n0, n1, h0, h1.
pub(super) fn read_box(row: &Row) -> Result<Option<BoxMm>, Fault> {
    let mut ends = [0; 6];
    for (end, name) in ends.iter_mut().zip(["e0", "n0", "h0", "e1", "n1", "h1"]) {
        let Some(value) = row.get::<_, Option<i64>>(name)? else { return Ok(None) };
        *end = value;
    }
    let [e0, n0, h0, e1, n1, h1] = ends;
    let bounds = BoxMm::from_mm([e0, n0, h0], [e1, n1, h1]);
    bounds.map(Some).ok_or_else(|| Fault::Damage("a box whose ends are reversed".to_owned()))
}

/// The newest version.
pub(super) fn head(connection: &Connection) -> Result<VersionRecord, Fault> {
    let sql = format!("SELECT {} FROM version ORDER BY version DESC LIMIT 1", VersionRow::COLUMNS);
    let mut statement = connection.prepare_cached(&sql)?;
    let mut rows = statement.query([])?;
    match rows.next()? {
        Some(row) => VersionRow::read(row),
        None => Err(Fault::Damage("it has no version".to_owned())),
    }
}

/// The class table in force at `version`.
pub(super) fn classes_at(connection: &Connection, version: VersionId) -> Result<ClassTable, Fault> {
    const SQL: &str = "SELECT class, name, red, green, blue, kind, along_m, across_m, up_m FROM class
        WHERE from_version = (SELECT max(from_version) FROM class WHERE from_version <= :version) ORDER BY class";
    let mut statement = connection.prepare_cached(SQL)?;
    let mut rows = statement.query(named_params! {":version": version.0 as i64})?;
    let mut classes = Vec::new();
    while let Some(row) = rows.next()? {
        classes.push(read_class(row)?);
    }
    if classes.is_empty() {
        return Err(Fault::Damage(format!("no class table at version {version}")));
    }
    ClassTable::new(classes).map_err(|error| Fault::Damage(format!("class table at version {version}: {error}")))
}

fn read_class(row: &Row) -> Result<Class, Fault> {
    let kind: String = row.get("kind")?;
    let kind = match kind.as_str() {
        "material" => ClassKind::Material,
        "dynamic" => ClassKind::Dynamic,
        _ => ClassKind::Ignored,
    };
    let size: [Option<f64>; 3] = [row.get("along_m")?, row.get("across_m")?, row.get("up_m")?];
    let size_m = match size {
        [Some(along), Some(across), Some(up)] => Some([along, across, up]),
        _ => None,
    };
    Ok(Class {
        index: ClassId(row.get("class")?),
        name: row.get("name")?,
        colour: [row.get("red")?, row.get("green")?, row.get("blue")?],
        kind,
        size_m,
    })
}

/// Refuses a class table that could not be read back.
pub(super) fn check_classes(classes: &ClassTable) -> Result<(), StoreError> {
    let wrong = |detail: String| Err(StoreError::ClassTable { detail });
    if classes.iter().next().is_none() {
        return wrong("expected at least one class, found none".to_owned());
    }
    for class in classes.iter() {
        for size in class.size_m.into_iter().flatten() {
            if !size.is_finite() || size <= 0.0 {
                return wrong(format!("class {:?} has size {size} m; expected more than zero", class.name));
            }
        }
    }
    Ok(())
}

/// Writes `classes` as the table from `version` on.
pub(super) fn insert_classes(connection: &Connection, version: VersionId, classes: &ClassTable) -> Result<(), Fault> {
    const SQL: &str = "INSERT INTO class (from_version, class, name, red, green, blue, kind, along_m, across_m, up_m)
        VALUES (:version, :class, :name, :red, :green, :blue, :kind, :along, :across, :up)";
    let mut statement = connection.prepare_cached(SQL)?;
    for class in classes.iter() {
        let kind = match class.kind {
            ClassKind::Material => "material",
            ClassKind::Dynamic => "dynamic",
            ClassKind::Ignored => "ignored",
        };
        let [red, green, blue] = class.colour;
        let [along, across, up] = class.size_m.map_or([None; 3], |size| size.map(Some));
        statement.execute(named_params! {
            ":version": version.0 as i64, ":class": class.index.0, ":name": class.name, ":red": red, ":green": green,
            ":blue": blue, ":kind": kind, ":along": along, ":across": across, ":up": up,
        })?;
    }
    Ok(())
}
