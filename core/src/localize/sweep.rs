//! Comparing one panorama with the photo at every heading: bit planes per class, a heading is an offset.

use crate::image::mask;
use crate::render::panorama::{PanoramaGrid, ROWS_PER_WORD};
use pulp::{Arch, Simd, WithSimd};
use resurvey_schema::ClassId;
use resurvey_schema::service::{ClassCounts, ClassSet};
use std::ops::Range;

/// One bit plane per class over a panorama, stored twice over so that any heading is one contiguous slice.
#[derive(Clone, Debug)]
pub struct ClassPlanes {
    arch: Arch,
    words: usize,
    planes: Vec<Vec<u64>>,
    /// Cells whose class takes part in the comparison.
    compared: Vec<u64>,
    /// Classes that occur.
    present: Vec<bool>,
    /// Whether every cell takes part.
    whole: bool,
    /// Classes of a column.
    column: Vec<u8>,
}

impl ClassPlanes {
    /// Planes for `classes` classes over `grid`.
    pub fn new(grid: &PanoramaGrid, classes: usize) -> Self {
        let words = grid.words();
        let length = 2 * grid.columns() * words;
        Self {
            arch: Arch::new(),
            words,
            planes: vec![vec![0; length]; classes],
            compared: vec![0; length],
            present: vec![false; classes],
            whole: false,
            column: vec![0; grid.rows()],
        }
    }

    /// Sets the cells of `columns` to what `classes` writes for each, lowest row first, and forgets which classes occur
    /// in others; void, `ignored` and unknown classes take no part.
    pub fn fill(&mut self, columns: &[usize], ignored: &ClassSet, mut classes: impl FnMut(usize, &mut [u8])) {
        self.present.fill(false);
        self.whole = true;
        for &column in columns {
            classes(column, &mut self.column);
            self.arch.dispatch(SetColumn { planes: self, column, ignored });
        }
    }
}

/// Sets the planes of one column.
struct SetColumn<'a> {
    planes: &'a mut ClassPlanes,
    column: usize,
    ignored: &'a ClassSet,
}

impl WithSimd for SetColumn<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { planes: ClassPlanes { words, planes, compared, present, whole, column: classes, .. }, .. } = self;
        let half = compared.len() / 2;
        for (word, classes) in classes.as_chunks::<ROWS_PER_WORD>().0.iter().enumerate() {
            let index = self.column * *words + word;
            for plane in planes.iter_mut() {
                (plane[index], plane[half + index]) = (0, 0);
            }
            let (mut left, mut taken) = (u64::MAX, 0);
            while left != 0 {
                let class = classes[left.trailing_zeros() as usize];
                let cells = mask(simd, classes, class);
                left &= !cells;
                if let Some(plane) = planes.get_mut(usize::from(class))
                    && !self.ignored.contains(ClassId(class))
                {
                    (plane[index], plane[half + index]) = (cells, cells);
                    present[usize::from(class)] = true;
                    taken |= cells;
                }
            }
            (compared[index], compared[half + index]) = (taken, taken);
            *whole &= taken == u64::MAX;
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
    /// Cells of each class.
    cells: Vec<u32>,
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
        let all: Vec<usize> = (0..grid.columns()).collect();
        planes.fill(&all, ignored, |column, classes| {
            for (row, class) in classes.iter_mut().enumerate() {
                *class = class_at(column, row).unwrap_or(ClassId::VOID.0);
            }
        });
        let columns = grid.columns();
        let words = planes.words;
        let seen_at = |column: isize| {
            let index = column.rem_euclid(columns as isize) as usize * words;
            planes.compared[index..index + words].iter().any(|&word| word != 0)
        };
        let half = columns as isize / 2;
        let first = (-half..columns as isize - half).find(|&column| seen_at(column)).unwrap_or(0);
        let end = (-half..columns as isize - half).rev().find(|&column| seen_at(column)).map_or(first, |last| last + 1);
        let once = columns * words;
        let cells =
            planes.planes.iter().map(|plane| plane[..once].iter().map(|word| word.count_ones()).sum()).collect();
        Self { planes, columns, seen: first..end, cells }
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

    /// Counts class by class against `view` at the headings from column `first` on, every `step`, as many as `counts`
    /// holds; boundary counts are zero.
    pub fn counts(&self, view: &ClassPlanes, first: i64, step: u32, counts: &mut [ClassCounts]) {
        view.arch.dispatch(Count { photo: self, view, first, step, counts });
    }
}

/// Counts at every heading.
struct Count<'a> {
    photo: &'a PanoramaPhoto,
    view: &'a ClassPlanes,
    first: i64,
    step: u32,
    counts: &'a mut [ClassCounts],
}

impl WithSimd for Count<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { photo: PanoramaPhoto { planes: photo, columns, seen, cells }, view, first, step, counts } = self;
        let wrapped = |column: i64| column.rem_euclid(*columns as i64) as usize * photo.words;
        let length = seen.len() * photo.words;
        let photo_from = wrapped(seen.start as i64);
        let photo_compared = &photo.compared[photo_from..photo_from + length];
        for (heading, counts) in counts.chunks_mut(cells.len().max(1)).enumerate() {
            let view_from = wrapped(seen.start as i64 + first + heading as i64 * i64::from(step));
            for (class, count) in counts.iter_mut().enumerate() {
                *count = ClassCounts::default();
                let labelled = &photo.planes[class][photo_from..photo_from + length];
                let seen = &view.planes[class][view_from..view_from + length];
                if view.present[class] && cells[class] > 0 {
                    [count.view, count.both] = common_with_each(seen, [photo_compared, labelled]);
                } else if view.present[class] {
                    count.view = common(seen, photo_compared);
                }
                count.photo = match cells[class] {
                    all if view.whole || all == 0 => all,
                    _ => common(labelled, &view.compared[view_from..view_from + length]),
                };
            }
        }
    }
}

#[inline(always)]
fn common(a: &[u64], b: &[u64]) -> u32 {
    let mut count = 0;
    for (a, b) in a.iter().zip(b) {
        count += u64::from((a & b).count_ones());
    }
    count as u32
}

#[inline(always)]
fn common_with_each(a: &[u64], [b, c]: [&[u64]; 2]) -> [u32; 2] {
    let (mut with_b, mut with_c) = (0, 0);
    for ((a, b), c) in a.iter().zip(b).zip(c) {
        with_b += u64::from((a & b).count_ones());
        with_c += u64::from((a & c).count_ones());
    }
    [with_b as u32, with_c as u32]
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
        view.fill(&[0, 1, 2, 3, 4, 5, 6, 7], &ClassSet::default(), |column, classes| {
            classes.fill(u8::from(matches!(column, 4 | 5)));
        });
        let both = |heading: i64| {
            let mut counts = vec![ClassCounts::default(); 2];
            photo.counts(&view, heading, 1, &mut counts);
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
        view.fill(&[0, 1, 2, 3], &ignored, |_, classes| {
            classes.iter_mut().enumerate().for_each(|(row, class)| *class = u8::from(row >= 32));
        });
        let mut counts = vec![ClassCounts::default(); 2];
        photo.counts(&view, 0, 1, &mut counts);
        assert_eq!((counts[1].photo, counts[1].view, counts[1].both, counts[0].view), (4 * 32, 4 * 32, 4 * 32, 0));
    }
}
