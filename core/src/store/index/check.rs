//! Holding the index against the rows of features.

use super::block::{Block, LIVE, Life};
use super::build::{Expected, LIFE_COLUMNS, Source};
use super::cell::Cell;
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

/// Where the index differs from what the rows say, and what it has of rows that do not say where they belong.
pub(in crate::store) fn flaws(
    connection: &Connection,
    source: &Source,
) -> Result<(Vec<Flaw>, BTreeMap<i64, Life>), Fault> {
    let mut check = Check { connection, source, seen: BTreeSet::new(), flaws: Vec::new() };
    let mut unknown = BTreeMap::new();
    each_cell(connection, |cell, blocks| {
        let mut readable = Vec::new();
        for block in blocks {
            match block {
                Ok(block) => readable.push(block),
                Err(Fault::Damage(detail)) => check.stray(format!("cell {}", cell.number()), &detail),
                Err(fault) => return Err(fault),
            }
        }
        unknown.extend(check.cell(cell, &readable)?);
        Ok(())
    })?;
    check.missing()?;
    Ok((check.flaws, unknown))
}

struct Check<'c> {
    connection: &'c Connection,
    source: &'c Source,
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

    /// Holds the blocks of a cell against the rows they name; returns what they have of rows that do not say.
    fn cell(&mut self, cell: Cell, blocks: &[Block]) -> Result<BTreeMap<i64, Life>, Fault> {
        let named: BTreeSet<i64> = blocks.iter().flat_map(|block| &block.lives).map(|life| life.id).collect();
        let rows = self.rows(&named)?;
        let mut unknown = BTreeMap::new();
        for id in named {
            let found = || blocks.iter().filter_map(|block| life_in(block, id));
            match rows.get(&id) {
                None => self.stray(format!("index row {id}"), "belongs to no feature"),
                Some((_, Expected::Unknown)) => unknown.extend(found().next_back().map(|life| (id, life))),
                // It is seen nowhere, and named with the rows that are missing.
                Some((_, Expected::Outside)) => {}
                Some((place, Expected::At(own, _))) if *own != cell => {
                    let detail = format!("the index has it in cell {}, expected {}", cell.number(), own.number());
                    self.wrong(place.clone(), detail);
                }
                Some((place, Expected::At(_, life))) => {
                    self.seen.insert(id);
                    if let Some(detail) = difference(blocks, life) {
                        self.wrong(place.clone(), detail);
                    }
                }
            }
        }
        self.seen.extend(unknown.keys());
        Ok(unknown)
    }

    fn rows(&self, ids: &BTreeSet<i64>) -> Result<BTreeMap<i64, (String, Expected)>, Fault> {
        let sql = format!("SELECT {LIFE_COLUMNS} FROM {} ORDER BY f.id", Ids::ROWS);
        let mut statement = self.connection.prepare_cached(&sql)?;
        let ids = Ids::of(ids.iter().copied());
        let mut rows = statement.query(named_params! {":ids": ids.json()})?;
        let mut expected = BTreeMap::new();
        while let Some(row) = rows.next()? {
            expected.insert(row.get(0)?, (place(row)?, self.source.expected(row)?));
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
            match self.source.expected(row)? {
                Expected::At(..) => self.wrong(place(row)?, "is not in the index".to_owned()),
                Expected::Outside => self.wrong(place(row)?, "does not fit around the origin of the index".to_owned()),
                // Where it should be is not known; the checks of states and versions name it.
                Expected::Unknown => {}
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
    let ends = blocks.iter().skip(1).map(|next| next.since.saturating_sub(1)).chain([LIVE]);
    blocks.iter().zip(ends).find_map(|(block, until)| {
        let (found, expected) = (life_in(block, life.id), block.expected(life, until));
        let text = |life: Option<Life>| life.map_or("nothing".to_owned(), |life| format!("{life:?}"));
        (found != expected)
            .then(|| format!("the index has {} in the {}, expected {}", text(found), block.place(), text(expected)))
    })
}
