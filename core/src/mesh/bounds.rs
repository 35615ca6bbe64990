//! The box around a mesh.

use super::Mesh;
use resurvey_schema::GridPoint;

impl Mesh {
    /// The lowest and highest easting, northing and height of all vertices; twice the origin when there are none.
    pub fn bounds(&self) -> (GridPoint, GridPoint) {
        let Some(first) = self.vertices.first() else { return (self.origin, self.origin) };
        let (mut low, mut high) = (*first, *first);
        for vertex in &self.vertices {
            for axis in 0..3 {
                low[axis] = low[axis].min(vertex[axis]);
                high[axis] = high[axis].max(vertex[axis]);
            }
        }
        (self.point(low), self.point(high))
    }

    /// The grid point at `offset` from the origin.
    pub fn point(&self, [east, north, up]: [f32; 3]) -> GridPoint {
        GridPoint::new(
            self.origin.easting_m + f64::from(east),
            self.origin.northing_m + f64::from(north),
            self.origin.height_m + f64::from(up),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_every_vertex_at_grid_coordinates() {
        let mesh = Mesh {
            origin: GridPoint::new(835_600.0, 817_800.0, 4.5),
            vertices: vec![[1.0, -2.0, 0.25], [-3.0, 4.0, 0.0]],
            uvs: vec![],
            triangles: vec![],
            triangle_surfaces: vec![],
            surfaces: vec![],
        };
        let (low, high) = mesh.bounds();
        assert_eq!(low, GridPoint::new(835_597.0, 817_798.0, 4.5));
        assert_eq!(high, GridPoint::new(835_601.0, 817_804.0, 4.75));
    }
}
