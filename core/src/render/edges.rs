//! The half planes whose intersection a triangle covers, a few rows at a time.

/// Rows worked on at once.
pub(super) const ROWS: usize = 8;
/// Bounds on a row that a triangle has at most: three edges and the near plane.
const MOST: usize = 4;

/// Half planes of (u, v), sorted into bounds on u from either side and bounds on v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges {
    /// Bounds on u as slope · v + constant: those from the left from the front, those from the right from the back.
    lines: [(f64, f64); MOST],
    left: u8,
    right: u8,
    width: f64,
    /// Bounds on v of edges that run along rows: first inside, first outside.
    top: f64,
    bottom: f64,
}

/// Columns `first..end` of some rows whose centres are covered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Columns {
    pub(super) first: [i32; ROWS],
    pub(super) end: [i32; ROWS],
}

impl Edges {
    /// The whole of an image `width` pixels wide.
    #[inline(always)]
    pub(super) fn new(width: f64) -> Self {
        // Two bounds a side are the rule, and unused ones are the border of the image.
        let lines = [(0.0, 0.0), (0.0, 0.0), (0.0, width), (0.0, width)];
        Self { lines, left: 0, right: 0, width, top: f64::NEG_INFINITY, bottom: f64::INFINITY }
    }

    /// Keeps the pixels whose centre gives `form` · (u, v, 1) > 0, and of those with 0 the ones on a top or left edge;
    /// `line` is (−y/x, −z/x) of the form.
    #[inline(always)]
    pub(super) fn add(&mut self, [x, y, z]: [f64; 3], line: (f64, f64)) {
        if x > 0.0 {
            self.lines[usize::from(self.left) % MOST] = line;
            self.left += 1;
        } else if x < 0.0 {
            self.lines[(MOST - 1 - usize::from(self.right)) % MOST] = line;
            self.right += 1;
        } else if y > 0.0 {
            self.top = larger(self.top, -z / y);
        } else if y < 0.0 {
            self.bottom = smaller(self.bottom, -z / y);
        } else if z <= 0.0 {
            self.bottom = f64::NEG_INFINITY;
        }
    }

    /// Columns of the rows from `first_row` on.
    #[inline(always)]
    pub(super) fn columns(&self, first_row: i32) -> Columns {
        let mut columns = Columns { first: [0; ROWS], end: [0; ROWS] };
        let (mut lefts, mut rights) = ([0.0; ROWS], [0.0; ROWS]);
        let first_y = f64::from(first_row) + 0.5;
        if self.left <= 2 && self.right <= 2 {
            let [a, b, c, d] = self.lines;
            for row in 0..ROWS {
                let y = first_y + row as f64;
                lefts[row] = larger(at(a, y), at(b, y));
                rights[row] = smaller(at(c, y), at(d, y));
            }
        } else {
            for row in 0..ROWS {
                let y = first_y + row as f64;
                let (left, right) = (usize::from(self.left), MOST - usize::from(self.right));
                lefts[row] = self.lines[..left].iter().fold(0.0, |most, line| larger(most, at(*line, y)));
                rights[row] = self.lines[right..].iter().fold(self.width, |least, line| smaller(least, at(*line, y)));
            }
        }
        for row in 0..ROWS {
            let y = first_y + row as f64;
            let covered = (y >= self.top) & (y < self.bottom);
            columns.first[row] = first_centre(lefts[row], self.width);
            columns.end[row] = if covered { first_centre(rights[row], self.width) } else { 0 };
        }
        columns
    }
}

#[inline(always)]
fn at((slope, constant): (f64, f64), y: f64) -> f64 {
    slope * y + constant
}

/// Index of the first pixel whose centre is not before `position`, 0…`size`; 0 for NaN.
#[inline(always)]
pub(super) fn first_centre(position: f64, size: f64) -> i32 {
    /// From here on floats are whole numbers, which are then in their low bits.
    const WHOLE: f64 = (1_u64 << 52) as f64;
    let position = smaller(larger(position, 0.0), size);
    let nearest = (position + WHOLE) - WHOLE;
    // The nearest whole number is the right one, but half-way between two it may be the upper.
    let first = nearest - if nearest - position >= 0.5 { 1.0 } else { 0.0 };
    (first + WHOLE).to_bits() as i32
}

// `f64::max` and `f64::min` take a detour for NaN, which cannot change a result here.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::first_centre;

    #[test]
    fn a_pixel_belongs_to_the_right_of_a_position_from_its_centre_on() {
        for (position, first) in [
            (-3.0, 0),
            (0.0, 0),
            (0.5, 0),
            (0.500_001, 1),
            (1.5, 1),
            (1.500_001, 2),
            (2.5, 2),
            (7.2, 7),
            (9.9, 10),
            (99.0, 10),
            (f64::NAN, 0),
        ] {
            assert_eq!(first_centre(position, 10.0), first, "{position}");
        }
    }
}
