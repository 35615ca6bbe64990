//! From a cloud of contour points to a first quadrilateral: the convex hull, and the four of its edges that enclose it
//! most tightly.

use nalgebra::Vector2;

/// Convex hull, counter-clockwise where y points up, without points on its edges (Andrew 1979).
pub fn convex_hull(points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let mut sorted: Vec<Vector2<f64>> = points.iter().copied().filter(|p| p.x.is_finite() && p.y.is_finite()).collect();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    let half = |points: &mut dyn Iterator<Item = &Vector2<f64>>| {
        let mut chain: Vec<Vector2<f64>> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && turn(&a, &b, point) <= 0.0
            {
                chain.pop();
            }
            chain.push(*point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut sorted.iter());
    hull.extend(half(&mut sorted.iter().rev()));
    hull
}

/// Twice the signed area of the triangle `abc`.
fn turn(a: &Vector2<f64>, b: &Vector2<f64>, c: &Vector2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

/// A quadrilateral around `hull`, in its order: edges are dropped one by one, each time the one whose neighbours,
/// extended until they meet, add the least area. A corner that something hides or rounds off comes back. `None` for a
/// hull of fewer than four corners or no area.
pub fn enclosing_quad(hull: &[Vector2<f64>]) -> Option<[Vector2<f64>; 4]> {
    let mut corners = hull.to_vec();
    while corners.len() > 4 {
        let count = corners.len();
        let (edge, corner, _) = (0..count)
            .filter_map(|edge| {
                let [before, start, end, after] = [count - 1, 0, 1, 2].map(|step| corners[(edge + step) % count]);
                let corner = intersection(&before, &(start - before), &end, &(after - end))?;
                let added = turn(&start, &corner, &end);
                // The corner lies beyond the edge, where both neighbours go.
                let beyond =
                    (corner - start).dot(&(start - before)) >= 0.0 && (corner - end).dot(&(end - after)) >= 0.0;
                (beyond && added >= 0.0).then_some((edge, corner, added))
            })
            .min_by(|(_, _, a), (_, _, b)| a.total_cmp(b))?;
        corners[edge] = corner;
        corners.remove((edge + 1) % count);
    }
    <[Vector2<f64>; 4]>::try_from(corners).ok().filter(|corners| quad_area(corners).abs() > 1.0)
}

/// Where two lines meet, each a point and a direction; `None` when they are nearly parallel.
pub fn intersection(
    a: &Vector2<f64>,
    along_a: &Vector2<f64>,
    b: &Vector2<f64>,
    along_b: &Vector2<f64>,
) -> Option<Vector2<f64>> {
    let sine = along_a.perp(along_b);
    let scale = along_a.norm() * along_b.norm();
    (sine.abs() > 1e-3 * scale).then(|| a + along_a * ((b - a).perp(along_b) / sine))
}

/// Signed area of a quadrilateral in the plane.
pub fn quad_area([a, b, c, d]: &[Vector2<f64>; 4]) -> f64 {
    (c - a).perp(&(d - b)) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_with_a_corner_cut_off_is_given_it_back() {
        let points = [[0.0, 0.0], [60.0, 0.0], [60.0, 40.0], [10.0, 40.0], [0.0, 32.0]].map(Vector2::from);
        let quad = enclosing_quad(&convex_hull(&points)).unwrap();
        assert!((quad_area(&quad) - 2400.0).abs() < 1e-9);
        assert!(quad.iter().any(|corner| (corner - Vector2::new(0.0, 40.0)).norm() < 1e-9));
    }

    #[test]
    fn points_on_a_line_have_no_quadrilateral() {
        let points: Vec<_> = (0..9).map(|x| Vector2::new(f64::from(x), 0.0)).collect();
        assert!(enclosing_quad(&convex_hull(&points)).is_none());
    }
}
