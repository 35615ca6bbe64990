//! The grid of candidate positions: its spacing, and one score per cell.

use std::collections::BTreeMap;

/// Positions nearer to each other than this along an axis are in one column or row, metres: no search is finer, and
/// sums of floats differ by far less.
const SAME_LINE_M: f64 = 1e-3;

/// Spacing where the positions do not tell, metres.
const LONE_SPACING_M: f64 = 1.0;

/// A square around a candidate position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cell {
    pub easting_m: f64,
    pub northing_m: f64,
    pub score: f64,
}

/// The cells of a search.
pub(super) struct Cells {
    cells: Vec<Cell>,
    spacing_m: f64,
}

impl Cells {
    /// The cells of `heat`, from south-west to north-east; of positions in one cell the best score counts, and scores are brought into 0–1.
    pub(super) fn new(heat: &[[f64; 3]]) -> Self {
        let spacing_m = match (spacing_m(heat, 0), spacing_m(heat, 1)) {
            (Some(east_m), Some(north_m)) => east_m.min(north_m),
            (east_m, north_m) => east_m.or(north_m).unwrap_or(LONE_SPACING_M),
        };
        let least = |axis: usize| heat.iter().map(|cell| cell[axis]).fold(f64::INFINITY, f64::min);
        let (west_m, south_m) = (least(0), least(1));
        let mut best: BTreeMap<(i64, i64), f64> = BTreeMap::new();
        for &[easting_m, northing_m, score] in heat {
            let index = |value: f64, least: f64| ((value - least) / spacing_m).round() as i64;
            let kept = best.entry((index(northing_m, south_m), index(easting_m, west_m))).or_insert(0.0);
            *kept = kept.max(score.clamp(0.0, 1.0));
        }
        let cell = |((row, column), score): ((i64, i64), f64)| Cell {
            easting_m: west_m + column as f64 * spacing_m,
            northing_m: south_m + row as f64 * spacing_m,
            score,
        };
        Self { cells: best.into_iter().map(cell).collect(), spacing_m }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Cell> {
        self.cells.iter()
    }

    pub(super) fn scores(&self) -> impl Iterator<Item = f64> {
        self.cells.iter().map(|cell| cell.score)
    }

    pub(super) fn len(&self) -> usize {
        self.cells.len()
    }

    pub(super) fn spacing_m(&self) -> f64 {
        self.spacing_m
    }
}

/// The median gap between neighbouring columns (axis 0) or rows (axis 1): buildings that take whole columns out do not
/// change it. `None` for fewer than two columns.
fn spacing_m(heat: &[[f64; 3]], axis: usize) -> Option<f64> {
    let mut lines: Vec<f64> = heat.iter().map(|cell| cell[axis]).collect();
    lines.sort_unstable_by(f64::total_cmp);
    let mut gaps: Vec<f64> =
        lines.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap_m| *gap_m > SAME_LINE_M).collect();
    gaps.sort_unstable_by(f64::total_cmp);
    gaps.get(gaps.len() / 2).copied()
}
