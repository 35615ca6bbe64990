//! Class panoramas: every column is an azimuth, every row a tangent of elevation, so that a heading is a column shift.
//!
//! A triangle seen from the eye is a cone between three planes through the eye. Along one column, each plane cuts at one
//! tangent, and the inverse of the horizontal distance is linear in the tangent: no projection, no clipping, exact at
//! the cell centres.

use super::Scene;
use crate::mesh::Surface;
use nalgebra::Vector3;

/// Rows in a word of a bit plane.
pub const ROWS_PER_WORD: usize = 64;

/// Layout of a panorama: cells of equal azimuth and equal tangent of elevation.
#[derive(Clone, Debug)]
pub struct PanoramaGrid {
    rows: usize,
    first_tangent: f64,
    tangent_step: f64,
    /// Sine and cosine of the azimuth of each column's centre, clockwise from grid north.
    columns: Vec<[f64; 2]>,
}

/// Buffers of one rendering, reused from position to position.
#[derive(Clone, Debug)]
pub struct PanoramaFrame {
    /// Inverse horizontal distance of the nearest surface, column by column, 1/m; 0 is sky.
    nearness: Vec<f32>,
    /// Index of the nearest cone; beyond all of them in sky.
    nearest: Vec<u32>,
    cones: Vec<Cone>,
}

impl PanoramaGrid {
    /// A grid of `columns` over the full circle, the first centred on grid north, and 64·`words` rows whose centres lie
    /// evenly between the tangents `lowest` and `highest`.
    pub fn new(columns: u32, words: usize, lowest: f64, highest: f64) -> Self {
        let rows = words * ROWS_PER_WORD;
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

    fn tangent(&self, row: usize) -> f64 {
        self.first_tangent + row as f64 * self.tangent_step
    }

    /// Buffers of this size, all sky.
    pub fn frame(&self) -> PanoramaFrame {
        let cells = self.columns() * self.rows;
        PanoramaFrame { nearness: vec![0.0; cells], nearest: vec![0; cells], cones: Vec::new() }
    }

    /// Draws all triangles of `scene` as seen from `eye`, an offset from the scene's origin, into the `wanted` columns.
    pub fn draw_scene(&self, frame: &mut PanoramaFrame, scene: &Scene, eye: [f64; 3], wanted: &[bool]) {
        let eye = Vector3::from(eye);
        let from_eye = |corner: &[f32; 3]| Vector3::from(corner.map(f64::from)) - eye;
        let triangles = scene.positions().iter().enumerate();
        self.draw(frame, triangles.map(|(id, corners)| (id as u32, corners.each_ref().map(from_eye))), wanted);
        for cone in &mut frame.cones {
            if matches!(scene.surface(cone.triangle as usize), Surface::Texture(_)) {
                cone.uv = Some(cone.uv_gradients(&scene.uvs()[cone.triangle as usize]));
            }
        }
    }

    /// Classes of one column, lowest row first, of a frame that [`draw_scene`](Self::draw_scene) drew from `scene`.
    pub fn classes(&self, frame: &PanoramaFrame, scene: &Scene, column: usize, classes: &mut [u8]) {
        let cells = column * self.rows..(column + 1) * self.rows;
        let nearness = &frame.nearness[cells.clone()];
        let mut row = 0;
        for run in frame.nearest[cells].chunk_by(|a, b| a == b) {
            let rows = row..row + run.len();
            row = rows.end;
            let Some(cone) = frame.cones.get(run[0] as usize) else {
                classes[rows].fill(scene.sky().0);
                continue;
            };
            match cone.uv {
                None => classes[rows].fill(scene.class_at(cone.triangle as usize, [0.0; 2]).0),
                Some(gradients) => {
                    let [sin, cos] = self.columns[column];
                    let level = gradients.map(|gradient| gradient.x * sin + gradient.y * cos);
                    for row in rows {
                        let distance_m = 1.0 / f64::from(nearness[row]);
                        let at = |axis: usize| (level[axis] + gradients[axis].z * self.tangent(row)) * distance_m;
                        classes[row] = scene.class_at(cone.triangle as usize, [at(0) as f32, at(1) as f32]).0;
                    }
                }
            }
        }
    }

    /// Draws triangles given as corners relative to the eye (E, N, H, metres); the nearest wins, the first among equals.
    fn draw(
        &self,
        frame: &mut PanoramaFrame,
        triangles: impl Iterator<Item = (u32, [Vector3<f64>; 3])>,
        wanted: &[bool],
    ) {
        frame.nearness.fill(0.0);
        frame.nearest.fill(u32::MAX);
        frame.cones.clear();
        for (id, corners) in triangles {
            if let Some(cone) = Cone::new(id, &corners) {
                let index = frame.cones.len() as u32;
                for column in cone.columns(&corners, self.columns()).filter(|&column| wanted[column]) {
                    self.draw_column(frame, index, &cone, column);
                }
                frame.cones.push(cone);
            }
        }
    }

    fn draw_column(&self, frame: &mut PanoramaFrame, index: u32, cone: &Cone, column: usize) {
        let [sin, cos] = self.columns[column];
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        for edge in &cone.edges {
            let level = edge.x * sin + edge.y * cos;
            if edge.z > 0.0 {
                low = low.max(-level / edge.z);
            } else if edge.z < 0.0 {
                high = high.min(-level / edge.z);
            } else if level < 0.0 {
                return;
            }
        }
        let row_of = |tangent: f64| ((tangent - self.first_tangent) / self.tangent_step).ceil();
        let first = row_of(low).clamp(0.0, self.rows as f64) as usize;
        let end = row_of(high).clamp(0.0, self.rows as f64) as usize;
        if first >= end {
            return;
        }
        let at_first = cone.nearness.x * sin + cone.nearness.y * cos + cone.nearness.z * self.tangent(first);
        let (at_first, step) = (at_first as f32, (cone.nearness.z * self.tangent_step) as f32);
        let cells = column * self.rows + first..column * self.rows + end;
        let nearest = frame.nearness[cells.clone()].iter_mut().zip(&mut frame.nearest[cells]);
        for (row, (nearness, winner)) in nearest.enumerate() {
            let here = at_first + row as f32 * step;
            if here > *nearness {
                *nearness = here;
                *winner = index;
            }
        }
    }
}

/// A triangle seen from the eye: directions w with `edge · w ≥ 0` for all three edges.
#[derive(Clone, Debug)]
struct Cone {
    triangle: u32,
    edges: [Vector3<f64>; 3],
    /// `nearness · w` is one over the distance along w.
    nearness: Vector3<f64>,
    /// `uv · w` over `nearness · w` is the texture coordinate along w; `None` without a texture.
    uv: Option<[Vector3<f64>; 2]>,
}

impl Cone {
    /// `None` when the eye lies in the triangle's plane.
    fn new(triangle: u32, corners: &[Vector3<f64>; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let edges = [b.cross(c), c.cross(a), a.cross(b)];
        let volume = a.dot(&edges[0]);
        let normal = edges[0] + edges[1] + edges[2];
        // Seen under less than a microradian the triangle covers no cell.
        if volume.abs() <= 1e-6 * normal.norm() || !volume.is_finite() {
            return None;
        }
        let sign = volume.signum();
        Some(Self { triangle, edges: edges.map(|edge| edge * sign), nearness: normal / volume, uv: None })
    }

    /// The edges are barycentric weights up to the one factor that makes their sum the nearness.
    fn uv_gradients(&self, uvs: &[[f32; 2]; 3]) -> [Vector3<f64>; 2] {
        let sum = self.edges[0] + self.edges[1] + self.edges[2];
        let scale = self.nearness.dot(&sum) / sum.norm_squared();
        [0, 1].map(|axis| {
            let weighted = self.edges.iter().zip(uvs).map(|(edge, uv)| edge * f64::from(uv[axis]));
            weighted.sum::<Vector3<f64>>() * scale
        })
    }

    /// The columns whose azimuth the cone can contain.
    fn columns(&self, corners: &[Vector3<f64>; 3], columns: usize) -> impl Iterator<Item = usize> + use<> {
        let overhead = self.edges.iter().all(|edge| edge.z >= 0.0) || self.edges.iter().all(|edge| edge.z <= 0.0);
        let (first, count) = if overhead { (0, columns) } else { azimuth_span(corners, columns) };
        (0..count).map(move |offset| (first + offset) % columns)
    }
}

/// First column and number of columns between the azimuths of three corners that span less than half a circle.
fn azimuth_span(corners: &[Vector3<f64>; 3], columns: usize) -> (usize, usize) {
    use std::f64::consts::{PI, TAU};
    let azimuth = corners.map(|corner| corner.x.atan2(corner.y));
    let relative = azimuth.map(|other| (other - azimuth[0] + PI).rem_euclid(TAU) - PI);
    let low = relative.iter().fold(0.0_f64, |low, &other| low.min(other));
    let high = relative.iter().fold(0.0_f64, |high, &other| high.max(other));
    let step = TAU / columns as f64;
    let first = ((azimuth[0] + low) / step).floor();
    let last = ((azimuth[0] + high) / step).ceil();
    let first_column = first.rem_euclid(columns as f64) as usize % columns;
    (first_column, ((last - first) as usize + 1).min(columns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Distance along `direction` (any length) to the triangle, Möller & Trumbore 1997, in units of the direction.
    fn ray_distance(direction: Vector3<f64>, [a, b, c]: [Vector3<f64>; 3]) -> Option<f64> {
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(&ac);
        let determinant = ab.dot(&p);
        let u = -a.dot(&p) / determinant;
        let q = -a.cross(&ab);
        let v = direction.dot(&q) / determinant;
        let t = ac.dot(&q) / determinant;
        (determinant.abs() > 1e-9 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
    }

    fn corner() -> impl Strategy<Value = Vector3<f64>> {
        (-30.0_f64..30.0, -30.0_f64..30.0, -20.0_f64..40.0).prop_map(|(e, n, h)| Vector3::new(e, n, h))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn every_cell_shows_what_a_ray_through_it_hits(
            scene in prop::collection::vec([corner(), corner(), corner()], 1..12)
        ) {
            let grid = PanoramaGrid::new(90, 1, -1.0, 2.0);
            let mut frame = grid.frame();
            grid.draw(&mut frame, scene.iter().enumerate().map(|(id, corners)| (id as u32, *corners)), &[true; 90]);
            let mut wrong = 0;
            for column in 0..grid.columns() {
                for row in 0..grid.rows() {
                    let direction = grid.direction(column, row);
                    let expected = scene.iter().enumerate()
                        .filter_map(|(id, corners)| ray_distance(direction, *corners).map(|t| (id as u32, t)))
                        .min_by(|a, b| a.1.total_cmp(&b.1));
                    let cell = column * grid.rows() + row;
                    let found = (frame.nearness[cell] > 0.0)
                        .then(|| (frame.cones[frame.nearest[cell] as usize].triangle, 1.0 / f64::from(frame.nearness[cell])));
                    let same = match (expected, found) {
                        (None, None) => true,
                        (Some((_, a)), Some((_, b))) => (a - b).abs() < 1e-3 * a,
                        _ => false,
                    };
                    wrong += u32::from(!same);
                }
            }
            // A ray exactly along an edge may fall either way.
            prop_assert!(wrong <= 2, "{} of {} cells differ", wrong, grid.columns() * grid.rows());
        }
    }
}
