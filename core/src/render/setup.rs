//! What a triangle needs to be drawn: its edges and its inverse depth as linear functions of the pixel (Olano & Greer
//! 1997).
#![allow(clippy::needless_range_loop, reason = "lanes and axes: plain loops become vector code")]

use super::code::Code;
use super::edges::{Edges, first_centre};
use super::projection::{NEAR_M, Projection, SLACK_PX};
use super::scene::Scene;
use nalgebra::Vector3;
use std::ops::Range;

/// Triangles worked on at once.
pub(super) const TOGETHER: usize = 8;

/// Below this share of the product of its corners' distances the volume between camera and triangle is rounding: the
/// triangle is degenerate or seen edge-on.
const FLAT: f64 = 1e-14;

/// A triangle that may show.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    pub(super) code: Code,
    /// Largest inverse depth; infinite when it passes the camera.
    pub(super) nearest: f32,
    pub(super) rows: [i32; 2],
    pub(super) columns: [i32; 2],
    /// Inverse depth as a linear form of (u, v, 1).
    pub(super) inverse_depth: [f64; 3],
    pub(super) edges: Edges,
}

/// A number of each of the triangles worked on.
type Lanes = [f64; TOGETHER];

/// What is worked out for several triangles at once.
struct Together {
    edges: [[Lanes; 3]; 3],
    lines: [[Lanes; 2]; 3],
    volume: Lanes,
    inverse_depth: [Lanes; 3],
    /// Largest inverse depth; infinite when the triangle passes the camera.
    nearest: Lanes,
    rows: [[i32; TOGETHER]; 2],
    columns: [[i32; TOGETHER]; 2],
    shows: [bool; TOGETHER],
}

/// Adds the setups of those of `triangles` (at most [`TOGETHER`]) that may show within `rows` of the image.
#[inline(always)]
pub(super) fn prepare(
    scene: &Scene,
    projection: &Projection,
    rows: &Range<usize>,
    triangles: &[u32],
    setups: &mut Vec<Setup>,
) {
    let mut corners = [[[0.0; TOGETHER]; 3]; 3];
    let mut codes = [Code(0); TOGETHER];
    let count = triangles.len().min(TOGETHER);
    for (lane, &triangle) in triangles.iter().enumerate().take(TOGETHER) {
        // One outside the scene is left without a volume.
        let Some(position) = scene.positions().get(triangle as usize) else { continue };
        codes[lane] = scene.codes()[triangle as usize];
        for (corner, position) in position.iter().enumerate() {
            for axis in 0..3 {
                corners[corner][axis][lane] = f64::from(position[axis]);
            }
        }
    }
    let found = together(projection, &corners);
    for lane in 0..count {
        let shown = [found.rows[0][lane].max(rows.start as i32), found.rows[1][lane].min(rows.end as i32)];
        if found.shows[lane] && shown[0] < shown[1] {
            let inverse_depth =
                [found.inverse_depth[0][lane], found.inverse_depth[1][lane], found.inverse_depth[2][lane]];
            let nearest = found.nearest[lane] as f32;
            let edges = found.edges_of(lane, projection.width, nearest.is_infinite());
            let columns = [found.columns[0][lane], found.columns[1][lane]];
            setups.push(Setup { code: codes[lane], nearest, rows: shown, columns, inverse_depth, edges });
        }
    }
}

#[inline(always)]
fn together(projection: &Projection, corners: &[[Lanes; 3]; 3]) -> Together {
    let mut found = Together {
        edges: [[[0.0; TOGETHER]; 3]; 3],
        lines: [[[0.0; TOGETHER]; 2]; 3],
        volume: [0.0; TOGETHER],
        inverse_depth: [[0.0; TOGETHER]; 3],
        nearest: [0.0; TOGETHER],
        rows: [[0; TOGETHER]; 2],
        columns: [[0; TOGETHER]; 2],
        shows: [false; TOGETHER],
    };
    for lane in 0..TOGETHER {
        let a = projection.pixel([corners[0][0][lane], corners[0][1][lane], corners[0][2][lane]]);
        let b = projection.pixel([corners[1][0][lane], corners[1][1][lane], corners[1][2][lane]]);
        let c = projection.pixel([corners[2][0][lane], corners[2][1][lane], corners[2][2][lane]]);
        let edges = [cross(b, c), cross(c, a), cross(a, b)];
        let volume = dot(a, edges[0]);
        let limit = FLAT * FLAT * dot(a, a) * dot(b, b) * dot(c, c);
        for k in 0..3 {
            let edge = edges[k];
            for axis in 0..3 {
                found.edges[k][axis][lane] = edge[axis];
            }
            found.lines[k][0][lane] = -edge[1] / edge[0];
            found.lines[k][1][lane] = -edge[2] / edge[0];
        }
        for axis in 0..3 {
            found.inverse_depth[axis][lane] = (edges[0][axis] + edges[1][axis] + edges[2][axis]) / volume;
        }
        found.volume[lane] = volume;
        let (least_z, most_z) = (least(a[2], b[2], c[2]), most(a[2], b[2], c[2]));
        let passes = least_z < NEAR_M;
        found.nearest[lane] = if passes { f64::INFINITY } else { 1.0 / least_z };
        let beyond = (a[0] < 0.0) & (b[0] < 0.0) & (c[0] < 0.0)
            | (a[1] < 0.0) & (b[1] < 0.0) & (c[1] < 0.0)
            | (a[0] > projection.width * a[2]) & (b[0] > projection.width * b[2]) & (c[0] > projection.width * c[2])
            | (a[1] > projection.height * a[2]) & (b[1] > projection.height * b[2]) & (c[1] > projection.height * c[2]);
        let columns = range([a[0] / a[2], b[0] / b[2], c[0] / c[2]], projection.width);
        let rows = range([a[1] / a[2], b[1] / b[2], c[1] / c[2]], projection.height);
        for k in 0..2 {
            let whole = if k == 0 { [0, 0] } else { [projection.width as i32, projection.height as i32] };
            found.columns[k][lane] = if passes { whole[0] } else { columns[k] };
            found.rows[k][lane] = if passes { whole[1] } else { rows[k] };
        }
        let covers = passes | (columns[0] < columns[1]);
        found.shows[lane] = (volume * volume > limit) & (most_z >= NEAR_M) & !beyond & covers;
    }
    found
}

impl Together {
    /// The half planes that one of them covers.
    #[inline(always)]
    fn edges_of(&self, lane: usize, width: f64, passes: bool) -> Edges {
        let mut edges = Edges::new(width);
        for k in 0..3 {
            // Shared edges have exactly opposite forms, so that their pixels fall to one side or the other.
            let sign = if self.volume[lane] > 0.0 { 1.0 } else { -1.0 };
            let form = &self.edges[k];
            edges.add(
                [form[0][lane] * sign, form[1][lane] * sign, form[2][lane] * sign],
                (self.lines[k][0][lane], self.lines[k][1][lane]),
            );
        }
        if passes {
            let [x, y] = [-self.inverse_depth[0][lane], -self.inverse_depth[1][lane]];
            let z = 1.0 / NEAR_M - self.inverse_depth[2][lane];
            edges.add([x, y, z], (-y / x, -z / x));
        }
        edges
    }
}

/// First and end of the pixels between three positions.
#[inline(always)]
fn range([a, b, c]: [f64; 3], size: f64) -> [i32; 2] {
    [first_centre(least(a, b, c) - SLACK_PX, size), first_centre(most(a, b, c) + SLACK_PX, size)]
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn least(a: f64, b: f64, c: f64) -> f64 {
    let ab = if a < b { a } else { b };
    if ab < c { ab } else { c }
}

#[inline(always)]
fn most(a: f64, b: f64, c: f64) -> f64 {
    let ab = if a > b { a } else { b };
    if ab > c { ab } else { c }
}

/// A triangle in homogeneous pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct HomogeneousTriangle {
    /// The form of each edge, opposite the corner of the same index: zero along it.
    edges: [Vector3<f64>; 3],
    /// Six times the volume of the tetrahedron with the camera.
    volume: f64,
}

impl HomogeneousTriangle {
    /// Triangle `triangle` of the scene.
    pub(super) fn new(scene: &Scene, projection: &Projection, triangle: u32) -> Self {
        let corners = scene.positions()[triangle as usize];
        let [a, b, c] = corners.map(|corner| projection.pixel(corner.map(f64::from)));
        let edges = [cross(b, c), cross(c, a), cross(a, b)];
        Self { edges: edges.map(Vector3::from), volume: dot(a, edges[0]) }
    }

    /// A value given at the corners, divided by depth, as a linear form of (u, v, 1).
    pub(super) fn attribute(&self, at_corners: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = at_corners;
        ((self.edges[0] * a + self.edges[1] * b + self.edges[2] * c) / self.volume).into()
    }

    /// Inverse depth as a linear form of (u, v, 1).
    pub(super) fn inverse_depth(&self) -> [f64; 3] {
        ((self.edges[0] + self.edges[1] + self.edges[2]) / self.volume).into()
    }
}
