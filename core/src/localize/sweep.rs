//! Comparing one panorama with the photo at every heading: bit planes per class, a heading is an offset.

use crate::render::panorama::{PanoramaGrid, ROWS_PER_WORD};
use resurvey_schema::ClassId;
use resurvey_schema::service::{ClassCounts, ClassSet};
use std::ops::Range;

/// One bit plane per class over a panorama, stored twice over so that any heading is one contiguous slice.
#[derive(Clone, Debug)]
pub struct ClassPlanes {
    words: usize,
    planes: Vec<Vec<u64>>,
    /// Cells whose class takes part in the comparison.
    compared: Vec<u64>,
}

impl ClassPlanes {
    /// Planes for `classes` classes over `grid`.
    pub fn new(grid: &PanoramaGrid, classes: usize) -> Self {
        let words = grid.words();
        let length = 2 * grid.columns() * words;
        Self { words, planes: vec![vec![0; length]; classes], compared: vec![0; length] }
    }

    /// Sets the cells of one column to `classes`, lowest row first; void, `ignored` and unknown classes take no part.
    pub fn fill_column(&mut self, column: usize, classes: &[u8], ignored: &ClassSet) {
        let half = self.compared.len() / 2;
        for (word, classes) in classes.chunks(ROWS_PER_WORD).enumerate() {
            let index = column * self.words + word;
            self.planes.iter_mut().for_each(|plane| plane[index] = 0);
            self.compared[index] = 0;
            let mut bit = 0;
            for run in classes.chunk_by(|a, b| a == b) {
                let bits = (u64::MAX >> (ROWS_PER_WORD - run.len())) << bit;
                bit += run.len();
                if usize::from(run[0]) < self.planes.len() && !ignored.contains(ClassId(run[0])) {
                    self.planes[usize::from(run[0])][index] |= bits;
                    self.compared[index] |= bits;
                }
            }
            self.compared[half + index] = self.compared[index];
            self.planes.iter_mut().for_each(|plane| plane[half + index] = plane[index]);
        }
    }
}

/// The photo over a panorama grid as if its heading were grid north.
#[derive(Clone, Debug)]
pub struct PanoramaPhoto {
    planes: ClassPlanes,
    columns: usize,
    /// Columns that the photo sees, relative to its heading; may start below zero.
    seen: Range<isize>,
    /// Classes that occur in the photo.
    present: Vec<bool>,
}

impl PanoramaPhoto {
    /// The photo over `grid`; `class_at` gives the photo's class in a cell of the panorama centred on its heading, `None`
    /// outside the image.
    pub fn new(
        grid: &PanoramaGrid,
        classes: usize,
        ignored: &ClassSet,
        class_at: impl Fn(usize, usize) -> Option<u8>,
    ) -> Self {
        let mut planes = ClassPlanes::new(grid, classes);
        for column in 0..grid.columns() {
            let classes: Vec<u8> =
                (0..grid.rows()).map(|row| class_at(column, row).unwrap_or(ClassId::VOID.0)).collect();
            planes.fill_column(column, &classes, ignored);
        }
        let columns = grid.columns();
        let words = planes.words;
        let seen_at = |column: isize| {
            let index = column.rem_euclid(columns as isize) as usize * words;
            planes.compared[index..index + words].iter().any(|&word| word != 0)
        };
        let half = columns as isize / 2;
        let first = (-half..columns as isize - half).find(|&column| seen_at(column)).unwrap_or(0);
        let end = (-half..columns as isize - half).rev().find(|&column| seen_at(column)).map_or(first, |last| last + 1);
        let present = planes.planes.iter().map(|plane| plane.iter().any(|&word| word != 0)).collect();
        Self { planes, columns, seen: first..end, present }
    }

    /// The columns of a view that take part at the headings from column `first` on, every `step`, `count` in all.
    pub fn wanted(&self, first: i64, step: u32, count: u32) -> Vec<bool> {
        let mut wanted = vec![false; self.columns];
        for heading in 0..i64::from(count) {
            for column in self.seen.clone() {
                let column = first + heading * i64::from(step) + column as i64;
                wanted[column.rem_euclid(self.columns as i64) as usize] = true;
            }
        }
        wanted
    }

    /// Counts per class against `view` at the heading of column `heading`; boundary counts stay zero.
    pub fn counts(&self, view: &ClassPlanes, heading: i64, counts: &mut [ClassCounts]) {
        let words = self.planes.words;
        let wrapped = |column: i64| column.rem_euclid(self.columns as i64) as usize * words;
        let length = self.seen.len() * words;
        let (photo_from, view_from) = (wrapped(self.seen.start as i64), wrapped(self.seen.start as i64 + heading));
        let photo_compared = &self.planes.compared[photo_from..photo_from + length];
        let view_compared = &view.compared[view_from..view_from + length];
        for (class, count) in counts.iter_mut().enumerate() {
            let seen = &view.planes[class][view_from..view_from + length];
            count.view = common(seen, photo_compared);
            if self.present[class] {
                let labelled = &self.planes.planes[class][photo_from..photo_from + length];
                count.photo = common(labelled, view_compared);
                count.both = common(labelled, seen);
            }
        }
    }
}

fn common(a: &[u64], b: &[u64]) -> u32 {
    a.iter().zip(b).map(|(a, b)| (a & b).count_ones()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_is_a_shift_of_columns() {
        let grid = PanoramaGrid::new(8, 1, -1.0, 1.0);
        // The photo sees three columns: class 0, 1, 1 around its heading; below row 32 nothing.
        let seen = |column: usize, row: usize| match column {
            7 if row >= 32 => Some(0),
            0 | 1 if row >= 32 => Some(1),
            _ => None,
        };
        let photo = PanoramaPhoto::new(&grid, 2, &ClassSet::default(), seen);
        let mut view = ClassPlanes::new(&grid, 2);
        for column in 0..8 {
            let class = u8::from(matches!(column, 4 | 5));
            view.fill_column(column, &[class; 64], &ClassSet::default());
        }
        let both = |heading: i64| {
            let mut counts = vec![ClassCounts::default(); 2];
            photo.counts(&view, heading, &mut counts);
            (counts[0].both, counts[1].both, counts[1].photo, counts[1].view)
        };
        assert_eq!(both(4), (32, 64, 64, 64), "heading of column 4: all agrees");
        assert_eq!(both(0), (32, 0, 64, 0), "heading north: the view has no class 1 there");
        assert_eq!(both(-4), both(4), "headings wrap");
        assert_eq!(photo.wanted(4, 1, 1), [false, false, false, true, true, true, false, false]);
    }

    #[test]
    fn void_and_ignored_cells_take_no_part() {
        let grid = PanoramaGrid::new(4, 1, -1.0, 1.0);
        let photo = PanoramaPhoto::new(&grid, 2, &ClassSet::default(), |_, row| Some(if row < 16 { 255 } else { 1 }));
        let mut ignored = ClassSet::default();
        ignored.insert(ClassId(0));
        let mut view = ClassPlanes::new(&grid, 2);
        for column in 0..4 {
            let classes: Vec<u8> = (0..64).map(|row| u8::from(row >= 32)).collect();
            view.fill_column(column, &classes, &ignored);
        }
        let mut counts = vec![ClassCounts::default(); 2];
        photo.counts(&view, 0, &mut counts);
        assert_eq!((counts[1].photo, counts[1].view, counts[1].both, counts[0].view), (4 * 32, 4 * 32, 4 * 32, 0));
    }
}
