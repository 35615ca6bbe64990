//! Mending what can be worked out from the rest: the index, and what nobody uses. History is never touched.

use super::error::{Fault, StoreError};
use super::gc::unreachable;
use super::index::{Flaw, IndexOrigin, flaws, rebuild};
use super::map_file::{MapFile, WriteFault};
use super::{Problem, fsck};
use crate::version::{BoxMm, FeatureState};
use rusqlite::{Connection, named_params};

impl MapFile {
    /// Mends the index and removes what nobody uses, all of it or nothing, and returns what it did. Everything else that
    /// [`MapFile::fsck`] finds is left as it is.
    pub fn repair(&self) -> Result<Vec<Problem>, StoreError> {
        self.write(|connection| -> Result<Vec<Problem>, WriteFault<StoreError>> {
            let mut done = Vec::new();
            mend_sqlite_indexes(connection, &mut done)?;
            remove_unreachable(connection, &mut done)?;
            mend_index(connection, &mut done)?;
            remove_unused(connection, &mut done)?;
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
    if complaints.iter().any(|complaint| complaint.contains("index")) {
        connection.execute_batch("REINDEX")?;
        did(done, "sqlite", "file", "made the indexes of all tables anew");
    }
    Ok(())
}

fn remove_unreachable(connection: &Connection, done: &mut Vec<Problem>) -> Result<(), Fault> {
    for state in unreachable(connection)? {
        connection.execute("DELETE FROM feature_version WHERE id = :id", named_params! {":id": state.id})?;
        let place = format!("feature {} from version {}", state.fid, state.from);
        did(done, "forgotten", place, "removed: no version that is kept has it");
    }
    Ok(())
}

/// Makes the index anew when a state is not in it as it should be, or something else is. What it says of states that
/// cannot be read is kept.
fn mend_index(connection: &Connection, done: &mut Vec<Problem>) -> Result<(), Fault> {
    mend_origin(connection, done)?;
    let (flaws, boxless) = flaws(connection)?;
    if flaws.is_empty() {
        return Ok(());
    }
    for flaw in flaws {
        match flaw {
            Flaw::Wrong { place, .. } => did(done, "index", place, "put into the index as its state says"),
            Flaw::Stray { place, detail } => did(done, "index", place, format!("removed: {detail}")),
        }
    }
    rebuild(connection, boxless)
}

/// Chooses the origin of the index anew where it is lost.
fn mend_origin(connection: &Connection, done: &mut Vec<Problem>) -> Result<(), Fault> {
    if IndexOrigin::read(connection)?.is_some() {
        return Ok(());
    }
    let mut statement = connection.prepare("SELECT state FROM feature_version ORDER BY id")?;
    let mut rows = statement.query([])?;
    let mut envelope: Option<BoxMm> = None;
    while let Some(row) = rows.next()? {
        let state = FeatureState::from_bytes(row.get_ref(0)?.as_blob().map_err(rusqlite::Error::from)?);
        // A state that cannot be read has no box; fsck names it.
        let Some(bounds) = state.ok().and_then(|state| state.bounds().ok()) else { continue };
        envelope = Some(envelope.map_or(bounds, |envelope| envelope.union(&bounds)));
    }
    if let Some(envelope) = envelope {
        IndexOrigin::choose(&envelope).write(connection)?;
        did(done, "meta", "meta", "chose the origin of the index anew");
    }
    Ok(())
}

fn remove_unused(connection: &Connection, done: &mut Vec<Problem>) -> Result<(), Fault> {
    const GEOMETRY: &str = "DELETE FROM geometry WHERE NOT EXISTS
        (SELECT 1 FROM feature_version AS f WHERE f.geometry = geometry.digest AND f.geometry IS NOT NULL)";
    const IMAGES: &str = "DELETE FROM label_image WHERE NOT EXISTS
        (SELECT 1 FROM observation AS o WHERE o.labels = label_image.digest)";
    for (check, name, sql) in [("geometry", "meshes", GEOMETRY), ("observations", "label images", IMAGES)] {
        let removed = connection.execute(sql, [])?;
        if removed > 0 {
            did(done, check, name, format!("removed {removed} that nothing uses"));
        }
    }
    Ok(())
}
