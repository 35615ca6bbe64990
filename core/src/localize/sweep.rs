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

    /// Sets every cell to the class that `class_of(column, row)` returns; `None`, void and `ignored` classes take no part.
    pub fn fill(
        &mut self,
        grid: &PanoramaGrid,
        ignored: &ClassSet,
        mut class_of: impl FnMut(usize, usize) -> Option<u8>,
    ) {
        let half = grid.columns() * self.words;
        for column in 0..grid.columns() {
            for word in 0..self.words {
                let index = column * self.words + word;
                self.planes.iter_mut().for_each(|plane| plane[index] = 0);
                let mut compared = 0;
                for bit in 0..ROWS_PER_WORD {
                    let Some(class) = class_of(column, word * ROWS_PER_WORD + bit) else { continue };
                    if usize::from(class) < self.planes.len() && !ignored.contains(ClassId(class)) {
                        self.planes[usize::from(class)][index] |= 1 << bit;
                        compared |= 1 << bit;
                    }
                }
                self.compared[index] = compared;
            }
        }
        for plane in self.planes.iter_mut().chain([&mut self.compared]) {
            let (first, second) = plane.split_at_mut(half);
            second.copy_from_slice(first);
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
        class_at: impl FnMut(usize, usize) -> Option<u8>,
    ) -> Self {
        let mut planes = ClassPlanes::new(grid, classes);
        planes.fill(grid, ignored, class_at);
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
