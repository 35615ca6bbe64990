//! From boxes in the map frame to the 32-bit millimetres of the index, and the order in which rows are written.

use crate::store::error::Fault;
use crate::store::rows::read_box;
use crate::version::BoxMm;
use rusqlite::{Connection, OptionalExtension, named_params};

/// What is subtracted from eastings and northings so that they fit in 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::store) struct IndexOrigin {
    e0: i64,
    n0: i64,
}

/// Ends in the index: easting, northing, height, lower then upper each.
pub(in crate::store) type IndexBox = [i64; 6];

impl IndexOrigin {
    /// The origin of this map; `None` before its first feature.
    pub(in crate::store) fn read(connection: &Connection) -> Result<Option<Self>, Fault> {
        const SQL: &str = "SELECT index_e0, index_n0 FROM meta WHERE index_e0 IS NOT NULL ORDER BY only_row";
        let mut statement = connection.prepare_cached(SQL)?;
        Ok(statement.query_row([], |row| Ok(Self { e0: row.get(0)?, n0: row.get(1)? })).optional()?)
    }

    /// Zero where `envelope` fits around it, else the whole kilometre nearest its middle.
    pub(in crate::store) fn choose(envelope: &BoxMm) -> Self {
        let zero = Self { e0: 0, n0: 0 };
        if zero.to_index(envelope).is_some() {
            return zero;
        }
        const KILOMETRE: i64 = 1_000_000;
        let middle = |axis: usize| (envelope.min()[axis] + envelope.max()[axis]) / 2 / KILOMETRE * KILOMETRE;
        Self { e0: middle(0), n0: middle(1) }
    }

    /// The origin that was chosen for the first features of this map; `None` where it never had any.
    pub(in crate::store) fn first(connection: &Connection) -> Result<Option<Self>, Fault> {
        const SQL: &str = "SELECT e0, e1, n0, n1, h0, h1 FROM version WHERE e0 IS NOT NULL ORDER BY version LIMIT 1";
        let mut statement = connection.prepare(SQL)?;
        let mut rows = statement.query([])?;
        let envelope = rows.next()?.map_or(Ok(None), read_box)?;
        Ok(envelope.as_ref().map(Self::choose))
    }

    /// Writes it down.
    pub(in crate::store) fn write(&self, connection: &Connection) -> Result<(), Fault> {
        const SQL: &str = "UPDATE meta SET index_e0 = :e0, index_n0 = :n0";
        connection.execute(SQL, named_params! {":e0": self.e0, ":n0": self.n0})?;
        Ok(())
    }

    /// `bounds` in the index; `None` when an end does not fit in 32 bits.
    pub(in crate::store) fn to_index(self, bounds: &BoxMm) -> Option<IndexBox> {
        let ends = self.shift(bounds);
        ends.iter().all(|&end| i32::try_from(end).is_ok()).then_some(ends)
    }

    /// The part of `region` that the index can hold; `None` when there is none.
    pub(in crate::store) fn clamp(self, region: &BoxMm) -> Option<IndexBox> {
        let (low, high) = (i64::from(i32::MIN), i64::from(i32::MAX));
        let ends = self.shift(region);
        let reaches = (0..3).all(|axis| ends[2 * axis] <= high && ends[2 * axis + 1] >= low);
        reaches.then(|| ends.map(|end| end.clamp(low, high)))
    }

    /// The box whose ends in the index are `ends`.
    pub(in crate::store) fn box_at(self, ends: &IndexBox) -> Option<BoxMm> {
        let [e0, e1, n0, n1, h0, h1] = *ends;
        let (e, n) = (|end: i64| end.saturating_add(self.e0), |end: i64| end.saturating_add(self.n0));
        BoxMm::from_mm([e(e0), n(n0), h0], [e(e1), n(n1), h1])
    }

    fn shift(self, bounds: &BoxMm) -> IndexBox {
        let ([e0, n0, h0], [e1, n1, h1]) = (bounds.min(), bounds.max());
        // An origin that nobody chose, in a damaged map, may be anywhere; what is clipped there fits into no index.
        let (e, n) = (|end: i64| end.saturating_sub(self.e0), |end: i64| end.saturating_sub(self.n0));
        [e(e0), e(e1), n(n0), n(n1), h0, h1]
    }
}

/// Position of the middle of `ends` along a Hilbert curve over the plan: neighbours on the map become neighbours in
/// the file (Warren, Hacker's Delight, 16-4).
pub(in crate::store) fn hilbert_key(ends: &IndexBox) -> u64 {
    let middle = |axis: usize| (((ends[2 * axis] + ends[2 * axis + 1]) / 2) - i64::from(i32::MIN)) as u32;
    let (mut x, mut y) = (middle(0), middle(1));
    let mut key = 0;
    for bit in (0..32).rev() {
        let (right, up) = (x >> bit & 1, y >> bit & 1);
        key = key << 2 | u64::from((3 * right) ^ up);
        if up == 0 {
            if right == 1 {
                (x, y) = (!x, !y);
            }
            (x, y) = (y, x);
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_far_from_the_origin_still_fits() {
        // Swiss LV95 eastings, about 2 600 km, are beyond 32 bits of millimetres.
        let bern =
            BoxMm::from_mm([2_600_000_123, 1_200_000_456, 540_000], [2_600_001_000, 1_200_001_000, 550_000]).unwrap();
        assert_eq!(IndexOrigin { e0: 0, n0: 0 }.to_index(&bern), None);
        let origin = IndexOrigin::choose(&bern);
        assert_eq!(origin, IndexOrigin { e0: 2_600_000_000, n0: 1_200_000_000 });
        assert_eq!(origin.to_index(&bern), Some([123, 1000, 456, 1000, 540_000, 550_000]));
    }

    #[test]
    fn a_region_beyond_the_index_reaches_nothing_of_it() {
        let origin = IndexOrigin { e0: 0, n0: 0 };
        let beyond = BoxMm::from_mm([1 << 31, 0, 0], [1 << 32, 1, 1]).unwrap();
        assert_eq!(origin.clamp(&beyond), None);
        let across = BoxMm::from_mm([5, 0, 0], [1 << 32, 1, 1]).unwrap();
        assert_eq!(origin.clamp(&across), Some([5, i64::from(i32::MAX), 0, 1, 0, 1]));
    }

    #[test]
    fn the_curve_visits_each_cell_once_and_steps_to_a_neighbour() {
        let start = i64::from(i32::MIN);
        let mut cells: Vec<(u64, i64, i64)> = (0..256)
            .map(|cell| (cell % 16, cell / 16))
            .map(|(x, y)| (hilbert_key(&[start + x, start + x, start + y, start + y, 0, 0]), x, y))
            .collect();
        cells.sort_unstable();
        for (position, (key, ..)) in cells.iter().enumerate() {
            assert_eq!(*key, position as u64);
        }
        for pair in cells.windows(2) {
            assert_eq!((pair[0].1 - pair[1].1).abs() + (pair[0].2 - pair[1].2).abs(), 1);
        }
    }
}
