//! How far two rectangles on a wall cover each other.

use geo::{Area, BooleanOps, Coord, LineString, Polygon};
use nalgebra::Vector3;
use resurvey_schema::{GridPoint, MaterialDescriptor};

/// Rectangles whose planes are further apart than this lie on different surfaces, metres: more than the 0.25 m by which
/// real walls miss the model, twice, plus a banner's stand-off.
const SAME_SURFACE_M: f64 = 0.75;
/// Cosine of the largest angle between normals on the same surface: 20°.
const SAME_SURFACE_COS: f64 = 0.94;

/// Shared area and both areas of two rectangles, m²; `None` when they lie on different surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Overlap {
    pub(super) shared_m2: f64,
    pub(super) first_m2: f64,
    pub(super) second_m2: f64,
}

impl Overlap {
    /// Overlap of `first` and `second` in the plane of `first`.
    pub(super) fn of(first: &MaterialDescriptor, second: &MaterialDescriptor) -> Option<Self> {
        let normal = Vector3::from(first.normal);
        if normal.dot(&Vector3::from(second.normal)) < SAME_SURFACE_COS {
            return None;
        }
        let centre = first.centre();
        if normal.dot(&between(&centre, &second.centre())).abs() > SAME_SURFACE_M {
            return None;
        }
        let right = between(&first.corners[0], &first.corners[1]).try_normalize(1e-9)?;
        let up = normal.cross(&right);
        let flat = |descriptor: &MaterialDescriptor| {
            let corner = |corner: &GridPoint| {
                let offset = between(&centre, corner);
                Coord { x: right.dot(&offset), y: up.dot(&offset) }
            };
            Polygon::new(LineString(descriptor.corners.iter().map(corner).collect()), Vec::new())
        };
        let (a, b) = (flat(first), flat(second));
        let shared_m2 = a.intersection(&b).unsigned_area();
        Some(Self { shared_m2, first_m2: a.unsigned_area(), second_m2: b.unsigned_area() })
    }

    /// Shared area over the area of both together.
    pub(super) fn over_union(&self) -> f64 {
        self.shared_m2 / (self.first_m2 + self.second_m2 - self.shared_m2).max(f64::MIN_POSITIVE)
    }

    /// Shared area over the smaller of the two.
    pub(super) fn over_smaller(&self) -> f64 {
        self.shared_m2 / self.first_m2.min(self.second_m2).max(f64::MIN_POSITIVE)
    }
}

fn between(from: &GridPoint, to: &GridPoint) -> Vector3<f64> {
    Vector3::new(to.easting_m - from.easting_m, to.northing_m - from.northing_m, to.height_m - from.height_m)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use resurvey_schema::ClassId;

    /// A rectangle on a wall that faces south at northing `north`, from easting `west`, 2 m above 0.
    pub(in crate::update) fn banner(west: f64, north: f64, width: f64, height: f64) -> MaterialDescriptor {
        let corner = |east, up| GridPoint::new(835_600.0 + east, 817_800.0 + north, 2.0 + up);
        MaterialDescriptor {
            class: ClassId(3),
            corners: [corner(west, 0.0), corner(west + width, 0.0), corner(west + width, height), corner(west, height)],
            normal: [0.0, -1.0, 0.0],
            sigma: None,
        }
    }

    #[test]
    fn half_covered_rectangles_share_half() {
        let overlap = Overlap::of(&banner(0.0, 0.0, 4.0, 3.0), &banner(2.0, 0.3, 4.0, 3.0)).unwrap();
        assert!((overlap.shared_m2 - 6.0).abs() < 1e-6 && (overlap.over_union() - 6.0 / 18.0).abs() < 1e-6);
    }

    #[test]
    fn rectangles_on_walls_a_metre_apart_or_back_to_back_do_not_overlap() {
        let first = banner(0.0, 0.0, 4.0, 3.0);
        assert_eq!(Overlap::of(&first, &banner(0.0, 1.0, 4.0, 3.0)), None);
        let behind = MaterialDescriptor { normal: [0.0, 1.0, 0.0], ..first.clone() };
        assert_eq!(Overlap::of(&first, &behind), None);
    }
}
