//! A quadrilateral on a plane: how near it is to a rectangle, its size, and the rectangle it is meant to be.

use nalgebra::{Vector2, Vector3};

/// Corners on a plane, bottom-left, bottom-right, top-right, top-left, metres.
pub type Corners = [Vector2<f64>; 4];

/// Area of the planar quadrilateral `abcd`, m², as two triangles.
///
/// Lee & Hsu, Algorithm 3. The paper prints `|ab|² + |ac|²` under the root; the identity needs `|ab|²·|ac|²`, which is
/// what the cross product gives.
pub fn quad_area_m2([a, b, c, d]: [Vector3<f64>; 4]) -> f64 {
    let ac = c - a;
    ((b - a).cross(&ac).norm() + ac.cross(&(d - a)).norm()) / 2.0
}

/// `corners` in the order of [`Corners`]: counter-clockwise, the lowest edge first.
pub fn in_order(corners: Corners) -> Corners {
    let [a, b, c, d] = corners;
    let [a, b, c, d] = if (c - a).perp(&(d - b)) < 0.0 { [a, d, c, b] } else { [a, b, c, d] };
    let turned = [[a, b, c, d], [b, c, d, a], [c, d, a, b], [d, a, b, c]];
    let lowest = turned.into_iter().min_by(|p, q| (p[0].y + p[1].y).total_cmp(&(q[0].y + q[1].y)));
    lowest.unwrap_or([a, b, c, d])
}

/// Lengths of the bottom, right, top and left side, metres.
pub fn sides_m(corners: &Corners) -> [f64; 4] {
    [0, 1, 2, 3].map(|side| (corners[(side + 1) % 4] - corners[side]).norm())
}

/// Width and height, metres: means of opposite sides.
pub fn size_m(corners: &Corners) -> [f64; 2] {
    let [bottom, right, top, left] = sides_m(corners);
    [(bottom + top) / 2.0, (right + left) / 2.0]
}

/// Largest difference of opposite sides, share of their mean.
pub fn side_difference(corners: &Corners) -> f64 {
    let [bottom, right, top, left] = sides_m(corners);
    let [width_m, height_m] = size_m(corners);
    ((bottom - top).abs() / width_m).max((right - left).abs() / height_m)
}

/// Largest difference of an angle from 90°, degrees.
pub fn angle_difference_deg(corners: &Corners) -> f64 {
    let off = |corner: usize| {
        let (before, after) =
            (corners[(corner + 3) % 4] - corners[corner], corners[(corner + 1) % 4] - corners[corner]);
        (before.angle(&after).to_degrees() - 90.0).abs()
    };
    (0..4).map(off).fold(0.0, f64::max)
}

/// Angle by which the bottom and top edges rise to the right, radians.
pub fn tilt_rad(corners: &Corners) -> f64 {
    let along = (corners[1] - corners[0]) + (corners[2] - corners[3]);
    along.y.atan2(along.x)
}

/// Whether `point` lies in the convex quadrilateral `corners`.
pub fn contains(corners: &Corners, point: &Vector2<f64>) -> bool {
    let turns = [0, 1, 2, 3].map(|side| {
        let (start, end) = (corners[side], corners[(side + 1) % 4]);
        (end - start).perp(&(point - start)) >= 0.0
    });
    turns.iter().all(|left| *left) || turns.iter().all(|left| !left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_triangle_with_sides_3_4_5_has_area_6() {
        // As printed in the paper, Algorithm 3 gives 2.5.
        let corner = |x: f64, y: f64| Vector3::new(x, y, 7.0);
        let triangle = [corner(0.0, 0.0), corner(3.0, 0.0), corner(0.0, 4.0), corner(0.0, 4.0)];
        assert!((quad_area_m2(triangle) - 6.0).abs() < 1e-12);
    }

    #[test]
    fn a_banner_of_2_by_3_metres_has_6_square_metres() {
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]];
        assert!((quad_area_m2(corners.map(|[x, z]| Vector3::new(x, 5.0, z))) - 6.0).abs() < 1e-12);
        let corners = corners.map(Vector2::from);
        let [width_m, height_m] = size_m(&corners);
        assert!((width_m - 2.0).abs() < 1e-12 && (height_m - 3.0).abs() < 1e-12);
        assert!(angle_difference_deg(&corners) < 1e-9 && side_difference(&corners) < 1e-12);
    }

    #[test]
    fn corners_come_out_in_one_order_whatever_they_come_in() {
        let want = [[0.0, 0.0], [2.0, 0.1], [2.0, 3.0], [0.0, 3.0]].map(Vector2::from);
        for start in 0..4 {
            let turned = [0, 1, 2, 3].map(|corner| want[(corner + start) % 4]);
            let mirrored = [0, 1, 2, 3].map(|corner| want[(start + 4 - corner) % 4]);
            assert_eq!((in_order(turned), in_order(mirrored)), (want, want));
        }
    }
}
