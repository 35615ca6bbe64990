//! Mending what can be worked out from the rest: the index, the keys of geometry and label images, and what nobody uses.
//! History is never touched, and nothing goes while it may be the last copy of what something else asks for.

use super::blobs::{Blobs, GEOMETRY, LABEL_IMAGES};
use super::error::{Fault, StoreError};
use super::index::{Flaw, IndexOrigin, Source, flaws, rebuild};
use super::map_file::{MapFile, WriteFault};
use super::{Problem, fsck};
use rusqlite::{Connection, ErrorCode};
use std::path::Path;

impl MapFile {
    /// Mends the index, puts geometry and label images back under their own digests, and removes those that nobody uses
    /// where nothing else is wrong with the map: all of it or nothing. Returns what it did. Everything else that
    /// [`MapFile::fsck`] finds is left as it is.
    pub fn repair(&self) -> Result<Vec<Problem>, StoreError> {
        if self.fsck()?.is_empty() {
            return Ok(Vec::new());
        }
        self.write(|connection| -> Result<Vec<Problem>, WriteFault<StoreError>> {
            let mut done = Vec::new();
            mend_sqlite_indexes(connection, &mut done)?;
            for blobs in [&GEOMETRY, &LABEL_IMAGES] {
                restore_keys(connection, blobs, &mut done)?;
            }
            mend_index(connection, &mut done)?;
            remove_unused(connection, &self.path, &mut done)?;
            Ok(done)
        })
    }
}

fn did(done: &mut Vec<Problem>, check: &'static str, place: impl Into<String>, detail: impl Into<String>) {
    done.push(Problem { check, place: place.into(), detail: detail.into() });
}

/// SQLite's own indexes are made anew when its check finds one that disagrees with its table.
fn mend_sqlite_indexes(connection: &Connection, done: &mut Vec<Problem>) -> Result<(), Fault> {
    let complaints = fsck::complaints_of_sqlite(connection)?;
    if !complaints.iter().any(|complaint| complaint.contains("index")) {
        return Ok(());
    }
    match connection.execute_batch("REINDEX") {
        Ok(()) => did(done, "sqlite", "file", "made the indexes of all tables anew"),
        Err(error) if error.sqlite_error_code() == Some(ErrorCode::ConstraintViolation) => {
            let detail = format!("its indexes cannot be made anew, because two rows have one key ({error})");
            return Err(Fault::Damage(detail));
        }
        Err(error) => return Err(error.into()),
    }
    Ok(())
}

fn restore_keys(connection: &Connection, blobs: &Blobs, done: &mut Vec<Problem>) -> Result<(), Fault> {
    for found in blobs.misplaced(connection)? {
        if blobs.restore(connection, &found)? {
            let place = format!("{} {}", blobs.name, found.under);
            did(done, blobs.check, place, format!("put under the digest of its bytes, {}", found.own));
        }
    }
    Ok(())
}

/// Makes the index anew when a state is not in it as it should be, or something else is. What it says of states that
/// cannot be read, and of those that are not what the hash of their version says, is kept.
fn mend_index(connection: &Connection, done: &mut Vec<Problem>) -> Result<(), Fault> {
    let mut source = Source { doubtful: fsck::doubtful(connection)?, ..Source::read(connection)? };
    let mut found = flaws(connection, &source)?;
    if found.0.is_empty() {
        return Ok(());
    }
    let first = IndexOrigin::first(connection).ok().flatten();
    if let Some(first) = first.filter(|first| Some(*first) != source.origin) {
        let from_first = Source { origin: Some(first), doubtful: source.doubtful.clone() };
        let found_from_first = flaws(connection, &from_first)?;
        if found_from_first.0.len() <= found.0.len() {
            first.write(connection)?;
            did(done, "meta", "meta", "chose the origin of the index anew");
            (source, found) = (from_first, found_from_first);
        }
    }
    let (flaws, kept) = found;
    if flaws.is_empty() {
        return Ok(());
    }
    for flaw in flaws {
        match flaw {
            Flaw::Wrong { place, .. } => did(done, "index", place, "put into the index as its state says"),
            Flaw::Stray { place, detail } => did(done, "index", place, format!("removed: {detail}")),
        }
    }
    rebuild(connection, &source, kept)
}

/// Where anything is wrong, what seems to be used by nobody may be what the damaged part asks for.
fn remove_unused(connection: &Connection, path: &Path, done: &mut Vec<Problem>) -> Result<(), Fault> {
    if !fsck::damage(connection, path)?.is_empty() {
        return Ok(());
    }
    for (blobs, plural) in [(&GEOMETRY, "meshes"), (&LABEL_IMAGES, "label images")] {
        let orphans = blobs.orphans(connection)?;
        for (rowid, _) in &orphans {
            blobs.delete(connection, *rowid)?;
        }
        if !orphans.is_empty() {
            did(done, blobs.check, plural, format!("removed {} that nothing uses", orphans.len()));
        }
    }
    Ok(())
}
