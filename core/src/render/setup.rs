//! What a triangle needs to be drawn: its edges and its inverse depth as linear functions of the pixel (Olano & Greer
//! 1997).

use super::edges::Edges;
use super::projection::{NEAR_M, Projection};
use nalgebra::Vector3;

/// Below this share of the product of its corners' distances the volume between camera and triangle is rounding: the
/// triangle is degenerate or seen edge-on.
const FLAT: f64 = 1e-14;

/// A triangle that may show.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    /// Index in the scene.
    pub(super) triangle: u32,
    /// Inverse depth as a linear form of (u, v, 1).
    pub(super) inverse_depth: [f64; 3],
}

impl Setup {
    /// Inverse depth at (u, v).
    pub(super) fn inverse_depth_at(&self, u: f64, v: f64) -> f64 {
        let [along_u, along_v, constant] = self.inverse_depth;
        along_u * u + (along_v * v + constant)
    }
}

/// A triangle in homogeneous pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct HomogeneousTriangle {
    /// (u·z, v·z, z) of the corners.
    corners: [Vector3<f64>; 3],
    /// The form of each edge, opposite the corner of the same index: zero along it.
    edges: [Vector3<f64>; 3],
    /// Six times the volume of the tetrahedron with the camera.
    volume: f64,
}

impl HomogeneousTriangle {
    /// The triangle with these corners; `None` when it is degenerate or seen edge-on.
    pub(super) fn new(corners: [Vector3<f64>; 3]) -> Option<Self> {
        let [a, b, c] = &corners;
        let edges = [b.cross(c), c.cross(a), a.cross(b)];
        let volume = a.dot(&edges[0]);
        let limit = FLAT * FLAT * a.norm_squared() * b.norm_squared() * c.norm_squared();
        (volume * volume > limit).then_some(Self { corners, edges, volume })
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

    /// The half planes that it covers, within `rows`.
    pub(super) fn edges(&self, projection: &Projection, rows: std::ops::Range<usize>) -> Edges {
        let mut edges = Edges::new(rows, projection.width);
        for form in &self.edges {
            // Shared edges have exactly opposite forms, so that their pixels fall to one side or the other.
            edges.add(if self.volume > 0.0 { *form } else { -form });
        }
        if self.corners.iter().any(|corner| corner.z < NEAR_M) {
            edges.add(Vector3::new(0.0, 0.0, 1.0 / NEAR_M) - Vector3::from(self.inverse_depth()));
        }
        edges
    }
}
