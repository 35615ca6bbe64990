//! Where an object of predefined size is seen when nothing hides it: the silhouette of an upright cylinder as wide as a
//! square base is on the mean over all headings, since nobody knows the heading.

use crate::hull::convex_hull;
use crate::sight::Sight;
use nalgebra::{Vector2, Vector3};
use resurvey_plugin::Error;

/// Mean width of a square over all headings, as a multiple of its side (Cauchy: perimeter / π).
const MEAN_WIDTH: f64 = 4.0 / std::f64::consts::PI;
/// Points of each of the two circles.
const POINTS: usize = 16;
/// Rows of a silhouette, at most: what is nearer than that needs no search.
const MAX_ROWS: f64 = 20_000.0;

/// A silhouette in the image; it may go beyond the borders.
#[derive(Clone, Debug)]
pub struct Silhouette {
    points: Vec<Vector2<f64>>,
    hull: Vec<Vector2<f64>>,
    /// Its first row.
    top: i64,
    /// First column and the one after the last, of each row.
    spans: Vec<[i64; 2]>,
}

/// Radius of the cylinder that stands for an object of `size_m`, metres.
pub fn radius_m(size_m: [f64; 3]) -> f64 {
    MEAN_WIDTH * (size_m[0] + size_m[1]) / 4.0
}

impl Silhouette {
    /// Of an object whose base has its centre at `foot`; `None` when a part of it is not before the camera.
    pub fn new(sight: &Sight<'_>, foot: &Vector3<f64>, size_m: [f64; 3]) -> Result<Option<Self>, Error> {
        let radius_m = radius_m(size_m);
        let points: Vec<_> = (0..2 * POINTS)
            .map(|point| {
                let turn = std::f64::consts::TAU * (point / 2) as f64 / POINTS as f64;
                let up = if point % 2 == 0 { 0.0 } else { size_m[2] };
                sight.to_grid(&(foot + Vector3::new(radius_m * turn.cos(), radius_m * turn.sin(), up)))
            })
            .collect();
        if !foot.iter().all(|x| x.is_finite()) {
            return Ok(None);
        }
        let seen: Option<Vec<[f64; 2]>> = sight.host.project(sight.pose(), &points)?.into_iter().collect();
        Ok(seen.and_then(|seen| Self::around(seen.into_iter().map(Vector2::from).collect())))
    }

    fn around(points: Vec<Vector2<f64>>) -> Option<Self> {
        let hull = convex_hull(&points);
        let low = hull.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        let high = hull.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
        if hull.len() < 3 || !(high - low).is_finite() || high - low > MAX_ROWS || low.abs() > MAX_ROWS {
            return None;
        }
        // Pixels whose centre lies inside.
        let first = |x: f64| (x - 0.5).ceil() as i64;
        let top = first(low);
        let spans = (top..first(high)).map(|row| crossed(&hull, row as f64 + 0.5).map(first)).collect();
        Some(Self { points, hull, top, spans })
    }

    /// First column and the one after the last in row `v`; equal where it has none.
    pub fn span(&self, v: i64) -> [i64; 2] {
        usize::try_from(v - self.top).ok().and_then(|row| self.spans.get(row)).copied().unwrap_or([0, 0])
    }

    /// Its rows.
    pub fn rows(&self) -> std::ops::Range<i64> {
        self.top..self.top + self.spans.len() as i64
    }

    /// Its pixels, those beyond the image as well.
    pub fn area_px(&self) -> f64 {
        self.spans.iter().map(|[left, right]| (right - left).max(0) as f64).sum()
    }

    /// Whether pixel `u`, `v` belongs to it.
    pub fn contains(&self, u: i64, v: i64) -> bool {
        let [left, right] = self.span(v);
        (left..right).contains(&u)
    }

    /// How far it reaches in the unit direction `normal`, pixels.
    pub fn reach_px(&self, normal: &Vector2<f64>) -> f64 {
        self.points.iter().map(|point| point.dot(normal)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Points about a pixel apart along its contour: where, the unit normal outward, and the length each stands for.
    pub fn contour(&self) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>, f64)> {
        let count = self.hull.len();
        (0..count).flat_map(move |corner| {
            let (start, end) = (self.hull[corner], self.hull[(corner + 1) % count]);
            let along = end - start;
            let length_px = along.norm();
            let steps = length_px.ceil().clamp(1.0, MAX_ROWS) as usize;
            let normal = Vector2::new(along.y, -along.x) / length_px.max(1e-9);
            (0..steps).map(move |step| {
                (start + along * ((step as f64 + 0.5) / steps as f64), normal, length_px / steps as f64)
            })
        })
    }
}

/// Where the row `y` enters and leaves the polygon.
fn crossed(hull: &[Vector2<f64>], y: f64) -> [f64; 2] {
    let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
    for (corner, start) in hull.iter().enumerate() {
        let end = hull[(corner + 1) % hull.len()];
        if (start.y <= y) != (end.y <= y) {
            let x = start.x + (end.x - start.x) * (y - start.y) / (end.y - start.y);
            reach = [reach[0].min(x), reach[1].max(x)];
        }
    }
    if reach[0] <= reach[1] { reach.map(|x| x.clamp(-MAX_ROWS, MAX_ROWS)) } else { [0.0, 0.0] }
}
