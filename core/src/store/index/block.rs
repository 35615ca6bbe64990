//! Blocks: the lives of a cell over a stretch of versions, and their bytes.

use super::cell::Cell;
use super::origin::IndexBox;
use crate::store::error::Fault;

/// Last version of a life that goes on.
pub(in crate::store) const LIVE: i64 = i32::MAX as i64;

/// A block with more bytes is closed if at least half of its lives have ended. Less than 1002 bytes fit into a page of
/// 4 KiB without another for the rest (SQLite, Database File Format, 1.6).
const FULL_BYTES: usize = 950;

/// A row of `feature_version` in the index: box, first and last version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::store) struct Life {
    pub(in crate::store) id: i64,
    pub(in crate::store) ends: IndexBox,
    pub(in crate::store) first: i64,
    /// [`LIVE`] when it has not ended.
    pub(in crate::store) last: i64,
}

impl Life {
    /// Whether the box shares a point with `region`.
    pub(super) fn meets(&self, region: &IndexBox) -> bool {
        (0..3).all(|axis| self.ends[2 * axis] <= region[2 * axis + 1] && self.ends[2 * axis + 1] >= region[2 * axis])
    }
}

/// Every life of a cell that some version from `since` until the next block has. A life that goes on after the last of
/// them is not ended here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Block {
    pub(super) cell: Cell,
    pub(super) since: i64,
    /// By rising id.
    pub(super) lives: Vec<Life>,
}

impl Block {
    /// The first block of a cell.
    pub(super) fn first(cell: Cell, since: i64, lives: Vec<Life>) -> Self {
        let mut block = Self { cell, since, lives };
        block.lives.sort_unstable_by_key(|life| life.id);
        block
    }

    /// Takes in what `version` ended and began. Returns itself as it was before what began, when it is full: then what
    /// is left is the next block.
    pub(super) fn advance(&mut self, version: i64, ended: &[i64], begun: &[Life]) -> Result<Option<Self>, Fault> {
        for id in ended {
            match self.lives.binary_search_by_key(id, |life| life.id) {
                Ok(place) if self.lives[place].last == LIVE => self.lives[place].last = version - 1,
                _ => return Err(self.fault(&format!("row {id} is not live in it at version {version}"))),
            }
        }
        let live = self.lives.iter().filter(|life| life.last == LIVE).count() + begun.len();
        let all = self.lives.len() + begun.len();
        let is_full = 2 * live <= all && self.since < version && self.to_bytes().len() > FULL_BYTES;
        let closed = is_full.then(|| self.clone());
        if is_full {
            self.since = version;
            self.lives.retain(|life| life.last == LIVE);
        }
        self.lives.extend_from_slice(begun);
        self.lives.sort_unstable_by_key(|life| life.id);
        Ok(closed)
    }

    /// Whether a life of the cell is in this block, where the block lasts until `until`, and how.
    pub(super) fn expected(&self, life: &Life, until: i64) -> Option<Life> {
        let last = if life.last <= until { life.last } else { LIVE };
        (life.first <= until && life.last >= self.since).then_some(Life { last, ..*life })
    }

    /// The bytes of the lives; docs/file-format.md describes them.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let [e, n] = self.cell.corner();
        let mut bytes = Vec::with_capacity(24 * self.lives.len());
        let mut id = 0;
        for life in &self.lives {
            let [e0, e1, n0, n1, h0, h1] = life.ends;
            let versions = if life.last == LIVE { 0 } else { life.last - life.first + 1 };
            let numbers = [life.id - id, life.first, versions, e0 - e, e1 - e0, n0 - n, n1 - n0];
            numbers.into_iter().for_each(|number| push(&mut bytes, number as u64));
            push(&mut bytes, zigzag(h0));
            push(&mut bytes, (h1 - h0) as u64);
            id = life.id;
        }
        bytes
    }

    /// The block whose lives have these bytes.
    pub(super) fn from_bytes(cell: Cell, since: i64, bytes: &[u8]) -> Result<Self, Fault> {
        let mut block = Self { cell, since, lives: Vec::with_capacity(bytes.len() / 16) };
        let (mut rest, mut id) = (bytes, 0);
        while !rest.is_empty() {
            let Some(life) = read_life(&mut rest, id, cell.corner()) else {
                let at = bytes.len() - rest.len();
                return Err(block.fault(&format!("byte {at} of {} belongs to no life", bytes.len())));
            };
            id = life.id;
            block.lives.push(life);
        }
        Ok(block)
    }

    fn fault(&self, detail: &str) -> Fault {
        Fault::Damage(format!("{}: {detail}", self.place()))
    }

    /// What it is called in messages.
    pub(super) fn place(&self) -> String {
        format!("block of cell {} from version {}", self.cell.number(), self.since)
    }
}

/// The next life after the row `id`; `None` where the bytes are none.
fn read_life(bytes: &mut &[u8], id: i64, [e, n]: [i64; 2]) -> Option<Life> {
    let mut numbers = [0_i64; 9];
    for number in &mut numbers {
        *number = i64::try_from(read(bytes)?).ok()?;
    }
    let [step, first, versions, e0, width, n0, depth, h0, height] = numbers;
    let id = id.checked_add(step).filter(|_| step > 0)?;
    let last = if versions == 0 { LIVE } else { first.checked_add(versions - 1).filter(|&last| last < LIVE)? };
    let (e0, n0) = (e.checked_add(e0)?, n.checked_add(n0)?);
    let h0 = (h0 >> 1) ^ -(h0 & 1);
    let ends = [e0, e0.checked_add(width)?, n0, n0.checked_add(depth)?, h0, h0.checked_add(height)?];
    let fits = ends.iter().all(|&end| i32::try_from(end).is_ok()) && first < LIVE;
    fits.then_some(Life { id, ends, first, last })
}

/// Appends `number` in groups of seven bits, the lowest first; all but the last have the eighth bit set (LEB128).
fn push(bytes: &mut Vec<u8>, mut number: u64) {
    while number >= 1 << 7 {
        bytes.push(number as u8 | 1 << 7);
        number >>= 7;
    }
    bytes.push(number as u8);
}

fn read(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for shift in (0..63).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        number |= u64::from(byte & 0x7f) << shift;
        if byte < 1 << 7 {
            // A last group of zeros would be a second form of the same number.
            return (byte != 0 || shift == 0).then_some(number);
        }
    }
    None
}

/// 0, -1, 1, -2 … become 0, 1, 2, 3 …
fn zigzag(number: i64) -> u64 {
    (number << 1 ^ number >> 63) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::index::build::blocks_of;
    use proptest::prelude::*;

    fn life(id: i64, first: i64, last: i64, easting: i64) -> Life {
        Life { id, ends: [easting, easting + 3000, 7, 7, -5, 2000], first, last }
    }

    #[test]
    fn a_block_has_the_bytes_of_the_documentation() {
        // docs/file-format.md, worked out there by hand.
        let cell = Cell::of(&[0, 3000, 7, 7, 0, 0]);
        let block = Block::first(cell, 1, vec![life(2, 1, 3, 300), life(5, 4, LIVE, 1)]);
        let bytes = [2, 1, 3, 0xac, 2, 0xb8, 0x17, 7, 0, 9, 0xd5, 0x0f, 3, 4, 0, 1, 0xb8, 0x17, 7, 0, 9, 0xd5, 0x0f];
        assert_eq!(block.to_bytes(), bytes);
        assert_eq!(Block::from_bytes(cell, 1, &bytes).unwrap(), block);
    }

    #[test]
    fn a_life_that_is_not_live_cannot_end() {
        let mut block = Block::first(Cell::of(&[0; 6]), 1, vec![life(2, 1, 3, 0)]);
        for id in [2, 3] {
            assert!(matches!(block.advance(5, &[id], &[]), Err(Fault::Damage(detail)) if detail.contains("not live")));
        }
    }

    fn lives() -> impl Strategy<Value = Vec<Life>> {
        let life = (1..60_i64, prop_oneof![Just(None), (0..40_i64).prop_map(Some)], 0..10_000_i64);
        prop::collection::vec(life, 1..300).prop_map(|lives| {
            let numbered = lives.into_iter().zip(1..);
            numbered.map(|((first, more, e), id)| life_of(id, first, more, e)).collect()
        })
    }

    fn life_of(id: i64, first: i64, more: Option<i64>, easting: i64) -> Life {
        life(id, first, more.map_or(LIVE, |more| first + more), easting)
    }

    proptest! {
        #[test]
        fn every_version_finds_all_its_lives_in_one_block(lives in lives()) {
            let cell = Cell::of(&lives[0].ends);
            let blocks = blocks_of(cell, &lives).unwrap();
            for version in 0..110 {
                let block = blocks.iter().rev().find(|block| block.since <= version);
                let found = block.map_or(Vec::new(), |block| block.lives.clone());
                let is_alive = |life: &&Life| life.first <= version && version <= life.last;
                let found: Vec<i64> = found.iter().filter(is_alive).map(|life| life.id).collect();
                let expected: Vec<i64> = lives.iter().filter(is_alive).map(|life| life.id).collect();
                prop_assert_eq!(found, expected);
            }
        }

        #[test]
        fn a_life_is_written_again_only_when_another_has_ended(lives in lives()) {
            let blocks = blocks_of(Cell::of(&lives[0].ends), &lives).unwrap();
            let written: usize = blocks.iter().map(|block| block.lives.len()).sum();
            let ended = lives.iter().filter(|life| life.last < LIVE).count();
            prop_assert!(written <= lives.len() + ended, "{written} of {} and {ended}", lives.len());
        }

        #[test]
        fn blocks_can_be_read_back(lives in lives()) {
            for block in blocks_of(Cell::of(&lives[0].ends), &lives).unwrap() {
                prop_assert_eq!(Block::from_bytes(block.cell, block.since, &block.to_bytes()).unwrap(), block);
            }
        }

        #[test]
        fn of_any_bytes_those_that_can_be_read_are_the_only_form(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
            if let Ok(block) = Block::from_bytes(Cell::of(&[0; 6]), 1, &bytes) {
                prop_assert_eq!(block.to_bytes(), bytes);
            }
        }
    }
}
