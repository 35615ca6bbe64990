//! The layout of a panorama, and the part of it that is drawn.

use nalgebra::Vector3;

/// Rows in a word of a bit plane.
pub const ROWS_PER_WORD: usize = 64;

/// Columns worked on at once.
pub(super) const TOGETHER: usize = 8;

/// Layout of a panorama: cells of equal azimuth and equal tangent of elevation.
#[derive(Clone, Debug)]
pub struct PanoramaGrid {
    rows: usize,
    first_tangent: f64,
    tangent_step: f64,
    /// Sine and cosine of the azimuth of each column's centre, clockwise from grid north.
    columns: Vec<[f64; 2]>,
}

/// The shortest run of columns around the circle that holds all that are wanted.
#[derive(Clone, Debug)]
pub(super) struct Sector {
    pub(super) first: usize,
    pub(super) count: usize,
    /// Sine and cosine of the azimuths of its columns, with room for whole groups.
    pub(super) sin: Vec<f64>,
    pub(super) cos: Vec<f64>,
}

impl PanoramaGrid {
    /// A grid of `columns` over the full circle, the first centred on grid north, and 64·`words` rows whose centres lie
    /// evenly between the tangents `lowest` and `highest`; at least one of each.
    pub fn new(columns: u32, words: usize, lowest: f64, highest: f64) -> Self {
        let (rows, columns) = (words.max(1) * ROWS_PER_WORD, columns.max(1));
        let tangent_step = (highest - lowest) / rows as f64;
        let step_rad = std::f64::consts::TAU / f64::from(columns);
        let columns =
            (0..columns).map(|column| (f64::from(column) * step_rad).sin_cos()).map(|(s, c)| [s, c]).collect();
        Self { rows, first_tangent: lowest + tangent_step / 2.0, tangent_step, columns }
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns.len()
    }

    /// Number of rows, a multiple of 64; row 0 looks lowest.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Words of a bit plane per column.
    pub fn words(&self) -> usize {
        self.rows / ROWS_PER_WORD
    }

    /// Direction (E, N, H) of the cell at `column`, `row`, scaled to a horizontal length of one.
    pub fn direction(&self, column: usize, row: usize) -> Vector3<f64> {
        let [sin, cos] = self.columns[column];
        Vector3::new(sin, cos, self.tangent(row))
    }

    /// Tangent of the elevation at the centre of `row`.
    #[inline(always)]
    pub(super) fn tangent(&self, row: usize) -> f64 {
        self.first_tangent + row as f64 * self.tangent_step
    }

    /// Tangent of row 0 and from row to row.
    #[inline(always)]
    pub(super) fn tangents(&self) -> [f64; 2] {
        [self.first_tangent, self.tangent_step]
    }

    /// The sector of the columns that are `wanted`; all when there is one flag too few.
    pub(super) fn sector(&self, wanted: &[bool]) -> Sector {
        let columns = self.columns.len();
        let is_wanted = |column: usize| wanted.get(column % columns).copied().unwrap_or(true);
        // The longest run that is not wanted, twice around for those across grid north.
        let (mut longest, mut run) = (0..0, 0);
        for column in 0..2 * columns {
            run = if is_wanted(column) { 0 } else { run + 1 };
            if run > longest.len() && run <= columns {
                longest = column + 1 - run..column + 1;
            }
        }
        let (first, count) = (longest.end % columns, columns - longest.len());
        let padded = count.next_multiple_of(TOGETHER) + TOGETHER;
        let axis = |axis: usize| (0..padded).map(|slot| self.columns[(first + slot) % columns][axis]).collect();
        Sector { first, count, sin: axis(0), cos: axis(1) }
    }
}

impl Sector {
    /// Where `column` of `columns` is in the sector; `None` outside.
    pub(super) fn slot(&self, column: usize, columns: usize) -> Option<usize> {
        let slot = (column + columns - self.first) % columns;
        (slot < self.count).then_some(slot)
    }
}
