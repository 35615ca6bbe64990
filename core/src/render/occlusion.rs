//! What is already drawn hides (a two-level z-buffer after Greene, Kass & Miller 1993).

use super::band::{Band, LANES};

/// Sides of a tile, pixels.
pub(super) const TILE: usize = 8;
/// Tiles beside each other in a block of pixels.
const ABREAST: usize = LANES / TILE;

/// Inverse depths drawn are off by a few roundings to f32; a share far above that keeps answers certain.
pub(super) const CERTAIN: f32 = 1e-5;

/// The smallest inverse depth in each tile of a band, at the time it was taken.
#[derive(Clone, Debug, Default)]
pub(super) struct Occlusion {
    first_row: usize,
    /// Tiles of a row.
    columns: usize,
    /// Number of rows and columns of pixels.
    rows: usize,
    width: usize,
    farthest: Vec<f32>,
}

impl Occlusion {
    /// Forgets everything: nothing hides.
    pub(super) fn clear(&mut self) {
        self.farthest.clear();
    }

    /// Takes what is drawn so far.
    #[inline(always)]
    pub(super) fn take(&mut self, band: &Band) {
        (self.first_row, self.rows, self.width) = (band.first_row(), band.rows(), band.width());
        self.columns = band.width().div_ceil(LANES) * ABREAST;
        self.farthest.clear();
        for first in (0..band.rows()).step_by(TILE) {
            let last = (first + TILE).min(band.rows()) - 1;
            for block in 0..band.row(first).len() {
                let mut least = band.row(first)[block].inverse_depths;
                for row in first + 1..=last {
                    let here = &band.row(row)[block].inverse_depths;
                    for lane in 0..LANES {
                        least[lane] = smaller(here[lane], least[lane]);
                    }
                }
                for tile in 0..ABREAST {
                    let mut halves = [0.0; 4];
                    for lane in 0..4 {
                        halves[lane] = smaller(least[tile * TILE + lane], least[tile * TILE + lane + 4]);
                    }
                    self.farthest.push(smaller(smaller(halves[0], halves[2]), smaller(halves[1], halves[3])));
                }
            }
        }
    }

    /// The tiles that row `v` of the image is in; none before anything was taken.
    #[inline(always)]
    pub(super) fn tiles(&self, v: i32) -> Tiles<'_> {
        let row = tile(v - self.first_row as i32, self.rows.max(1));
        Tiles { farthest: self.farthest.get(row * self.columns..(row + 1) * self.columns).unwrap_or_default() }
    }

    /// Whether what lies between these columns and rows (of pixels of the image, first and end) and is no nearer than
    /// an inverse depth is behind what was taken, for certain.
    #[inline(always)]
    pub(super) fn hides(&self, columns: [i32; 2], rows: [i32; 2], nearest: f32) -> bool {
        if self.farthest.is_empty() {
            return false;
        }
        let nearest = nearest * (1.0 + CERTAIN);
        let start = self.first_row as i32;
        let (left, right) = (tile(columns[0], self.width), tile(columns[1] - 1, self.width));
        for row in tile(rows[0] - start, self.rows)..=tile(rows[1] - 1 - start, self.rows) {
            let mut hidden = true;
            for farthest in &self.farthest[row * self.columns + left..=row * self.columns + right.max(left)] {
                hidden &= *farthest > nearest;
            }
            if !hidden {
                return false;
            }
        }
        true
    }
}

/// A row of tiles.
pub(super) struct Tiles<'a> {
    farthest: &'a [f32],
}

impl Tiles<'_> {
    /// Whether what is no nearer than an inverse depth is behind all of a block of pixels, for certain.
    #[inline(always)]
    pub(super) fn hide(&self, block: usize, nearest: f32) -> bool {
        let nearest = nearest * (1.0 + CERTAIN);
        let mut hidden = self.farthest.len() >= (block + 1) * ABREAST;
        for farthest in self.farthest.iter().skip(block * ABREAST).take(ABREAST) {
            hidden &= *farthest > nearest;
        }
        hidden
    }
}

/// The tile of a pixel, or the nearest one.
#[inline(always)]
fn tile(pixel: i32, size: usize) -> usize {
    (pixel.max(0) as usize).min(size - 1) / TILE
}

#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
