//! Seals: digests of rows that the hash chain does not cover, so that what changes in one by accident is found.
//! docs/file-format.md says of which bytes.

use super::error::Fault;
use crate::version::Digest;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OptionalExtension, Row, ToSql, named_params};

/// The first format with seals.
pub(super) const SEALED_FORMAT: usize = 4;

const PREFIX: &[u8] = b"resurvey.seal/1\n";

/// A table whose rows have a seal.
pub(super) struct Sealed {
    table: &'static str,
    key: &'static str,
    /// What the seal is the digest of, the key first.
    columns: &'static str,
    from: &'static str,
}

/// With what its writer looked at.
pub(super) const VERSION: Sealed = Sealed {
    table: "version",
    key: "version",
    columns: "version, kind, committed_at, observed_at, author, message, base_version, reverts, added, modified, removed,
        v.e0, v.e1, v.n0, v.n1, v.h0, v.h1, idempotency_key, evidence, hash, request, l.e0, l.e1, l.n0, l.n1, l.h0, l.h1",
    from: "version AS v LEFT JOIN looked_at AS l USING (version)",
};

pub(super) const OBSERVATION: Sealed = Sealed {
    table: "observation",
    key: "id",
    columns: "id, version, base_version, recorded_at, capture, decision, labels, body, digest",
    from: "observation",
};

pub(super) const PROPOSAL: Sealed = Sealed {
    table: "proposal",
    key: "id",
    columns: "id, base_version, kind, proposed_at, observed_at, author, message, idempotency_key,
        e0, e1, n0, n1, h0, h1, operations, observation, status, decided_at, decided_by, note, version",
    from: "proposal",
};

pub(super) const TAG: Sealed = Sealed { table: "tag", key: "name", columns: "name, version, tagged_at", from: "tag" };

pub(super) const FORGOTTEN: Sealed = Sealed {
    table: "forgotten",
    key: "version",
    columns: "version, has_state, operations, last_fid, forgotten_at, state",
    from: "forgotten",
};

/// Without the origin of the index, which is as derivable as the index.
pub(super) const META: Sealed = Sealed {
    table: "meta",
    key: "only_row",
    columns: "only_row, format, map_id, crs, vertical_datum, created_at",
    from: "meta",
};

/// Every table with seals.
pub(super) const ALL: [&Sealed; 6] = [&META, &VERSION, &FORGOTTEN, &OBSERVATION, &PROPOSAL, &TAG];

/// A row that is not what its seal says.
pub(super) struct Broken {
    pub(super) place: String,
    /// Digest of what it is.
    pub(super) found: Digest,
    /// `None` where it has none.
    pub(super) seal: Option<Digest>,
}

impl Sealed {
    /// Writes the seal of the row with this key, which has been written otherwise.
    pub(super) fn seal(&self, connection: &Connection, key: &dyn ToSql) -> Result<(), Fault> {
        let Self { key: name, columns, from, .. } = self;
        let sql = format!("SELECT seal, {columns} FROM {from} WHERE {name} = :key ORDER BY {name}");
        let mut statement = connection.prepare_cached(&sql)?;
        let seal = statement.query_row(named_params! {":key": key}, |row| self.digest(row)).optional()?;
        seal.map_or(Ok(()), |seal| self.write(connection, key, seal))
    }

    /// Seals every row.
    pub(super) fn seal_all(&self, connection: &Connection) -> Result<(), Fault> {
        let mut statement = connection.prepare(&format!("SELECT {0} FROM {1} ORDER BY {0}", self.key, self.table))?;
        let keys = statement.query_map([], |row| row.get::<_, rusqlite::types::Value>(0))?;
        for key in keys.collect::<Result<Vec<_>, _>>()? {
            self.seal(connection, &key)?;
        }
        Ok(())
    }

    /// The rows that are not what their seal says. Reads the whole table.
    pub(super) fn broken(&self, connection: &Connection) -> Result<Vec<Broken>, Fault> {
        let Self { table, key, columns, from } = self;
        let mut statement = connection.prepare(&format!("SELECT seal, {columns} FROM {from} ORDER BY {key}"))?;
        let mut rows = statement.query([])?;
        let mut broken = Vec::new();
        while let Some(row) = rows.next()? {
            let (seal, found) = (row.get::<_, Option<[u8; 32]>>(0)?.map(Digest), self.digest(row)?);
            if seal != Some(found) {
                let place = match row.get_ref(1)? {
                    ValueRef::Text(text) => format!("{table} {:?}", String::from_utf8_lossy(text)),
                    ValueRef::Integer(number) => format!("{table} {number}"),
                    _ => (*table).to_owned(),
                };
                broken.push(Broken { place, found, seal });
            }
        }
        Ok(broken)
    }

    fn write(&self, connection: &Connection, key: &dyn ToSql, seal: Digest) -> Result<(), Fault> {
        let sql = format!("UPDATE {} SET seal = :seal WHERE {} = :key", self.table, self.key);
        connection.prepare_cached(&sql)?.execute(named_params! {":seal": seal.0, ":key": key})?;
        Ok(())
    }

    /// The digest of a row of the seal and the columns.
    fn digest(&self, row: &Row) -> Result<Digest, rusqlite::Error> {
        let mut bytes = PREFIX.to_vec();
        push(&mut bytes, ValueRef::Text(self.table.as_bytes()));
        for column in 1..row.as_ref().column_count() {
            push(&mut bytes, row.get_ref(column)?);
        }
        Ok(Digest::of(&bytes))
    }
}

/// Appends what kind of value it is, and the value; those of variable length begin with it.
fn push(bytes: &mut Vec<u8>, value: ValueRef<'_>) {
    let (kind, length, value): (u8, Option<usize>, &[u8]) = match value {
        ValueRef::Null => (0, None, &[]),
        ValueRef::Integer(number) => (1, None, &number.to_le_bytes()),
        // No column holds one, but in a damaged file.
        ValueRef::Real(number) => (2, None, &number.to_le_bytes()),
        ValueRef::Text(text) => (3, Some(text.len()), text),
        ValueRef::Blob(blob) => (4, Some(blob.len()), blob),
    };
    bytes.push(kind);
    bytes.extend(length.iter().flat_map(|length| (*length as u64).to_le_bytes()));
    bytes.extend(value);
}
