//! Geometry and label images: bytes that are kept once, under their digest, and who names them.

use super::error::Fault;
use crate::version::Digest;
use rusqlite::{Connection, named_params};

/// A table of bytes under their digest. A digest that nobody names and bytes under another digest than theirs may be two
/// halves of one damage, so each is named, and neither is a reason to remove anything.
pub(super) struct Blobs {
    /// The check that finds what is wrong with them.
    pub(super) check: &'static str,
    /// What one of them is called.
    pub(super) name: &'static str,
    /// What is said of one that nobody names.
    pub(super) unused: &'static str,
    all: &'static str,
    orphans: &'static str,
    is_missed: &'static str,
    copy: &'static str,
    delete: &'static str,
}

pub(super) const GEOMETRY: Blobs = Blobs {
    check: "geometry",
    name: "geometry",
    unused: "no object uses it",
    all: "SELECT rowid, digest, bytes FROM geometry ORDER BY rowid",
    orphans: "SELECT rowid, digest FROM geometry AS g WHERE NOT EXISTS (SELECT 1 FROM feature_version AS f
        WHERE f.geometry = g.digest AND f.geometry IS NOT NULL) ORDER BY rowid",
    is_missed: "SELECT EXISTS (SELECT 1 FROM feature_version WHERE geometry = :digest AND geometry IS NOT NULL)
        AND NOT EXISTS (SELECT 1 FROM geometry WHERE digest = :digest) ORDER BY 1",
    copy: "INSERT INTO geometry (digest, bytes) SELECT :digest, bytes FROM geometry WHERE rowid = :rowid ORDER BY rowid",
    delete: "DELETE FROM geometry WHERE rowid = :rowid",
};

pub(super) const LABEL_IMAGES: Blobs = Blobs {
    check: "observations",
    name: "label image",
    unused: "no observation names it",
    all: "SELECT rowid, digest, bytes FROM label_image ORDER BY rowid",
    orphans: "SELECT rowid, digest FROM label_image AS l WHERE NOT EXISTS (SELECT 1 FROM observation AS o
        WHERE o.labels = l.digest) ORDER BY rowid",
    is_missed: "SELECT EXISTS (SELECT 1 FROM observation WHERE labels = :digest)
        AND NOT EXISTS (SELECT 1 FROM label_image WHERE digest = :digest) ORDER BY 1",
    copy: "INSERT INTO label_image (digest, bytes)
        SELECT :digest, bytes FROM label_image WHERE rowid = :rowid ORDER BY rowid",
    delete: "DELETE FROM label_image WHERE rowid = :rowid",
};

/// Bytes that are under another digest than theirs.
pub(super) struct Misplaced {
    pub(super) rowid: i64,
    /// Where they are.
    pub(super) under: Digest,
    /// What their digest is.
    pub(super) own: Digest,
}

impl Blobs {
    /// What is under another digest than its own. Reads the whole table.
    pub(super) fn misplaced(&self, connection: &Connection) -> Result<Vec<Misplaced>, Fault> {
        let mut statement = connection.prepare(self.all)?;
        let mut rows = statement.query([])?;
        let mut misplaced = Vec::new();
        while let Some(row) = rows.next()? {
            let (rowid, under) = (row.get(0)?, Digest(row.get(1)?));
            let own = Digest::of(row.get_ref(2)?.as_blob().map_err(rusqlite::Error::from)?);
            if own != under {
                misplaced.push(Misplaced { rowid, under, own });
            }
        }
        Ok(misplaced)
    }

    /// Row and digest of what nobody names.
    pub(super) fn orphans(&self, connection: &Connection) -> Result<Vec<(i64, Digest)>, Fault> {
        let mut statement = connection.prepare(self.orphans)?;
        let orphans = statement.query_map([], |row| Ok((row.get(0)?, Digest(row.get(1)?))))?;
        Ok(orphans.collect::<Result<_, _>>()?)
    }

    /// Puts bytes under their own digest if somebody asks for that and nothing is there, and says whether it did.
    pub(super) fn restore(&self, connection: &Connection, found: &Misplaced) -> Result<bool, Fault> {
        let own = found.own.0;
        let is_missed = connection.query_row(self.is_missed, named_params! {":digest": own}, |row| row.get(0))?;
        if is_missed {
            connection.execute(self.copy, named_params! {":digest": own, ":rowid": found.rowid})?;
            self.delete(connection, found.rowid)?;
        }
        Ok(is_missed)
    }

    /// Removes a row.
    pub(super) fn delete(&self, connection: &Connection, rowid: i64) -> Result<(), Fault> {
        connection.prepare_cached(self.delete)?.execute(named_params! {":rowid": rowid})?;
        Ok(())
    }
}
