//! The plan: the square of ground that is shown, north up, and its cells.

use super::HeatMap;
use super::canvas::{Area, Canvas, Point};
use super::cells::Cells;
use super::colours::{ABSENT, ABSENT_HATCH};
use super::scale::ScoreScale;
use resurvey_schema::GridPoint;

/// Least ground shown, metres across: a lone candidate is not blown up to fill the plan.
const LEAST_SIDE_M: f64 = 10.0;

/// How far a pose may be beyond the candidates, as a share of their extent, for the plan to grow to it.
const REACH: f64 = 0.25;

/// Ground beyond the outermost cell or pose, as a share of the extent.
const MARGIN: f64 = 0.03;

/// Distance between hatch lines, pixels.
const HATCH_PX: u32 = 8;

/// Where ground is on the picture.
pub(super) struct Plan {
    pub area: Area,
    centre: [f64; 2],
    pub px_per_m: f64,
}

impl Plan {
    /// The plan over all cells, and over the poses that are not far off them.
    pub(super) fn new(area: Area, cells: &Cells, input: &HeatMap<'_>) -> Self {
        let poses = [Some(&input.prior), Some(&input.estimate), input.truth.as_ref()].into_iter().flatten();
        let poses: Vec<GridPoint> = poses.map(|pose| pose.position).collect();
        let mut ground = Ground::around(input.estimate.position);
        if cells.len() == 0 {
            poses.iter().for_each(|position| ground.take_in(position.easting_m, position.northing_m, 0.0));
        } else {
            ground = Ground::NOTHING;
            let half_m = cells.spacing_m() / 2.0;
            cells.iter().for_each(|cell| ground.take_in(cell.easting_m, cell.northing_m, half_m));
        }
        ground.widen_to(LEAST_SIDE_M);
        let near = ground.grown(REACH);
        for position in poses.iter().filter(|position| near.holds(position)) {
            ground.take_in(position.easting_m, position.northing_m, 0.0);
        }
        let side_m = ground.side_m() * (1.0 + 2.0 * MARGIN);
        Self { area, centre: ground.centre(), px_per_m: area.width_px() / side_m }
    }

    /// Where easting and northing are on the picture.
    pub(super) fn at(&self, easting_m: f64, northing_m: f64) -> Point {
        let [x, y] = self.area.centre();
        [x + (easting_m - self.centre[0]) * self.px_per_m, y - (northing_m - self.centre[1]) * self.px_per_m]
    }

    /// Draws every cell in the colour of its score over the hatched ground without candidates.
    pub(super) fn draw_cells(&self, canvas: &mut Canvas, cells: &Cells, scale: &ScoreScale) {
        canvas.clip_to(self.area);
        hatch(canvas, self.area);
        let half_m = cells.spacing_m() / 2.0;
        // Cells smaller than a pixel share it: the better one is drawn later.
        let mut rising: Vec<_> = cells.iter().collect();
        rising.sort_by(|a, b| a.score.total_cmp(&b.score));
        for cell in rising {
            let low = self.at(cell.easting_m - half_m, cell.northing_m + half_m);
            let high = self.at(cell.easting_m + half_m, cell.northing_m - half_m);
            canvas.fill_rect(low, high, scale.colour(cell.score));
        }
        canvas.clip_to_all();
    }
}

/// Fills `area` as ground without candidates.
pub(super) fn hatch(canvas: &mut Canvas, area: Area) {
    let corner = |x: u32, y: u32| [f64::from(x), f64::from(y)];
    canvas.fill_rect(corner(area.left, area.top), corner(area.right, area.bottom), ABSENT);
    for row in area.top..area.bottom {
        let first = area.left + (HATCH_PX - (area.left + row) % HATCH_PX) % HATCH_PX;
        for column in (first..area.right).step_by(HATCH_PX as usize) {
            canvas.fill_rect(corner(column, row), corner(column + 1, row + 1), ABSENT_HATCH);
        }
    }
}

/// A rectangle of ground: west, south, east, north, metres.
#[derive(Clone, Copy)]
struct Ground {
    low: [f64; 2],
    high: [f64; 2],
}

impl Ground {
    const NOTHING: Self = Self { low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] };

    fn around(position: GridPoint) -> Self {
        let at = [position.easting_m, position.northing_m];
        Self { low: at, high: at }
    }

    fn take_in(&mut self, easting_m: f64, northing_m: f64, half_m: f64) {
        for (axis, value) in [easting_m, northing_m].into_iter().enumerate() {
            self.low[axis] = self.low[axis].min(value - half_m);
            self.high[axis] = self.high[axis].max(value + half_m);
        }
    }

    fn widen_to(&mut self, side_m: f64) {
        let centre = self.centre();
        self.take_in(centre[0], centre[1], side_m / 2.0);
    }

    fn grown(mut self, share: f64) -> Self {
        let by_m = self.side_m() * share;
        self.low = self.low.map(|value| value - by_m);
        self.high = self.high.map(|value| value + by_m);
        self
    }

    fn holds(&self, position: &GridPoint) -> bool {
        (self.low[0]..=self.high[0]).contains(&position.easting_m)
            && (self.low[1]..=self.high[1]).contains(&position.northing_m)
    }

    fn centre(&self) -> [f64; 2] {
        [(self.low[0] + self.high[0]) / 2.0, (self.low[1] + self.high[1]) / 2.0]
    }

    fn side_m(&self) -> f64 {
        (self.high[0] - self.low[0]).max(self.high[1] - self.low[1])
    }
}
