//! Boxes in whole millimetres: what the index of a map stores and compares exactly.

use resurvey_schema::GridPoint;

/// An axis-parallel box in millimetres of the map frame: easting, northing, height. Both ends belong to it, and
/// `min ≤ max` on every axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BoxMm {
    min: [i64; 3],
    max: [i64; 3],
}

/// Why something has no box.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidBox {
    /// A coordinate that is not a number or is beyond any map.
    #[error("{axis} {} m is not within {} m of the origin", legible(*value_m), BoxMm::LIMIT_M)]
    OutOfRange {
        /// `easting`, `northing` or `height`.
        axis: &'static str,
        /// What was found, metres.
        value_m: f64,
    },
    /// A region whose lower end is above its upper end.
    #[error("{axis} goes from {min_m} m down to {max_m} m; the lower end comes first")]
    Reversed {
        /// `easting`, `northing` or `height`.
        axis: &'static str,
        /// Lower end, metres.
        min_m: f64,
        /// Upper end, metres.
        max_m: f64,
    },
    /// No point at all.
    #[error("expected at least one point, found none")]
    Empty,
}

/// A number in at most a line: 1e308 has three hundred digits.
fn legible(value: f64) -> String {
    if value.abs() < 1e15 { value.to_string() } else { format!("{value:e}") }
}

const AXES: [&str; 3] = ["easting", "northing", "height"];

impl BoxMm {
    /// No coordinate of a map is further from its origin, metres: the largest projected coordinates in use on Earth
    /// are below 4 × 10⁷ m, and up to 10⁹ m a `f64` still resolves 0.12 µm.
    pub const LIMIT_M: f64 = 1e9;

    /// The smallest box around `points`: floor below, ceiling above.
    pub fn around(points: impl IntoIterator<Item = GridPoint>) -> Result<Self, InvalidBox> {
        let mut bounds: Option<Self> = None;
        for point in points {
            let own = Self::new(point, point)?;
            bounds = Some(bounds.map_or(own, |bounds| bounds.union(&own)));
        }
        bounds.ok_or(InvalidBox::Empty)
    }

    /// The smallest box around the region between `min` and `max`.
    pub fn new(min: GridPoint, max: GridPoint) -> Result<Self, InvalidBox> {
        let (low, high): ([f64; 3], [f64; 3]) = (min.into(), max.into());
        for axis in 0..3 {
            for value_m in [low[axis], high[axis]] {
                if value_m.is_nan() || value_m.abs() > Self::LIMIT_M {
                    return Err(InvalidBox::OutOfRange { axis: AXES[axis], value_m });
                }
            }
            if low[axis] > high[axis] {
                return Err(InvalidBox::Reversed { axis: AXES[axis], min_m: low[axis], max_m: high[axis] });
            }
        }
        Ok(Self {
            min: low.map(|value| (value * 1e3).floor() as i64),
            max: high.map(|value| (value * 1e3).ceil() as i64),
        })
    }

    /// The plan region over all heights a map can hold.
    pub fn of_plan(e0_m: f64, n0_m: f64, e1_m: f64, n1_m: f64) -> Result<Self, InvalidBox> {
        let (low, high) = (-Self::LIMIT_M, Self::LIMIT_M);
        Self::new(GridPoint::new(e0_m, n0_m, low), GridPoint::new(e1_m, n1_m, high))
    }

    /// The box from whole millimetres; `None` when an axis is reversed or beyond [`Self::LIMIT_M`].
    pub fn from_mm(min: [i64; 3], max: [i64; 3]) -> Option<Self> {
        let limit = Self::LIMIT_M as i64 * 1000;
        let fits = |value: &i64| (-limit..=limit).contains(value);
        let ordered = min.iter().zip(&max).all(|(low, high)| low <= high);
        (ordered && min.iter().chain(&max).all(fits)).then_some(Self { min, max })
    }

    /// Lower ends: easting, northing, height, millimetres.
    pub fn min(&self) -> [i64; 3] {
        self.min
    }

    /// Upper ends: easting, northing, height, millimetres.
    pub fn max(&self) -> [i64; 3] {
        self.max
    }

    /// The corners as grid points: lower ends, upper ends.
    pub fn corners(&self) -> [GridPoint; 2] {
        [self.min, self.max].map(|ends| ends.map(|value| value as f64 / 1e3).into())
    }

    /// Whether the boxes share a point; touching counts.
    pub fn intersects(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.min[axis] <= other.max[axis] && other.min[axis] <= self.max[axis])
    }

    /// The smallest box around both.
    pub fn union(&self, other: &Self) -> Self {
        let pick = |a: [i64; 3], b: [i64; 3], choose: fn(i64, i64) -> i64| {
            [choose(a[0], b[0]), choose(a[1], b[1]), choose(a[2], b[2])]
        };
        Self { min: pick(self.min, other.min, i64::min), max: pick(self.max, other.max, i64::max) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn at_836_694_m_a_point_is_a_box_of_one_millimetre_at_most() {
        // An f32 index would make it 125 mm wide.
        let bounds = BoxMm::around([GridPoint::new(836_694.050_4, 819_069.8, 12.345)]).unwrap();
        assert_eq!(
            (bounds.min(), bounds.max()),
            ([836_694_050, 819_069_800, 12_345], [836_694_051, 819_069_800, 12_345])
        );
    }

    #[test]
    fn negative_coordinates_are_rounded_outwards() {
        let bounds = BoxMm::around([GridPoint::new(-0.000_4, -1.000_6, -3.5)]).unwrap();
        assert_eq!((bounds.min(), bounds.max()), ([-1, -1001, -3500], [0, -1000, -3500]));
    }

    #[test]
    fn what_is_not_a_number_or_beyond_any_map_is_refused() {
        for value_m in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.1e9] {
            let error = BoxMm::around([GridPoint::new(0.0, value_m, 0.0)]).unwrap_err();
            assert!(matches!(error, InvalidBox::OutOfRange { axis: "northing", .. }), "{error}");
        }
        assert_eq!(BoxMm::around([]), Err(InvalidBox::Empty));
    }

    #[test]
    fn a_reversed_region_is_refused() {
        let error = BoxMm::of_plan(10.0, 0.0, 9.0, 1.0).unwrap_err();
        assert_eq!(error, InvalidBox::Reversed { axis: "easting", min_m: 10.0, max_m: 9.0 });
        assert_eq!(BoxMm::from_mm([0, 1, 0], [0, 0, 0]), None);
    }

    proptest! {
        #[test]
        fn a_box_holds_its_points_and_wastes_less_than_a_millimetre(
            e in -4e7..4e7_f64, n in -4e7..4e7_f64, h in -500.0..9000.0_f64, width in 0.0..100.0_f64,
        ) {
            let [a, b] = [GridPoint::new(e, n, h), GridPoint::new(e + width, n + width, h + width)];
            let bounds = BoxMm::around([b, a]).unwrap();
            for (axis, (low, high)) in <[f64; 3]>::from(a).into_iter().zip(<[f64; 3]>::from(b)).enumerate() {
                let (min, max) = (bounds.min()[axis] as f64, bounds.max()[axis] as f64);
                prop_assert!(min <= low * 1e3 && low * 1e3 < min + 1.0);
                prop_assert!(max >= high * 1e3 && high * 1e3 > max - 1.0);
            }
        }

        #[test]
        fn intersection_is_symmetric_and_a_union_holds_both(
            a in proptest::array::uniform6(-50_i64..50), b in proptest::array::uniform6(-50_i64..50),
        ) {
            let make = |v: [i64; 6]| BoxMm::from_mm(
                [v[0].min(v[3]), v[1].min(v[4]), v[2].min(v[5])], [v[0].max(v[3]), v[1].max(v[4]), v[2].max(v[5])],
            ).unwrap();
            let (a, b) = (make(a), make(b));
            prop_assert_eq!(a.intersects(&b), b.intersects(&a));
            let both = a.union(&b);
            prop_assert_eq!(both.union(&a), both);
            prop_assert!(both.intersects(&a) && both.intersects(&b));
        }
    }
}
