//! Which cells of a panorama a box or a triangle can touch, and how near it can be: never too little.

use super::grid::{PanoramaGrid, Sector};
use crate::render::Bounds;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Columns are told apart to this angle; azimuths are known to 2·10⁻⁸.
const MARGIN_RAD: f64 = 1e-6;
/// Rows are told apart to this share of one.
const MARGIN_ROWS: f64 = 1e-6;

/// Cells between columns and rows (first and end, of the sector).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    /// A run of columns, and the rest of it where it goes on across the other end of the sector.
    pub(super) columns: [[i32; 2]; 2],
    pub(super) rows: [i32; 2],
    /// Nothing is nearer than this inverse of a horizontal distance, 1/m.
    pub(super) nearest: f32,
}

/// What turns azimuths and tangents into columns and rows of a sector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    columns: i32,
    count: i32,
    rows: f64,
    first_column: f64,
    columns_per_rad: f64,
    first_tangent: f64,
    rows_per_tangent: f64,
}

/// Offsets from the eye between which something lies.
#[derive(Clone, Copy, Debug)]
struct Extent {
    min: [f64; 3],
    max: [f64; 3],
}

impl Frame {
    pub(super) fn new(grid: &PanoramaGrid, sector: &Sector) -> Self {
        let [first_tangent, tangent_step] = grid.tangents();
        Self {
            columns: grid.columns() as i32,
            count: sector.count as i32,
            rows: grid.rows() as f64,
            first_column: sector.first as f64,
            columns_per_rad: grid.columns() as f64 / TAU,
            first_tangent,
            rows_per_tangent: 1.0 / tangent_step,
        }
    }

    /// What a box can touch; `None` when nothing.
    #[inline(always)]
    pub(super) fn of_box(&self, bounds: &Bounds, eye: [f64; 3]) -> Option<Reach> {
        let from_eye = |corner: [f32; 3]| [0, 1, 2].map(|axis| f64::from(corner[axis]) - eye[axis]);
        let extent = Extent { min: from_eye(bounds.min), max: from_eye(bounds.max) };
        let (rows, nearest) = self.rows(&extent)?;
        let columns = match extent.azimuths() {
            // Twice the margin of the triangles in it.
            Some(azimuths) => self.columns(azimuths, 2.0 * MARGIN_RAD)?,
            None => [[0, self.count], [0, 0]],
        };
        Some(Reach { columns, rows, nearest })
    }

    /// What a triangle, given by its corners' offsets from the eye, can touch; `None` when nothing.
    #[inline(always)]
    pub(super) fn of_triangle(&self, corners: &[[f64; 3]; 3]) -> Option<Reach> {
        let [a, b, c] = *corners;
        let min = [0, 1, 2].map(|axis| smaller(smaller(a[axis], b[axis]), c[axis]));
        let max = [0, 1, 2].map(|axis| larger(larger(a[axis], b[axis]), c[axis]));
        let (rows, nearest) = self.rows(&Extent { min, max })?;
        let first = azimuth(a[0], a[1]);
        let turned = |corner: [f64; 3]| {
            let turned = azimuth(corner[0], corner[1]) - first;
            if turned >= PI {
                turned - TAU
            } else if turned < -PI {
                turned + TAU
            } else {
                turned
            }
        };
        let (to_b, to_c) = (turned(b), turned(c));
        let (low, high) = (smaller(smaller(to_b, to_c), 0.0), larger(larger(to_b, to_c), 0.0));
        // Around the eye, or so near it that the margin might be too small.
        let columns = if high - low > PI - 1e-3 || nearest > 1e3 {
            [[0, self.count], [0, 0]]
        } else {
            self.columns([first + low, first + high], MARGIN_RAD)?
        };
        Some(Reach { columns, rows, nearest })
    }

    /// The rows of what lies in `extent`, and how near it can be. All of it is monotonic, roundings included: what lies
    /// within has no row more and is no nearer.
    #[inline(always)]
    fn rows(&self, Extent { min, max }: &Extent) -> Option<([i32; 2], f32)> {
        let least = [0, 1].map(|axis| larger(larger(min[axis], -max[axis]), 0.0));
        let most = [0, 1].map(|axis| larger(-min[axis], max[axis]));
        let near_m = (least[0] * least[0] + least[1] * least[1]).sqrt();
        let far_m = (most[0] * most[0] + most[1] * most[1]).sqrt();
        let low = if min[2] < 0.0 { min[2] / near_m } else { min[2] / far_m };
        let high = if max[2] > 0.0 { max[2] / near_m } else { max[2] / far_m };
        let first = ((low - self.first_tangent) * self.rows_per_tangent - MARGIN_ROWS).ceil();
        let end = ((high - self.first_tangent) * self.rows_per_tangent + MARGIN_ROWS).floor() + 1.0;
        let rows = [first, end].map(|row| smaller(larger(row, 0.0), self.rows) as i32);
        (rows[0] < rows[1]).then_some((rows, (1.0 / near_m) as f32))
    }

    /// Columns of the sector between two azimuths, the second beyond the first.
    #[inline(always)]
    fn columns(&self, azimuths: [f64; 2], margin_rad: f64) -> Option<[[i32; 2]; 2]> {
        let first = ((azimuths[0] - margin_rad) * self.columns_per_rad - self.first_column).ceil() as i32;
        let end = ((azimuths[1] + margin_rad) * self.columns_per_rad - self.first_column).floor() as i32 + 1;
        let length = end - first;
        if length <= 0 {
            return None;
        }
        if length >= self.columns {
            return Some([[0, self.count], [0, 0]]);
        }
        let first = first.rem_euclid(self.columns);
        let run = [first.min(self.count), (first + length).min(self.count)];
        let rest = [0, (first + length - self.columns).clamp(0, self.count)];
        (run[0] < run[1] || rest[1] > 0).then_some([run, rest])
    }
}

impl Extent {
    /// Least and largest azimuth in plan; `None` when it is around the eye.
    #[inline(always)]
    fn azimuths(&self) -> Option<[f64; 2]> {
        let ([west, south, _], [east, north, _]) = (self.min, self.max);
        let (low, high) = if south > 0.0 {
            ([west, if west > 0.0 { north } else { south }], [east, if east > 0.0 { south } else { north }])
        } else if north < 0.0 {
            ([east, if east > 0.0 { north } else { south }], [west, if west > 0.0 { south } else { north }])
        } else if west > 0.0 {
            ([west, north], [west, south])
        } else if east < 0.0 {
            ([east, south], [east, north])
        } else {
            return None;
        };
        let (low, high) = (azimuth(low[0], low[1]), azimuth(high[0], high[1]));
        Some([low, if high < low { high + TAU } else { high }])
    }
}

/// Angle clockwise from north, −π…π, to 2·10⁻⁸: Abramowitz & Stegun, 4.4.49.
#[inline(always)]
fn azimuth(east: f64, north: f64) -> f64 {
    let (x, y) = (east.abs(), north.abs());
    let (least, most) = (smaller(x, y), larger(x, y));
    let ratio = if most > 0.0 { least / most } else { 0.0 };
    let square = ratio * ratio;
    let mut sum = 0.002_866_225_7;
    for term in [
        -0.016_165_736_7,
        0.042_909_613_8,
        -0.075_289_640_0,
        0.106_562_639_3,
        -0.142_088_994_4,
        0.199_935_508_5,
        -0.333_331_452_8,
        1.0,
    ] {
        sum = sum * square + term;
    }
    let acute = ratio * sum;
    let from_axis = if x > y { FRAC_PI_2 - acute } else { acute };
    let right = if north < 0.0 { PI - from_axis } else { from_axis };
    if east < 0.0 { -right } else { right }
}

#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuths_are_those_of_the_arc_tangent() {
        for step in -3600..=3600 {
            let angle = f64::from(step) * PI / 3600.0;
            let off = azimuth(7.0 * angle.sin(), 7.0 * angle.cos()) - angle;
            assert!(off.abs() < 3e-8 || (off.abs() - TAU).abs() < 3e-8, "{step}: off by {off} rad");
        }
    }
}
