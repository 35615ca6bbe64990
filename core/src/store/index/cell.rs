//! Cells of the plan, in levels: a box belongs to one cell, the one of its lower left corner in the lowest level where
//! the cells are at least twice as wide as it is.

use super::origin::IndexBox;
use std::ops::RangeInclusive;

/// Width of a cell of level 0: 2^14 mm, 16 m. About twenty descriptors of a street are in it, as many as a query of 100 m
/// reads too many at its border.
const BITS_0: u32 = 14;
/// The cells of a level are 2^2 times as wide as those of the level below.
const BITS_PER_LEVEL: u32 = 2;
/// The one cell of the last level holds everything.
const LAST_LEVEL: i64 = 9;
/// Bits of a coordinate of a cell: 32 less those of level 0.
const COORDINATE_BITS: u32 = 18;
const MASK: i64 = (1 << COORDINATE_BITS) - 1;

/// A cell: level, row and column in one number, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Cell(i64);

impl Cell {
    /// The cell of a box.
    pub(super) fn of(ends: &IndexBox) -> Self {
        let [e0, e1, n0, n1, ..] = *ends;
        let width = (e1 - e0).max(n1 - n0);
        let level = (0..LAST_LEVEL).find(|&level| 2 * width <= 1 << bits(level)).unwrap_or(LAST_LEVEL);
        Self::at(level, column(level, n0), column(level, e0))
    }

    /// The cell of this number, which need not be one.
    pub(super) fn numbered(number: i64) -> Self {
        Self(number)
    }

    /// Its number.
    pub(super) fn number(self) -> i64 {
        self.0
    }

    /// Easting and northing of its lower left corner in the index.
    pub(super) fn corner(self) -> [i64; 2] {
        let bits = bits(self.level());
        [self.0 & MASK, self.0 >> COORDINATE_BITS & MASK].map(|step| (step << bits) + i64::from(i32::MIN))
    }

    /// The last cell that can hold boxes that meet `region`.
    pub(super) fn last_of(region: &IndexBox) -> Option<Self> {
        Self::at(LAST_LEVEL, MASK, MASK).down_to(region)
    }

    /// The last cell up to this one that can hold boxes that meet `region`.
    pub(super) fn down_to(self, region: &IndexBox) -> Option<Self> {
        // In a damaged map a number may be none of a cell; all cells come after it.
        if self.0 < 0 {
            return None;
        }
        let (mut row, mut last) = (self.0 >> COORDINATE_BITS & MASK, self.0 & MASK);
        for level in (0..=self.level().min(LAST_LEVEL)).rev() {
            let [columns, rows] = reach(level, region);
            if row >= *rows.start() && row <= *rows.end() && last < *columns.start() {
                (row, last) = (row - 1, MASK);
            }
            if row > *rows.end() {
                (row, last) = (*rows.end(), MASK);
            }
            if row >= *rows.start() {
                return Some(Self::at(level, row, last.min(*columns.end())));
            }
            (row, last) = (MASK, MASK);
        }
        None
    }

    /// The last cell before this one that can hold boxes that meet `region`.
    pub(super) fn before(self, region: &IndexBox) -> Option<Self> {
        if self.0 > 0 { Self(self.0 - 1).down_to(region) } else { None }
    }

    fn at(level: i64, row: i64, column: i64) -> Self {
        Self(level << (2 * COORDINATE_BITS) | row << COORDINATE_BITS | column)
    }

    fn level(self) -> i64 {
        (self.0 >> (2 * COORDINATE_BITS)).clamp(0, LAST_LEVEL)
    }
}

fn bits(level: i64) -> u32 {
    BITS_0 + BITS_PER_LEVEL * level as u32
}

/// Column of an easting in the index, or row of a northing.
fn column(level: i64, end: i64) -> i64 {
    (end - i64::from(i32::MIN)) >> bits(level)
}

/// Columns and rows of the cells of `level` that can hold boxes that meet `region`: a box is at most half as wide as its
/// cell, but for the last level, which has one cell.
fn reach(level: i64, region: &IndexBox) -> [RangeInclusive<i64>; 2] {
    let [e0, e1, n0, n1, ..] = *region;
    let before = 1 << (bits(level) - 1);
    [(e0, e1), (n0, n1)].map(|(low, high)| column(level, low - before).max(0)..=column(level, high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cells_of(region: &IndexBox) -> Vec<Cell> {
        std::iter::successors(Cell::last_of(region), |cell| cell.before(region)).collect()
    }

    #[test]
    fn a_box_is_in_the_cell_of_its_corner() {
        let cell = Cell::of(&[100_000, 103_000, -50_000, -49_998, 0, 0]);
        assert_eq!(cell.corner(), [98_304, -65_536]);
        // 10 m need the cells of 65.536 m.
        assert_eq!(Cell::of(&[100_000, 110_000, -50_000, -49_998, 0, 0]).corner(), [65_536, -65_536]);
        let whole = [i64::from(i32::MIN), i64::from(i32::MAX), 0, 0, 0, 0];
        assert_eq!(Cell::of(&whole).corner(), [i64::from(i32::MIN); 2]);
    }

    #[test]
    fn there_is_no_cell_before_a_number_below_all() {
        let whole = [i32::MIN, i32::MAX, i32::MIN, i32::MAX, 0, 0].map(i64::from);
        assert_eq!((Cell::numbered(-1).down_to(&whole), Cell::numbered(i64::MIN).down_to(&whole)), (None, None));
    }

    #[test]
    fn a_square_of_100_m_looks_into_few_cells() {
        // 7 or 8 each way in the lowest level, 3 in the next, and at most 2 each way in the eight above.
        let count = cells_of(&[1_000_000, 1_100_000, 1_000_000, 1_100_000, 0, 0]).len();
        assert!((49 + 9..=64 + 9 + 4 * 8).contains(&count), "{count}");
    }

    fn interval() -> impl Strategy<Value = (i64, i64)> {
        let end = || prop_oneof![any::<i32>(), -200_000..200_000, Just(i32::MIN), Just(i32::MAX)].prop_map(i64::from);
        let width = prop_oneof![Just(0_i64), 0..40_000_i64, any::<u32>().prop_map(i64::from)];
        (end(), width).prop_map(|(low, width)| (low, (low + width).min(i64::from(i32::MAX))))
    }

    proptest! {
        #[test]
        fn a_query_looks_into_the_cell_of_every_box_it_meets(
            (e0, e1) in interval(), (n0, n1) in interval(), (x0, x1) in interval(), (y0, y1) in interval(),
        ) {
            let (region, ends) = ([e0, e1, n0, n1, 0, 0], [x0, x1, y0, y1, 0, 0]);
            if e0 <= x1 && x0 <= e1 && n0 <= y1 && y0 <= n1 {
                let cell = Cell::of(&ends);
                prop_assert_eq!(cell.down_to(&region), Some(cell));
                let [e, n] = cell.corner();
                prop_assert!(e <= x0 && n <= y0);
            }
        }

        #[test]
        fn cells_fall_strictly((e0, e1) in interval(), (n0, n1) in interval(), start in any::<i64>()) {
            let region = [e0, e1, n0, n1, 0, 0];
            if let Some(cell) = Cell::numbered(start.abs()).down_to(&region) {
                prop_assert!(cell.number() <= start.abs());
                prop_assert_eq!(cell.down_to(&region), Some(cell));
                prop_assert!(cell.before(&region).is_none_or(|before| before < cell));
            }
        }
    }
}
