//! Which way is up in a model file, and how its axes lie in the map: the one place where glTF axes are swapped.

/// The axis of a model file that points up. Both kinds are right-handed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// x east, y up, z south: glTF.
    Y,
    /// x east, y north, z up: 3DS, and most survey formats.
    Z,
}

impl Up {
    /// East, north, up of a point of the file.
    pub fn grid_from_file(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Y => [x, -z, y],
            Self::Z => [x, y, z],
        }
    }
}

/// Turns E, N, H into glTF's x = E, y = H, z = −N: column-major, for the root node of an export.
pub const GLTF_FROM_GRID: [f32; 16] = [
    1.0, 0.0, 0.0, 0.0, //
    0.0, 0.0, -1.0, 0.0, //
    0.0, 1.0, 0.0, 0.0, //
    0.0, 0.0, 0.0, 1.0,
];

/// How a model lies in the map: its axes, then a turn about the up axis, then an origin that the caller adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    up: Up,
    sine: f64,
    cosine: f64,
}

impl Placement {
    /// Turns by `rotate_deg` degrees clockwise as seen from above, like a yaw.
    pub fn new(up: Up, rotate_deg: f64) -> Self {
        // Quarter turns are exact, so that a turned wall stays on its line.
        let (sine, cosine) = match rotate_deg.rem_euclid(360.0) {
            0.0 => (0.0, 1.0),
            90.0 => (1.0, 0.0),
            180.0 => (0.0, -1.0),
            270.0 => (-1.0, 0.0),
            turn => turn.to_radians().sin_cos(),
        };
        Self { up, sine, cosine }
    }

    /// East, north, up from the origin, metres.
    pub fn grid_from_file(&self, point: [f64; 3]) -> [f64; 3] {
        let [east, north, up] = self.up.grid_from_file(point);
        [east * self.cosine + north * self.sine, north * self.cosine - east * self.sine, up]
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "swaps, signs and quarter turns are exact")]
mod tests {
    use super::*;

    #[test]
    fn gltf_forward_is_south_and_its_up_is_height() {
        // glTF 2.0, 3.4: +Y up, +Z forward, −X right of it; seen from above with east right, +Z points south.
        assert_eq!(Up::Y.grid_from_file([1.0, 2.0, 3.0]), [1.0, -3.0, 2.0]);
        let gltf_from_grid = nalgebra::Matrix4::from_column_slice(&GLTF_FROM_GRID).cast::<f64>();
        let point = gltf_from_grid.transform_point(&nalgebra::Point3::new(1.0, -3.0, 2.0));
        assert_eq!(<[f64; 3]>::from(point.coords), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn a_turn_is_clockwise_from_above() {
        // North turned by 90° clockwise is east.
        assert_eq!(Placement::new(Up::Z, 90.0).grid_from_file([0.0, 5.0, 1.0]), [5.0, 0.0, 1.0]);
        let [east, north, _] = Placement::new(Up::Z, 30.0).grid_from_file([0.0, 1.0, 0.0]);
        assert!((east - 0.5).abs() < 1e-12 && (north - 0.75f64.sqrt()).abs() < 1e-12);
        assert_eq!(Placement::new(Up::Z, -450.0), Placement::new(Up::Z, 270.0));
    }
}
