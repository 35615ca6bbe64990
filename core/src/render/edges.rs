//! The half planes whose intersection a triangle covers, row by row.

use nalgebra::Vector3;
use std::ops::Range;

/// Bounds on a row that a triangle has at most: three edges and the near plane.
const MOST: usize = 4;

/// Half planes of (u, v), sorted into bounds on u from either side and bounds on v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges {
    first_row: usize,
    end_row: usize,
    width: f64,
    left: Bounds,
    right: Bounds,
    /// Bounds on v of edges that run along rows: first inside, first outside.
    top: f64,
    bottom: f64,
}

/// Bounds on u as slope · v + constant.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    lines: [(f64, f64); MOST],
    count: usize,
}

impl Edges {
    /// The whole of `rows`, `width` pixels wide.
    pub(super) fn new(rows: Range<usize>, width: f64) -> Self {
        let none = |constant| Bounds { lines: [(0.0, constant); MOST], count: 0 };
        Self {
            first_row: rows.start,
            end_row: rows.end,
            width,
            left: none(0.0),
            right: none(width),
            top: f64::NEG_INFINITY,
            bottom: f64::INFINITY,
        }
    }

    /// Keeps the pixels whose centre gives `form` · (u, v, 1) > 0, and of those with 0 the ones on a top or left edge.
    pub(super) fn add(&mut self, form: Vector3<f64>) {
        let line = || (-form.y / form.x, -form.z / form.x);
        if form.x > 0.0 {
            self.left.add(line());
        } else if form.x < 0.0 {
            self.right.add(line());
        } else if form.y > 0.0 {
            self.top = larger(self.top, -form.z / form.y);
        } else if form.y < 0.0 {
            self.bottom = smaller(self.bottom, -form.z / form.y);
        } else if form.z <= 0.0 {
            self.bottom = f64::NEG_INFINITY;
        }
    }

    pub(super) fn rows(&self) -> Range<usize> {
        self.first_row..self.end_row
    }

    /// Columns `first..end` whose centres are covered in the row with centre `y`.
    #[inline]
    pub(super) fn columns(&self, y: f64) -> (usize, usize) {
        if y < self.top || y >= self.bottom {
            return (0, 0);
        }
        // Two bounds a side are the rule, and unused ones are the border of the image.
        let left = larger(self.left.at(0, y), self.left.at(1, y));
        let right = smaller(self.right.at(0, y), self.right.at(1, y));
        let left = (2..self.left.count).fold(left, |left, index| larger(left, self.left.at(index, y)));
        let right = (2..self.right.count).fold(right, |right, index| smaller(right, self.right.at(index, y)));
        (first_centre(left, self.width), first_centre(right, self.width))
    }
}

impl Bounds {
    fn add(&mut self, line: (f64, f64)) {
        if self.count < MOST {
            self.lines[self.count] = line;
            self.count += 1;
        }
    }

    fn at(&self, index: usize, y: f64) -> f64 {
        let (slope, constant) = self.lines[index];
        slope * y + constant
    }
}

/// Index of the first pixel whose centre is not before `position`, 0…`size`.
#[inline]
pub(super) fn first_centre(position: f64, size: f64) -> usize {
    // ceil(position − 0.5) without a call to ceil: truncation is floor for what is not negative.
    let from_end = size + 0.5 - smaller(larger(position, 0.0), size);
    (size as i32 - (from_end as i32).min(size as i32)) as usize
}

// `f64::max` and `f64::min` take a detour for NaN, which cannot change a result here.
#[inline]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
