//! Writing blocks.

use super::block::{Block, LIVE, Life};
use super::build::blocks_of;
use super::cell::Cell;
use super::origin::IndexBox;
use super::search::{each_cell, merged};
use crate::store::error::Fault;
use rusqlite::{Connection, OptionalExtension, params};
use std::collections::{BTreeMap, BTreeSet};

/// What a version changes in the index, cell by cell.
pub(in crate::store) struct IndexChanges {
    version: i64,
    cells: BTreeMap<Cell, CellChanges>,
}

#[derive(Default)]
struct CellChanges {
    ended: Vec<i64>,
    begun: Vec<Life>,
}

impl IndexChanges {
    /// None yet.
    pub(in crate::store) fn of(version: i64) -> Self {
        Self { version, cells: BTreeMap::new() }
    }

    /// The row `id`, whose box is `ends`, ends.
    pub(in crate::store) fn end(&mut self, id: i64, ends: &IndexBox) {
        self.cells.entry(Cell::of(ends)).or_default().ended.push(id);
    }

    /// The row `id`, whose box is `ends`, begins.
    pub(in crate::store) fn begin(&mut self, id: i64, ends: IndexBox) {
        let life = Life { id, ends, first: self.version, last: LIVE };
        self.cells.entry(Cell::of(&ends)).or_default().begun.push(life);
    }

    /// Writes them, in the order of the file.
    pub(in crate::store) fn write(self, connection: &Connection) -> Result<(), Fault> {
        const NEWEST: &str = "SELECT from_version, lives FROM feature_index WHERE cell = ?1
            ORDER BY from_version DESC LIMIT 1";
        const UPDATE: &str = "UPDATE feature_index SET lives = ?3 WHERE cell = ?1 AND from_version = ?2";
        let (mut newest, mut update) = (connection.prepare_cached(NEWEST)?, connection.prepare_cached(UPDATE)?);
        for (cell, CellChanges { ended, begun }) in self.cells {
            let read = |row: &rusqlite::Row| {
                let bytes = row.get_ref(1)?.as_blob()?;
                Ok((row.get(0)?, Block::from_bytes(cell, row.get(0)?, bytes)))
            };
            let found: Option<(i64, Result<Block, Fault>)> = newest.query_row([cell.number()], read).optional()?;
            let (since, mut block) = match found {
                Some((since, block)) => (Some(since), block?),
                None => (None, Block::first(cell, self.version, Vec::new())),
            };
            let closed = block.advance(self.version, &ended, &begun)?;
            if let (Some(since), Some(full)) = (since, closed.as_ref().or(Some(&block))) {
                update.execute(params![cell.number(), since, full.to_bytes()])?;
            }
            if since.is_none() || closed.is_some() {
                insert(connection, &block)?;
            }
        }
        Ok(())
    }
}

/// Writes a new block.
pub(super) fn insert(connection: &Connection, block: &Block) -> Result<(), Fault> {
    const INSERT: &str = "INSERT INTO feature_index (cell, from_version, lives) VALUES (?1, ?2, ?3)";
    connection.prepare_cached(INSERT)?.execute(params![block.cell.number(), block.since, block.to_bytes()])?;
    Ok(())
}

/// Takes the rows `dead` out. Reads the whole index.
pub(in crate::store) fn remove(connection: &Connection, dead: &BTreeSet<i64>) -> Result<(), Fault> {
    const DELETE: &str = "DELETE FROM feature_index WHERE cell = ?1";
    let mut touched = Vec::new();
    each_cell(connection, |cell, blocks| {
        let blocks = blocks.into_iter().collect::<Result<Vec<_>, _>>()?;
        let mut lives = merged(&blocks);
        let count = lives.len();
        lives.retain(|life| !dead.contains(&life.id));
        if lives.len() < count {
            touched.push((cell, lives));
        }
        Ok(())
    })?;
    for (cell, lives) in touched {
        connection.prepare_cached(DELETE)?.execute([cell.number()])?;
        for block in blocks_of(cell, &lives)? {
            insert(connection, &block)?;
        }
    }
    Ok(())
}
