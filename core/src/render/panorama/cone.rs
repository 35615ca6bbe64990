//! A triangle as seen from the eye, and its part of a column.

use super::grid::{PanoramaGrid, Sector, TOGETHER};
use super::reach::Reach;
use crate::render::band::{Band, Span};
use crate::render::code::Code;
use nalgebra::Vector3;
use pulp::Simd;

/// Seen from nearer to its plane than this, metres, a triangle covers no cell.
const EDGE_ON_M: f64 = 1e-6;

/// A triangle seen from the eye: directions w with `edge · w ≥ 0` for all three edges.
#[derive(Clone, Debug)]
pub(super) struct Cone {
    edges: [[f64; 3]; 3],
    /// `nearness · w` is one over the distance along w.
    nearness: [f64; 3],
}

impl Cone {
    /// `None` when the eye lies in the triangle's plane.
    #[inline(always)]
    pub(super) fn new([a, b, c]: &[[f64; 3]; 3]) -> Option<Self> {
        // Differences of neighbours lose less than sums of the edges.
        let normal = cross(minus(*b, *a), minus(*c, *a));
        let volume = dot(*a, normal);
        let apart = volume * volume > EDGE_ON_M * EDGE_ON_M * dot(normal, normal);
        if !apart || !volume.is_finite() {
            return None;
        }
        let (sign, scale) = (if volume < 0.0 { -1.0 } else { 1.0 }, 1.0 / volume);
        let edges = [cross(*b, *c), cross(*c, *a), cross(*a, *b)].map(|edge| edge.map(|value| value * sign));
        Some(Self { edges, nearness: normal.map(|value| value * scale) })
    }

    /// `uv · w` over `nearness · w` is the texture coordinate along w: the edges are barycentric weights up to the one
    /// factor that makes their sum the nearness.
    pub(super) fn uv_gradients(&self, uvs: &[[f32; 2]; 3]) -> [Vector3<f64>; 2] {
        let edges = self.edges.map(Vector3::from);
        let sum: Vector3<f64> = edges.iter().sum();
        let scale = Vector3::from(self.nearness).dot(&sum) / sum.norm_squared();
        [0, 1].map(|axis| {
            let weighted = edges.iter().zip(uvs).map(|(edge, uv)| edge * f64::from(uv[axis]));
            weighted.sum::<Vector3<f64>>() * scale
        })
    }

    /// Draws it into the columns of a sector, of which a row of the band is one each.
    #[inline(always)]
    pub(super) fn paint<S: Simd>(
        &self,
        simd: S,
        band: &mut Band,
        (grid, sector): (&PanoramaGrid, &Sector),
        reach: &Reach,
        code: Code,
    ) {
        for [first, end] in reach.columns {
            for column in (first..end).step_by(TOGETHER) {
                let columns = [column as usize, end.min(column + TOGETHER as i32) as usize];
                self.paint_columns(simd, band, (grid, sector), (columns, reach), code);
            }
        }
    }

    #[inline(always)]
    fn paint_columns<S: Simd>(
        &self,
        simd: S,
        band: &mut Band,
        (grid, sector): (&PanoramaGrid, &Sector),
        ([first, end], reach): ([usize; 2], &Reach),
        code: Code,
    ) {
        let sin: &[f64; TOGETHER] = sector.sin[first..].first_chunk().expect("invariant: sectors are padded");
        let cos: &[f64; TOGETHER] = sector.cos[first..].first_chunk().expect("invariant: sectors are padded");
        let [first_tangent, tangent_step] = grid.tangents();
        let rows = self.rows(sin, cos, [first_tangent, 1.0 / tangent_step], reach.rows);
        let [east, north, up] = self.nearness;
        let step = up * tangent_step;
        let mut at_zero = [0.0; TOGETHER];
        for k in 0..TOGETHER {
            at_zero[k] = east * sin[k] + north * cos[k] + up * first_tangent;
        }
        let cap = f64::from(reach.nearest);
        for k in 0..end - first {
            let [from, to] = [rows[0][k], rows[1][k]];
            if from >= to {
                continue;
            }
            let [far, near] = if step >= 0.0 { [from, to - 1] } else { [to - 1, from] };
            let [start, most] = [far, near].map(|row| at_zero[k] + f64::from(row) * step);
            let start = start.min(cap).max(f64::from(f32::MIN_POSITIVE));
            // Rounding at a grazing eye must not bring it nearer than it can be.
            let step =
                if most > cap { (cap - start) / f64::from((near - far).abs().max(1)) * step.signum() } else { step };
            let span = Span { first: from, end: to, anchor: far as f32, start: start as f32, step: step as f32 };
            band.draw(simd, first + k, span, code, &|_| true);
        }
    }

    /// First and end row in each of some columns.
    #[inline(always)]
    fn rows(
        &self,
        sin: &[f64; TOGETHER],
        cos: &[f64; TOGETHER],
        [first_tangent, rows_per_tangent]: [f64; 2],
        within: [i32; 2],
    ) -> [[i32; TOGETHER]; 2] {
        let (mut low, mut high) = ([f64::NEG_INFINITY; TOGETHER], [f64::INFINITY; TOGETHER]);
        for [east, north, up] in self.edges {
            let scale = -1.0 / up;
            let mut level = [0.0; TOGETHER];
            for k in 0..TOGETHER {
                level[k] = east * sin[k] + north * cos[k];
            }
            if up > 0.0 {
                for k in 0..TOGETHER {
                    let tangent = level[k] * scale;
                    low[k] = if tangent > low[k] { tangent } else { low[k] };
                }
            } else if up < 0.0 {
                for k in 0..TOGETHER {
                    let tangent = level[k] * scale;
                    high[k] = if tangent < high[k] { tangent } else { high[k] };
                }
            } else {
                for k in 0..TOGETHER {
                    high[k] = if level[k] < 0.0 { f64::NEG_INFINITY } else { high[k] };
                }
            }
        }
        let within = within.map(f64::from);
        let row_of = |tangent: f64| {
            let row = ((tangent - first_tangent) * rows_per_tangent).ceil();
            let row = if row > within[0] { row } else { within[0] };
            (if row < within[1] { row } else { within[1] }) as i32
        };
        let mut rows = [[0; TOGETHER]; 2];
        for k in 0..TOGETHER {
            rows[0][k] = row_of(low[k]);
            rows[1][k] = row_of(high[k]);
        }
        rows
    }
}

#[inline(always)]
fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
