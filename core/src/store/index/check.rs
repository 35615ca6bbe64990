//! Holding the index against the rows of features.

use super::block::{Block, LIVE, Life};
use super::build::{LIFE_COLUMNS, life};
use super::cell::Cell;
use super::origin::IndexOrigin;
use super::search::{Ids, each_cell};
use crate::store::error::Fault;
use rusqlite::{Connection, named_params};
use std::collections::{BTreeMap, BTreeSet};

/// Where the index is wrong.
pub(in crate::store) enum Flaw {
    /// A state that it has not, or not as it is.
    Wrong { place: String, detail: String },
    /// Something in it that no state is behind.
    Stray { place: String, detail: String },
}

/// A row and what the index should have of it; nothing where the state has no box.
struct Expected {
    place: String,
    life: Option<(Cell, Life)>,
}

/// Where the index differs from what the rows say, and what it has of rows whose state has no box.
pub(in crate::store) fn flaws(connection: &Connection) -> Result<(Vec<Flaw>, BTreeMap<i64, Life>), Fault> {
    let mut check =
        Check { connection, origin: IndexOrigin::read(connection)?, seen: BTreeSet::new(), flaws: Vec::new() };
    let mut boxless = BTreeMap::new();
    each_cell(connection, |cell, blocks| {
        let mut readable = Vec::new();
        for block in blocks {
            match block {
                Ok(block) => readable.push(block),
                Err(Fault::Damage(detail)) => check.stray(format!("cell {}", cell.number()), &detail),
                Err(fault) => return Err(fault),
            }
        }
        boxless.extend(check.cell(cell, &readable)?);
        Ok(())
    })?;
    check.missing()?;
    Ok((check.flaws, boxless))
}

struct Check<'c> {
    connection: &'c Connection,
    origin: Option<IndexOrigin>,
    /// Rows that are in the cell where they belong.
    seen: BTreeSet<i64>,
    flaws: Vec<Flaw>,
}

impl Check<'_> {
    fn stray(&mut self, place: String, detail: &str) {
        self.flaws.push(Flaw::Stray { place, detail: detail.to_owned() });
    }

    fn wrong(&mut self, place: String, detail: String) {
        self.flaws.push(Flaw::Wrong { place, detail });
    }

    /// Holds the blocks of a cell against the rows they name; returns what they have of rows without a box.
    fn cell(&mut self, cell: Cell, blocks: &[Block]) -> Result<BTreeMap<i64, Life>, Fault> {
        let named: BTreeSet<i64> = blocks.iter().flat_map(|block| &block.lives).map(|life| life.id).collect();
        let rows = self.rows(&named)?;
        let mut boxless = BTreeMap::new();
        for id in named {
            let found = || blocks.iter().filter_map(|block| life_in(block, id));
            match rows.get(&id) {
                None => self.stray(format!("index row {id}"), "belongs to no feature"),
                Some(Expected { life: None, .. }) => boxless.extend(found().next_back().map(|life| (id, life))),
                Some(Expected { place, life: Some((own, _)) }) if *own != cell => {
                    let detail = format!("the index has it in cell {}, expected {}", cell.number(), own.number());
                    self.wrong(place.clone(), detail);
                }
                Some(Expected { place, life: Some((_, life)) }) => {
                    self.seen.insert(id);
                    if let Some(detail) = difference(blocks, life) {
                        self.wrong(place.clone(), detail);
                    }
                }
            }
        }
        self.seen.extend(boxless.keys());
        Ok(boxless)
    }

    fn rows(&self, ids: &BTreeSet<i64>) -> Result<BTreeMap<i64, Expected>, Fault> {
        let sql = format!("SELECT {LIFE_COLUMNS} FROM {} ORDER BY f.id", Ids::ROWS);
        let mut statement = self.connection.prepare_cached(&sql)?;
        let ids = Ids::of(ids.iter().copied());
        let mut rows = statement.query(named_params! {":ids": ids.json()})?;
        let mut expected = BTreeMap::new();
        while let Some(row) = rows.next()? {
            expected.insert(row.get(0)?, Expected { place: place(row)?, life: life(row, self.origin)? });
        }
        Ok(expected)
    }

    /// Rows that live in some version and were seen nowhere.
    fn missing(&mut self) -> Result<(), Fault> {
        let sql = format!("SELECT {LIFE_COLUMNS} FROM feature_version AS f ORDER BY f.id");
        let mut statement = self.connection.prepare(&sql)?;
        let mut rows = statement.query([])?;
        while let Some(row) = rows.next()? {
            if self.seen.contains(&row.get(0)?) {
                continue;
            }
            // Where a state without a box should be is not known; the check of the states names it.
            if life(row, self.origin)?.is_some_and(|(_, life)| life.first <= life.last) {
                self.wrong(place(row)?, "is not in the index".to_owned());
            }
        }
        Ok(())
    }
}

fn place(row: &rusqlite::Row) -> Result<String, Fault> {
    Ok(format!("feature {} from version {}", row.get::<_, i64>(1)?, row.get::<_, i64>(2)?))
}

fn life_in(block: &Block, id: i64) -> Option<Life> {
    block.lives.iter().find(|life| life.id == id).copied()
}

/// How the blocks of its cell have `life` in another way than they should.
fn difference(blocks: &[Block], life: &Life) -> Option<String> {
    if let Some(first) = blocks.first().filter(|first| first.since > life.first) {
        return Some(format!("the index of its cell begins with version {}", first.since));
    }
    let ends = blocks.iter().skip(1).map(|next| next.since - 1).chain([LIVE]);
    blocks.iter().zip(ends).find_map(|(block, until)| {
        let (found, expected) = (life_in(block, life.id), block.expected(life, until));
        let text = |life: Option<Life>| life.map_or("nothing".to_owned(), |life| format!("{life:?}"));
        (found != expected)
            .then(|| format!("the index has {} in the {}, expected {}", text(found), block.place(), text(expected)))
    })
}
