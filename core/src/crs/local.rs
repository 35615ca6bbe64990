//! Local offsets: the one place where grid `f64` becomes `f32`.

use super::{CrsError, GridPoint};

/// Largest offset, along each axis, that is kept as `f32`: there one step is at most 0.24 mm.
pub const LOCAL_LIMIT_M: f64 = 2048.0;

/// Where local offsets start; axes stay E, N, H.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalOrigin {
    origin: GridPoint,
}

impl LocalOrigin {
    /// An origin at `origin`; fails when it is not finite.
    pub fn new(origin: GridPoint) -> Result<Self, CrsError> {
        if origin.is_finite() { Ok(Self { origin }) } else { Err(CrsError::NotFinite { found: origin.into() }) }
    }

    /// Where it is.
    pub fn grid(&self) -> GridPoint {
        self.origin
    }

    /// Offset of `point` in `f32`, metres; fails when an axis exceeds [`LOCAL_LIMIT_M`] or is not finite.
    pub fn to_local(&self, point: GridPoint) -> Result<[f32; 3], CrsError> {
        self.narrowed(point, self.offset_m(point), LOCAL_LIMIT_M)
    }

    /// Offset of `point` rounded to whole metres, which `f32` holds exactly; fails beyond 2²⁴ m or when not finite.
    pub fn to_whole_metres(&self, point: GridPoint) -> Result<[f32; 3], CrsError> {
        const EXACT_LIMIT_M: f64 = 16_777_216.0;
        self.narrowed(point, self.offset_m(point).map(f64::round), EXACT_LIMIT_M)
    }

    fn narrowed(&self, point: GridPoint, offset_m: [f64; 3], limit_m: f64) -> Result<[f32; 3], CrsError> {
        if offset_m.iter().all(|axis_m| axis_m.abs() <= limit_m) {
            Ok(offset_m.map(|axis_m| axis_m as f32))
        } else {
            Err(CrsError::TooFarFromOrigin { point: point.into(), origin: self.origin.into(), limit_m })
        }
    }

    /// The grid point at a local offset.
    pub fn to_grid(&self, offset_m: [f32; 3]) -> GridPoint {
        self.at(offset_m.map(f64::from))
    }

    /// Offset of `point` in `f64`, metres, however far away.
    pub fn offset_m(&self, point: GridPoint) -> [f64; 3] {
        [
            point.easting_m - self.origin.easting_m,
            point.northing_m - self.origin.northing_m,
            point.height_m - self.origin.height_m,
        ]
    }

    /// The grid point at an offset in `f64`, metres.
    pub fn at(&self, [east_m, north_m, up_m]: [f64; 3]) -> GridPoint {
        GridPoint::new(self.origin.easting_m + east_m, self.origin.northing_m + north_m, self.origin.height_m + up_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const ORIGIN: GridPoint = GridPoint::new(836_694.05, 819_069.80, 4.5);

    proptest! {
        #[test]
        fn an_offset_within_the_limit_comes_back_within_an_eighth_of_a_millimetre(
            offset_m in proptest::array::uniform3(-LOCAL_LIMIT_M..=LOCAL_LIMIT_M)
        ) {
            let local = LocalOrigin::new(ORIGIN).unwrap();
            let point = local.at(offset_m);
            // Adding 2048 m to a grid coordinate may round up by one f64 step.
            prop_assume!(local.offset_m(point).iter().all(|axis_m| axis_m.abs() <= LOCAL_LIMIT_M));
            let back = local.offset_m(local.to_grid(local.to_local(point).unwrap()));
            for axis in 0..3 {
                prop_assert!((back[axis] - offset_m[axis]).abs() < 1.25e-4);
            }
        }
    }

    #[test]
    fn a_point_beyond_the_limit_is_refused_with_its_distance() {
        let local = LocalOrigin::new(ORIGIN).unwrap();
        let message = local.to_local(GridPoint::new(838_744.05, 819_069.80, 4.5)).unwrap_err().to_string();
        assert_eq!(
            message,
            "point 838744.050, 819069.800, 4.500 is 2050.000 m from the local origin 836694.050, 819069.800, 4.500 \
             along one axis; the limit is 2048 m"
        );
    }

    #[test]
    fn a_value_that_is_not_a_number_is_refused() {
        assert!(LocalOrigin::new(GridPoint::new(f64::NAN, 0.0, 0.0)).is_err());
        let local = LocalOrigin::new(ORIGIN).unwrap();
        assert!(local.to_local(GridPoint::new(836_694.0, f64::NAN, 0.0)).is_err());
        assert!(local.to_local(GridPoint::new(836_694.0, 819_069.0, f64::INFINITY)).is_err());
    }

    #[test]
    fn whole_metres_are_exact_far_beyond_the_limit_of_offsets() {
        let local = LocalOrigin::new(GridPoint::new(836_694.0, 819_069.0, 4.0)).unwrap();
        let far = GridPoint::new(800_000.4, 850_000.6, -3.2);
        assert_eq!(local.to_grid(local.to_whole_metres(far).unwrap()), GridPoint::new(800_000.0, 850_001.0, -3.0));
        assert!(local.to_whole_metres(GridPoint::new(1e9, 0.0, 0.0)).is_err());
    }
}
