//! Four straight edges through a contour, by robust total least squares, and where they meet: corners finer than a pixel.

use crate::hull::{convex_hull, enclosing_quad, intersection};
use nalgebra::{Matrix2, Vector2};

/// Share of a side next to a corner that its fit leaves out: jitter rounds corners off.
const CORNER_SHARE: f64 = 0.08;
/// Rounds of assigning points to sides and fitting again.
const ROUNDS: usize = 6;
/// Rounds of reweighting within a fit.
const REWEIGHTINGS: usize = 4;
/// Smallest scale of a residual, pixels: labels have whole pixels.
const MIN_SCALE_PX: f64 = 0.5;
/// Pieces into which a side is cut to see how much of it is visible.
const PIECES: usize = 24;
/// Length over which contours wander together, pixels: shorter pieces are not independent.
pub const CORRELATION_PX: f64 = 28.0;

/// A fitted side.
#[derive(Clone, Copy, Debug)]
pub struct Side {
    /// A point on it, pixels.
    pub point: Vector2<f64>,
    /// Its unit direction.
    pub along: Vector2<f64>,
    /// Root mean square of its points' distances, pixels, outliers weighed down.
    pub rms_px: f64,
}

/// A quadrilateral with fitted sides; side `i` runs from corner `i` to corner `i + 1`.
#[derive(Clone, Copy, Debug)]
pub struct Quad {
    /// Its corners, in order.
    pub corners: [Vector2<f64>; 4],
    /// Its sides.
    pub sides: [Side; 4],
    /// Share of each side along which contour points lie.
    pub visible: [f64; 4],
}

/// The quadrilateral of a contour; `None` when four sides cannot be told from it.
pub fn fit(contour: &[Vector2<f64>]) -> Option<Quad> {
    let mut corners = enclosing_quad(&convex_hull(contour))?;
    let mut sides = None;
    for _ in 0..ROUNDS {
        let of_side = assign(contour, &corners);
        let fitted = [0, 1, 2, 3].map(|side| fit_line(&of_side[side]));
        let [Some(a), Some(b), Some(c), Some(d)] = fitted else { return None };
        sides = Some([a, b, c, d]);
        corners = meet(&[a, b, c, d])?;
    }
    let sides = sides?;
    let visible = visible(contour, &corners, &sides);
    Some(Quad { corners, sides, visible })
}

/// The corners of four sides.
pub fn meet(sides: &[Side; 4]) -> Option<[Vector2<f64>; 4]> {
    let corner = |side: usize| {
        let (before, after) = (&sides[(side + 3) % 4], &sides[side]);
        intersection(&before.point, &before.along, &after.point, &after.along)
    };
    Some([corner(0)?, corner(1)?, corner(2)?, corner(3)?])
}

impl Quad {
    /// Length of side `side`, pixels.
    pub fn length_px(&self, side: usize) -> f64 {
        (self.corners[(side + 1) % 4] - self.corners[side]).norm()
    }

    /// The corners when side `side` is shifted outwards by `shift_px` and turned about its middle by `turn_rad`.
    pub fn shaken(&self, side: usize, shift_px: f64, turn_rad: f64) -> Option<[Vector2<f64>; 4]> {
        let mut sides = self.sides;
        let Side { along, .. } = sides[side];
        let across = Vector2::new(along.y, -along.x);
        sides[side].point = (self.corners[side] + self.corners[(side + 1) % 4]) / 2.0 + across * shift_px;
        sides[side].along = along + across * turn_rad.tan();
        meet(&sides)
    }
}

/// The points of each side: those nearest to it that lie beside its middle part.
fn assign(contour: &[Vector2<f64>], corners: &[Vector2<f64>; 4]) -> [Vec<Vector2<f64>>; 4] {
    let mut of_side: [Vec<Vector2<f64>>; 4] = Default::default();
    for point in contour {
        let beside = |side: usize| {
            let (start, end) = (corners[side], corners[(side + 1) % 4]);
            let along = end - start;
            let part = (point - start).dot(&along) / along.norm_squared();
            let nearest = start + along * part.clamp(0.0, 1.0);
            ((point - nearest).norm_squared(), side, part)
        };
        let nearest = (0..4).map(beside).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, side, part)) = nearest
            && (CORNER_SHARE..=1.0 - CORNER_SHARE).contains(&part)
        {
            of_side[side].push(*point);
        }
    }
    of_side
}

/// A line by total least squares, reweighted with Cauchy weights; `None` from fewer than four points.
fn fit_line(points: &[Vector2<f64>]) -> Option<Side> {
    if points.len() < 4 {
        return None;
    }
    let mut weights = vec![1.0; points.len()];
    let mut side = None;
    for _ in 0..REWEIGHTINGS {
        let total: f64 = weights.iter().sum();
        let mean = points.iter().zip(&weights).map(|(p, w)| p * *w).sum::<Vector2<f64>>() / total;
        let scatter: Matrix2<f64> =
            points.iter().zip(&weights).map(|(p, w)| (p - mean) * (p - mean).transpose() * *w).sum();
        let angle_rad = (2.0 * scatter[(0, 1)]).atan2(scatter[(0, 0)] - scatter[(1, 1)]) / 2.0;
        let along = Vector2::new(angle_rad.cos(), angle_rad.sin());
        if !along.iter().all(|x| x.is_finite()) {
            return None;
        }
        let residuals: Vec<f64> = points.iter().map(|p| (p - mean).perp(&along).abs()).collect();
        let squares: f64 = residuals.iter().zip(&weights).map(|(r, w)| r * r * w).sum();
        side = Some(Side { point: mean, along, rms_px: (squares / total).sqrt() });
        let scale = (1.4826 * median(&residuals)).max(MIN_SCALE_PX) * 2.0;
        weights = residuals.iter().map(|r| 1.0 / (1.0 + (r / scale).powi(2))).collect();
    }
    side
}

/// The median of `values`; 0 of none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

fn visible(contour: &[Vector2<f64>], corners: &[Vector2<f64>; 4], sides: &[Side; 4]) -> [f64; 4] {
    [0, 1, 2, 3].map(|side| {
        let (start, end) = (corners[side], corners[(side + 1) % 4]);
        let along = end - start;
        let reach_px = (3.0 * sides[side].rms_px).max(3.0);
        let mut seen = [false; PIECES];
        for point in contour {
            let part = (point - start).dot(&along) / along.norm_squared();
            let off_px = (point - start).perp(&along).abs() / along.norm();
            if (0.0..1.0).contains(&part) && off_px <= reach_px {
                seen[(part * PIECES as f64) as usize] = true;
            }
        }
        // Short sides have fewer contour points than pieces.
        let possible = PIECES.min(along.norm().ceil().max(1.0) as usize);
        (seen.iter().filter(|seen| **seen).count() as f64 / possible as f64).min(1.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle_contour(width: f64, height: f64) -> Vec<Vector2<f64>> {
        let steps = |length: f64| (0..(2.0 * length) as usize).map(|step| step as f64 / 2.0);
        let across = steps(width).flat_map(|x| [Vector2::new(x, 0.0), Vector2::new(x, height)]);
        let up = steps(height).flat_map(|y| [Vector2::new(0.0, y), Vector2::new(width, y)]);
        across.chain(up).collect()
    }

    #[test]
    fn a_patch_that_sticks_to_a_side_does_not_move_the_corners() {
        let mut contour = rectangle_contour(80.0, 50.0);
        contour.extend((0..24).map(|step| Vector2::new(30.0 + f64::from(step % 12), -8.0 + f64::from(step / 12))));
        let quad = fit(&contour).unwrap();
        for corner in [[0.0, 0.0], [80.0, 0.0], [80.0, 50.0], [0.0, 50.0]].map(Vector2::from) {
            let nearest = quad.corners.iter().map(|found| (found - corner).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.5, "{nearest} px off at {corner}");
        }
    }

    #[test]
    fn a_side_of_which_half_is_missing_is_half_visible() {
        let contour: Vec<_> = rectangle_contour(80.0, 50.0).into_iter().filter(|p| p.y > 1.0 || p.x > 40.0).collect();
        let quad = fit(&contour).unwrap();
        let least = quad.visible.iter().copied().fold(1.0, f64::min);
        assert!((least - 0.5).abs() < 0.1, "{least}");
    }
}
