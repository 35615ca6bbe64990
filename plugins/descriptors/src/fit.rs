//! The rectangle on a plane that a contour shows: all four sides at once, by least squares with Cauchy weights, each point
//! as far off as the labels' jitter is where it lies.

use crate::quad::{CORRELATION_PX, median};
use crate::rectangle::Corners;
use nalgebra::{Matrix2, Matrix5, Rotation2, Vector2, Vector5};

/// Rounds of assigning points to sides and improving all of them.
const ROUNDS: usize = 15;
/// Share of a side next to a corner that is left out: jitter rounds corners off.
const CORNER_SHARE: f64 = 0.08;
/// Residual, over the robust 1σ, at which a point counts half.
const HALF_WEIGHT: f64 = 2.0;
/// Contour points a pixel of length: 1 along rows and columns, √2 across them.
const POINTS_PER_PX: f64 = 1.2;
/// Fewest points of a side.
const MIN_POINTS: usize = 4;
/// Largest turn in one round, radians.
const MAX_TURN_RAD: f64 = 0.1;
/// Pieces into which a side is cut to see how much of it is visible.
const PIECES: usize = 24;
/// Share of normally distributed values within 1σ.
const WITHIN_ONE_SIGMA: f64 = 0.68;

/// A contour point on the plane.
#[derive(Clone, Copy, Debug)]
pub struct EdgePoint {
    /// Where it is, metres.
    pub at: Vector2<f64>,
    /// How it moves, metres, with steps of one pixel to the right and down.
    pub metres_per_px: Matrix2<f64>,
}

/// A rectangle: offsets of its sides in a frame turned by its tilt.
#[derive(Clone, Copy, Debug)]
pub struct Sides {
    /// Angle by which the bottom rises to the right, radians.
    pub tilt_rad: f64,
    /// Left and right, bottom and top, metres.
    pub offsets_m: [f64; 4],
}

/// A rectangle fitted, and how well.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The rectangle.
    pub sides: Sides,
    /// Robust 1σ of all points' distances from it over that of the labels' jitter.
    pub misfit: f64,
    /// Covariance of the offsets and the tilt.
    pub covariance: Matrix5<f64>,
    /// Share of each side along which points lie.
    pub visible: [f64; 4],
    cost: f64,
}

impl Sides {
    /// The rectangle whose sides go through the middles of those of `corners`, tilted by `tilt_rad`.
    pub fn through(corners: &Corners, tilt_rad: f64) -> Self {
        let turn = Rotation2::new(-tilt_rad);
        let [bl, br, tr, tl] = corners.map(|corner| turn * corner);
        let offsets_m = [bl.x + tl.x, br.x + tr.x, bl.y + br.y, tl.y + tr.y].map(|twice| twice / 2.0);
        Self { tilt_rad, offsets_m }
    }

    /// The level box that leaves out `share` of `points` beyond each side; `None` of no points.
    pub fn around(points: &[EdgePoint], share: f64) -> Option<Self> {
        let at = |axis: usize, share: f64| {
            let mut values: Vec<f64> = points.iter().map(|point| point.at[axis]).collect();
            values.sort_by(f64::total_cmp);
            values.get((values.len().saturating_sub(1) as f64 * share).round() as usize).copied()
        };
        let offsets_m = [at(0, share)?, at(0, 1.0 - share)?, at(1, share)?, at(1, 1.0 - share)?];
        Some(Self { tilt_rad: 0.0, offsets_m })
    }

    /// Its corners.
    pub fn corners(&self) -> Corners {
        let [left, right, bottom, top] = self.offsets_m;
        let turn = Rotation2::new(self.tilt_rad);
        [[left, bottom], [right, bottom], [right, top], [left, top]].map(|corner| turn * Vector2::from(corner))
    }

    /// Width and height, metres.
    pub fn size_m(&self) -> [f64; 2] {
        let [left, right, bottom, top] = self.offsets_m;
        [right - left, top - bottom]
    }

    /// The side nearest to `point`, seen with the labels' jitter.
    fn nearest(&self, point: &EdgePoint, jitter_px: f64) -> Nearest {
        let turn = Rotation2::new(-self.tilt_rad);
        let (at, step) = (turn * point.at, turn.matrix() * point.metres_per_px);
        let [width_m, height_m] = self.size_m();
        let of_side = |side: usize| {
            let across = side / 2;
            let size_m = if across == 0 { height_m } else { width_m };
            let part = (at[1 - across] - self.offsets_m[2 - 2 * across]) / size_m;
            let off_m = at[across] - self.offsets_m[side];
            let beyond_m = (part - part.clamp(0.0, 1.0)) * size_m;
            let sigma_m = (step.row(across).norm() * jitter_px).max(1e-6);
            let along_px = size_m / step.row(1 - across).norm().max(1e-9);
            let turned_m = if across == 0 { at.y } else { -at.x };
            Nearest { side, part, off_m, sigma_m, along_px, turned_m, distance: off_m.hypot(beyond_m) / sigma_m }
        };
        let [a, b, c, d] = [0, 1, 2, 3].map(of_side);
        [b, c, d].into_iter().fold(a, |best, other| if other.distance < best.distance { other } else { best })
    }
}

/// Where a point lies beside its nearest side.
#[derive(Clone, Copy)]
struct Nearest {
    side: usize,
    /// Place along the side, 0 to 1.
    part: f64,
    /// Distance from the side's line, metres, to the right or up.
    off_m: f64,
    /// 1σ of that by the labels' jitter.
    sigma_m: f64,
    /// Length of the side as seen there, pixels.
    along_px: f64,
    /// Change of `off_m` with the tilt, metres a radian.
    turned_m: f64,
    /// Distance from the side itself over its 1σ.
    distance: f64,
}

/// The best of the rectangles to which `starts` lead; `None` when a side has no points. The tilt stays that of the start
/// when `is_level`.
pub fn best(points: &[EdgePoint], starts: &[Sides], jitter_px: f64, is_level: bool) -> Option<Fit> {
    let fits = starts.iter().filter_map(|start| fit(points, *start, jitter_px, is_level));
    fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

fn fit(points: &[EdgePoint], start: Sides, jitter_px: f64, is_level: bool) -> Option<Fit> {
    let mut sides = start;
    let mut information = Matrix5::zeros();
    for _ in 0..ROUNDS {
        let nearest: Vec<Nearest> = points.iter().map(|point| sides.nearest(point, jitter_px)).collect();
        let beside = |near: &&Nearest| (CORNER_SHARE..=1.0 - CORNER_SHARE).contains(&near.part);
        let used: Vec<&Nearest> = nearest.iter().filter(beside).collect();
        if (0..4).any(|side| used.iter().filter(|near| near.side == side).count() < MIN_POINTS) {
            return None;
        }
        let scale = robust_sigma(&used.iter().map(|near| near.distance).collect::<Vec<_>>()).max(0.3);
        information = Matrix5::zeros();
        let mut gradient = Vector5::zeros();
        for near in used {
            let weight = 1.0 / (1.0 + (near.distance / (HALF_WEIGHT * scale)).powi(2)) / near.sigma_m.powi(2);
            let mut slope = Vector5::zeros();
            slope[near.side] = -1.0;
            slope[4] = if is_level { 0.0 } else { near.turned_m };
            information += slope * slope.transpose() * weight;
            gradient -= slope * (near.off_m * weight);
        }
        if is_level {
            information[(4, 4)] = 1.0;
        }
        let step = information.cholesky()?.solve(&gradient);
        // Turned about the plane's origin, offsets follow the tilt: a turn that is cut short cuts them all.
        let part = (MAX_TURN_RAD / step[4].abs().max(1e-12)).min(1.0);
        sides.tilt_rad += step[4] * part;
        for (offset_m, step) in sides.offsets_m.iter_mut().zip(step.iter()) {
            *offset_m += step * part;
        }
        if sides.size_m().iter().any(|size_m| size_m.is_nan() || *size_m <= 0.0) {
            return None;
        }
    }
    judged(points, sides, &information, jitter_px, is_level)
}

fn judged(
    points: &[EdgePoint],
    sides: Sides,
    information: &Matrix5<f64>,
    jitter_px: f64,
    is_level: bool,
) -> Option<Fit> {
    let nearest: Vec<Nearest> = points.iter().map(|point| sides.nearest(point, jitter_px)).collect();
    let distances: Vec<f64> = nearest.iter().map(|near| near.distance).collect();
    let misfit = quantile(&distances, WITHIN_ONE_SIGMA);
    let cost = distances.iter().map(|distance| (1.0 + (distance / HALF_WEIGHT).powi(2)).ln()).sum();
    // Contours wander together over some length: points within it count as one.
    let together = CORRELATION_PX * POINTS_PER_PX;
    let mut covariance = information.try_inverse()? * (together * misfit.max(1.0).powi(2));
    if is_level {
        covariance[(4, 4)] = 0.0;
    }
    let reach = 3.0 * misfit.max(1.0);
    let mut seen = [[false; PIECES]; 4];
    let mut possible = [PIECES; 4];
    for near in nearest.iter().filter(|near| near.distance <= reach) {
        let piece = (near.part.clamp(0.0, 1.0) * PIECES as f64) as usize;
        seen[near.side][piece.min(PIECES - 1)] = true;
        // Short sides have fewer contour points than pieces.
        possible[near.side] = possible[near.side].min(near.along_px.ceil().max(1.0) as usize);
    }
    let visible = [0, 1, 2, 3].map(|side| {
        let count = seen[side].iter().filter(|seen| **seen).count();
        (count as f64 / possible[side] as f64).min(1.0)
    });
    Some(Fit { sides, misfit, covariance, visible, cost })
}

/// 1σ of normally distributed values of which `distances` are the sizes, outliers aside.
fn robust_sigma(distances: &[f64]) -> f64 {
    1.4826 * median(distances)
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((sorted.len() as f64 * share) as usize).copied().unwrap_or(0.0)
}
