//! Asking the index.

use super::block::{Block, LIVE, Life};
use super::cell::Cell;
use super::origin::{IndexBox, IndexOrigin};
use crate::store::error::Fault;
use crate::store::rows::{FEATURE_COLUMNS, feature};
use crate::version::{BoxMm, Feature, Fid, VersionId};
use rusqlite::{Connection, named_params};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

/// Rows that are not asked for are read over if the next one that is lies no further: finding a row from the root takes as
/// long as reading some.
const NEAR_ROWS: i64 = 8;

/// Rows of `feature_version` by their ids.
pub(in crate::store) struct Ids(String);

impl Ids {
    /// The rows as `f`, for a query with [`Self::json`] as `:ids`; the cross join keeps the planner from reading all rows.
    pub(in crate::store) const ROWS: &str = "json_each(:ids) AS i CROSS JOIN feature_version AS f ON f.id = i.value";

    /// These rows, each once.
    pub(in crate::store) fn of(ids: impl IntoIterator<Item = i64>) -> Self {
        let mut json = String::from("[");
        for id in ids {
            if json.len() > 1 {
                json.push(',');
            }
            json += &id.to_string();
        }
        json.push(']');
        Self(json)
    }

    /// A JSON array of the ids.
    pub(in crate::store) fn json(&self) -> &str {
        &self.0
    }
}

/// The features at `version` whose box shares a point with `region`, by rising number.
pub(in crate::store) fn state(
    connection: &Connection,
    version: VersionId,
    region: &BoxMm,
) -> Result<Vec<Feature>, Fault> {
    fetched(connection, &ids_at(connection, version, region)?)
}

/// The features in `region` whose state is at `early` and no more at `late`, and those whose state is at `late` and was
/// not yet at `early`, by rising number.
pub(in crate::store) fn difference(
    connection: &Connection,
    [early, late]: [VersionId; 2],
    region: &BoxMm,
) -> Result<(Vec<Feature>, Vec<Feature>), Fault> {
    let (before, after) = (ids_at(connection, early, region)?, ids_at(connection, late, region)?);
    let without = |ids: &[i64], other: &[i64]| -> Vec<i64> {
        ids.iter().copied().filter(|id| other.binary_search(id).is_err()).collect()
    };
    Ok((fetched(connection, &without(&before, &after))?, fetched(connection, &without(&after, &before))?))
}

/// The features in `region` whose state began or ended after `base`.
pub(in crate::store) fn changed_since(
    connection: &Connection,
    region: &BoxMm,
    base: VersionId,
) -> Result<BTreeSet<Fid>, Fault> {
    let base = base.0 as i64;
    let mut lives = lives_in(connection, region, base..=LIVE)?;
    lives.retain(|life| life.first > base || life.last < LIVE);
    let sql = format!("SELECT DISTINCT f.fid FROM {} ORDER BY f.fid", Ids::ROWS);
    let mut statement = connection.prepare_cached(&sql)?;
    let ids = Ids::of(lives.iter().map(|life| life.id));
    let fids = statement.query_map(named_params! {":ids": ids.json()}, |row| row.get::<_, i64>(0))?;
    fids.map(|fid| Ok(Fid(fid?.unsigned_abs()))).collect()
}

/// The smallest box around everything at `version`. Reads a block of every cell.
pub(in crate::store) fn bounds_of(connection: &Connection, version: VersionId) -> Result<Option<BoxMm>, Fault> {
    let Some(origin) = IndexOrigin::read(connection)? else { return Ok(None) };
    let everywhere = [i32::MIN, i32::MAX, i32::MIN, i32::MAX, i32::MIN, i32::MAX].map(i64::from);
    let at = version.0 as i64;
    let mut around: Option<IndexBox> = None;
    each_block_in(connection, &everywhere, &(at..=at), |block| {
        for life in block.lives.iter().filter(|life| life.first <= at && life.last >= at) {
            let all = around.get_or_insert(life.ends);
            for axis in 0..3 {
                all[2 * axis] = all[2 * axis].min(life.ends[2 * axis]);
                all[2 * axis + 1] = all[2 * axis + 1].max(life.ends[2 * axis + 1]);
            }
        }
    })?;
    Ok(around.and_then(|ends| origin.box_at(&ends)))
}

/// Every life in `region` that one of `versions` has, by cell and id. Of a life that goes on after the last of them it is
/// left open when it ends.
pub(in crate::store) fn lives_in(
    connection: &Connection,
    region: &BoxMm,
    versions: RangeInclusive<i64>,
) -> Result<Vec<Life>, Fault> {
    let Some(region) = IndexOrigin::read(connection)?.and_then(|origin| origin.clamp(region)) else {
        return Ok(Vec::new());
    };
    let mut found: Vec<Life> = Vec::new();
    // A cell's blocks come one after the other, the newest first: it knows best when a life ended.
    let mut cell = (Cell::numbered(-1), BTreeSet::new());
    each_block_in(connection, &region, &versions, |block| {
        if cell.0 != block.cell {
            cell = (block.cell, BTreeSet::new());
        }
        let is_asked =
            |life: &Life| life.first <= *versions.end() && life.last >= *versions.start() && life.meets(&region);
        let is_whole = block.since <= *versions.start() && cell.1.is_empty();
        for life in block.lives.iter().filter(|life| is_asked(life)) {
            if is_whole || cell.1.insert(life.id) {
                found.push(*life);
            }
        }
    })?;
    Ok(found)
}

/// By rising id, each once.
fn ids_at(connection: &Connection, version: VersionId, region: &BoxMm) -> Result<Vec<i64>, Fault> {
    let at = version.0 as i64;
    let mut ids: Vec<i64> = lives_in(connection, region, at..=at)?.iter().map(|life| life.id).collect();
    ids.sort_unstable();
    ids.dedup();
    Ok(ids)
}

/// The features of these rows, by rising number. `ids` rise.
fn fetched(connection: &Connection, ids: &[i64]) -> Result<Vec<Feature>, Fault> {
    let sql =
        format!("SELECT {FEATURE_COLUMNS}, f.id FROM feature_version AS f WHERE f.id BETWEEN ?1 AND ?2 ORDER BY f.id");
    let mut statement = connection.prepare_cached(&sql)?;
    let mut features = Vec::with_capacity(ids.len());
    for run in ids.chunk_by(|id, next| next - id <= NEAR_ROWS) {
        let mut rows = statement.query([run[0], run[run.len() - 1]])?;
        let mut wanted = run.iter().peekable();
        while let Some(row) = rows.next()? {
            let id: i64 = row.get(4)?;
            if wanted.next_if_eq(&&id).is_some() {
                features.push(feature(row)?);
            }
        }
        if let Some(id) = wanted.next() {
            return Err(Fault::Damage(format!("the index names row {id} of the features, which is not there")));
        }
    }
    features.sort_by_cached_key(|feature| feature.fid);
    Ok(features)
}

/// Shows `visit` the blocks in `region` that hold one of `versions`, by cell, the newest first.
fn each_block_in(
    connection: &Connection,
    region: &IndexBox,
    versions: &RangeInclusive<i64>,
    mut visit: impl FnMut(&Block),
) -> Result<(), Fault> {
    const LAST: &str = "SELECT cell, from_version, lives FROM feature_index WHERE (cell, from_version) <= (?1, ?2)
        ORDER BY cell DESC, from_version DESC LIMIT 1";
    const OLDER: &str = "SELECT from_version, lives FROM feature_index WHERE cell = ?1 AND from_version < ?2
        ORDER BY from_version DESC";
    let (mut last, mut older) = (connection.prepare_cached(LAST)?, connection.prepare_cached(OLDER)?);
    let mut next = Cell::last_of(region);
    while let Some(cell) = next {
        let mut rows = last.query([cell.number(), *versions.end()])?;
        let Some(row) = rows.next()? else { break };
        let (found, mut since) = (Cell::numbered(row.get(0)?), row.get::<_, i64>(1)?);
        next = found.down_to(region);
        // A cell before the one that was asked for may begin with a block that is too new.
        if next != Some(found) || since > *versions.end() {
            continue;
        }
        visit(&Block::from_bytes(found, since, row.get_ref(2)?.as_blob().map_err(rusqlite::Error::from)?)?);
        next = found.before(region);
        if since > *versions.start() {
            let mut rows = older.query([found.number(), since])?;
            while let Some(row) = rows.next()?.filter(|_| since > *versions.start()) {
                since = row.get(0)?;
                visit(&Block::from_bytes(found, since, row.get_ref(1)?.as_blob().map_err(rusqlite::Error::from)?)?);
            }
        }
    }
    Ok(())
}

/// Shows `visit` the blocks of each cell, the oldest first, whether they can be read or not.
pub(super) fn each_cell(
    connection: &Connection,
    mut visit: impl FnMut(Cell, Vec<Result<Block, Fault>>) -> Result<(), Fault>,
) -> Result<(), Fault> {
    const SQL: &str = "SELECT cell, from_version, lives FROM feature_index ORDER BY cell, from_version";
    let mut statement = connection.prepare(SQL)?;
    let mut rows = statement.query([])?;
    let mut blocks: (Option<Cell>, Vec<Result<Block, Fault>>) = (None, Vec::new());
    while let Some(row) = rows.next()? {
        let cell = Cell::numbered(row.get(0)?);
        let block = Block::from_bytes(cell, row.get(1)?, row.get_ref(2)?.as_blob().map_err(rusqlite::Error::from)?);
        match blocks.0.replace(cell) {
            Some(before) if before != cell => visit(before, std::mem::take(&mut blocks.1))?,
            _ => {}
        }
        blocks.1.push(block);
    }
    blocks.0.map_or(Ok(()), |cell| visit(cell, blocks.1))
}

/// Every life of the blocks of a cell, by rising id, as the newest that has it says.
pub(super) fn merged<'b>(blocks: impl IntoIterator<Item = &'b Block>) -> Vec<Life> {
    let lives: BTreeMap<i64, Life> =
        blocks.into_iter().flat_map(|block| &block.lives).map(|life| (life.id, *life)).collect();
    lives.into_values().collect()
}
