//! Making the index anew from the rows of features.

use super::block::{Block, LIVE, Life};
use super::cell::Cell;
use super::origin::IndexOrigin;
use super::write::insert;
use crate::store::error::Fault;
use crate::version::{FeatureState, VersionId};
use rusqlite::{Connection, Row};
use std::collections::{BTreeMap, BTreeSet};

/// The columns that [`Source::expected`] reads, of `feature_version` as `f`.
pub(super) const LIFE_COLUMNS: &str = "f.id, f.fid, f.from_version, f.to_version, f.state";

/// What the index is made from beside the rows of features.
pub(in crate::store) struct Source {
    pub(in crate::store) origin: Option<IndexOrigin>,
    /// Versions that are not what their hash says: rows that begin or end with them prove nothing.
    pub(in crate::store) doubtful: BTreeSet<VersionId>,
}

/// What the index should have of a row.
pub(super) enum Expected {
    At(Cell, Life),
    /// The row does not say: its state has no box, its number or span is none, or it is in doubt.
    Unknown,
    /// The box does not fit around the origin.
    Outside,
}

impl Source {
    /// The origin of this map, and all its rows.
    pub(in crate::store) fn read(connection: &Connection) -> Result<Self, Fault> {
        Ok(Self { origin: IndexOrigin::read(connection)?, doubtful: BTreeSet::new() })
    }

    /// What the index should have of a row of [`LIFE_COLUMNS`].
    pub(super) fn expected(&self, row: &Row) -> Result<Expected, Fault> {
        let (id, first, to): (i64, i64, Option<i64>) = (row.get(0)?, row.get(2)?, row.get(3)?);
        let last = to.map_or(LIVE, |to| to.saturating_sub(1));
        // A block cannot hold other ids.
        let is_span = id >= 1 && (0..=last).contains(&first) && (to.is_none() || last < LIVE);
        let is_in_doubt = |version: i64| self.doubtful.contains(&VersionId(version.unsigned_abs()));
        let state = FeatureState::from_bytes(row.get_ref(4)?.as_blob().map_err(rusqlite::Error::from)?);
        let bounds = state.ok().and_then(|state| state.bounds().ok());
        let Some(bounds) = bounds.filter(|_| is_span && !is_in_doubt(first) && !to.is_some_and(is_in_doubt)) else {
            return Ok(Expected::Unknown);
        };
        let ends = self.origin.and_then(|origin| origin.to_index(&bounds));
        Ok(ends.map_or(Expected::Outside, |ends| Expected::At(Cell::of(&ends), Life { id, ends, first, last })))
    }
}

/// Makes the index anew. `kept` are lives of rows that do not say where they belong.
pub(in crate::store) fn rebuild(
    connection: &Connection,
    source: &Source,
    kept: BTreeMap<i64, Life>,
) -> Result<(), Fault> {
    connection.execute("DELETE FROM feature_index", [])?;
    let mut lives: Vec<(Cell, Life)> = kept.into_values().map(|life| (Cell::of(&life.ends), life)).collect();
    let sql = format!("SELECT {LIFE_COLUMNS} FROM feature_version AS f ORDER BY f.id");
    let mut statement = connection.prepare(&sql)?;
    let mut rows = statement.query([])?;
    while let Some(row) = rows.next()? {
        if let Expected::At(cell, life) = source.expected(row)? {
            lives.push((cell, life));
        }
    }
    lives.sort_unstable_by_key(|(cell, life)| (*cell, life.id));
    for of_cell in lives.chunk_by(|a, b| a.0 == b.0) {
        let lives: Vec<Life> = of_cell.iter().map(|(_, life)| *life).collect();
        for block in blocks_of(of_cell[0].0, &lives)? {
            insert(connection, &block)?;
        }
    }
    Ok(())
}

/// The blocks of a cell, as its versions would have written them one after the other.
pub(super) fn blocks_of(cell: Cell, lives: &[Life]) -> Result<Vec<Block>, Fault> {
    let mut versions: BTreeMap<i64, (Vec<i64>, Vec<Life>)> = BTreeMap::new();
    for life in lives {
        versions.entry(life.first).or_default().1.push(Life { last: LIVE, ..*life });
        if life.last < LIVE {
            versions.entry(life.last + 1).or_default().0.push(life.id);
        }
    }
    let (mut blocks, mut open) = (Vec::new(), None);
    for (version, (ended, begun)) in versions {
        let block = open.get_or_insert_with(|| Block::first(cell, version, Vec::new()));
        blocks.extend(block.advance(version, &ended, &begun)?);
    }
    blocks.extend(open);
    Ok(blocks)
}
