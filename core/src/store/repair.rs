//! Mending what can be worked out from the rest: the index, and what nobody uses. History is never touched.

use super::error::{Fault, StoreError};
use super::gc::unreachable;
use super::index::{IndexBox, IndexOrigin, LIVE, hilbert_key};
use super::map_file::{MapFile, WriteFault};
use super::{Problem, fsck};
use crate::version::{BoxMm, FeatureState};
use rusqlite::{Connection, Row, named_params};
use std::collections::{BTreeMap, BTreeSet};

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
        connection.execute("DELETE FROM feature_index WHERE id = :id", named_params! {":id": state.id})?;
        connection.execute("DELETE FROM feature_version WHERE id = :id", named_params! {":id": state.id})?;
        let place = format!("feature {} from version {}", state.fid, state.from);
        did(done, "forgotten", place, "removed: no version that is kept has it");
    }
    Ok(())
}

/// A row as the index should have it, from its state.
struct Wanted {
    place: String,
    ends: IndexBox,
    versions: [i64; 2],
}

/// Puts every row of features that can be read into the index as it should be there, and takes out all else.
fn mend_index(connection: &Connection, done: &mut Vec<Problem>) -> Result<(), Fault> {
    const DELETE: &str = "DELETE FROM feature_index WHERE id = :id";
    const INSERT: &str = "INSERT INTO feature_index (id, e0, e1, n0, n1, h0, h1, v0, v1)
        VALUES (:id, :e0, :e1, :n0, :n1, :h0, :h1, :v0, :v1)";
    let mut wanted = wanted_rows(connection, done)?;
    let unreadable = unreadable_rows(connection)?;
    for (id, found) in index_rows(connection)? {
        if unreadable.contains(&id) {
            continue;
        }
        let expected = wanted.get(&id).map(|row| {
            let ([e0, e1, n0, n1, h0, h1], [v0, v1]) = (row.ends, row.versions);
            [e0, e1, n0, n1, h0, h1, v0, v1]
        });
        if expected == Some(found) {
            wanted.remove(&id);
            continue;
        }
        connection.prepare_cached(DELETE)?.execute(named_params! {":id": id})?;
        if expected.is_none() {
            did(done, "index", format!("index row {id}"), "removed: it belongs to no feature");
        }
    }
    let mut missing: Vec<(i64, Wanted)> = wanted.into_iter().collect();
    missing.sort_by_key(|(id, row)| (hilbert_key(&row.ends), *id));
    for (id, Wanted { place, ends: [e0, e1, n0, n1, h0, h1], versions: [v0, v1] }) in missing {
        connection.prepare_cached(INSERT)?.execute(named_params! {
            ":id": id, ":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":h0": h0, ":h1": h1, ":v0": v0, ":v1": v1,
        })?;
        did(done, "index", place, "put into the index as its state says");
    }
    Ok(())
}

fn wanted_rows(connection: &Connection, done: &mut Vec<Problem>) -> Result<BTreeMap<i64, Wanted>, Fault> {
    const SQL: &str = "SELECT id, fid, from_version, to_version, state FROM feature_version ORDER BY id";
    let mut statement = connection.prepare(SQL)?;
    let mut rows = statement.query([])?;
    let mut boxes: Vec<(i64, String, BoxMm, [i64; 2])> = Vec::new();
    while let Some(row) = rows.next()? {
        let (fid, from, to): (i64, i64, Option<i64>) = (row.get(1)?, row.get(2)?, row.get(3)?);
        // A state that cannot be read has no box; fsck names it.
        let Some(bounds) = read_box(row, 4)? else { continue };
        let place = format!("feature {fid} from version {from}");
        boxes.push((row.get(0)?, place, bounds, [from, to.map_or(LIVE, |to| to - 1)]));
    }
    let Some(all) = boxes.iter().map(|(_, _, bounds, _)| *bounds).reduce(|all, bounds| all.union(&bounds)) else {
        return Ok(BTreeMap::new());
    };
    let origin = match IndexOrigin::read(connection)? {
        Some(origin) => origin,
        None => {
            let origin = IndexOrigin::choose(&all);
            origin.write(connection)?;
            did(done, "meta", "meta", "chose the origin of the index anew");
            origin
        }
    };
    let row = |(id, place, bounds, versions): (i64, String, BoxMm, [i64; 2])| {
        origin.to_index(&bounds).map(|ends| (id, Wanted { place, ends, versions }))
    };
    Ok(boxes.into_iter().filter_map(row).collect())
}

/// Rows whose state has no box, so that nothing says what the index should have of them.
fn unreadable_rows(connection: &Connection) -> Result<BTreeSet<i64>, Fault> {
    let mut statement = connection.prepare("SELECT id, state FROM feature_version ORDER BY id")?;
    let mut rows = statement.query([])?;
    let mut unreadable = BTreeSet::new();
    while let Some(row) = rows.next()? {
        if read_box(row, 1)?.is_none() {
            unreadable.insert(row.get(0)?);
        }
    }
    Ok(unreadable)
}

/// The box of the state in `column`, where it can be read.
fn read_box(row: &Row, column: usize) -> Result<Option<BoxMm>, Fault> {
    let state = FeatureState::from_bytes(row.get_ref(column)?.as_blob().map_err(rusqlite::Error::from)?);
    Ok(state.ok().and_then(|state| state.bounds().ok()))
}

fn index_rows(connection: &Connection) -> Result<Vec<(i64, [i64; 8])>, Fault> {
    const SQL: &str = "SELECT id, e0, e1, n0, n1, h0, h1, v0, v1 FROM feature_index ORDER BY id";
    let mut statement = connection.prepare(SQL)?;
    let mut rows = statement.query([])?;
    let mut found = Vec::new();
    while let Some(row) = rows.next()? {
        let mut values = [0; 8];
        for (column, value) in values.iter_mut().enumerate() {
            *value = row.get(1 + column)?;
        }
        found.push((row.get(0)?, values));
    }
    Ok(found)
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
