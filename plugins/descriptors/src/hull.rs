//! From a cloud of contour points to a first quadrilateral: the convex hull, and the four of its edges that enclose it
//! most tightly.

use nalgebra::Vector2;

/// Rounding of products of lengths, pixels².
const ROUNDING_PX2: f64 = 1e-6;
/// Sine of the angle under which two lines are parallel: jitter leaves edges that bend by less than a minute.
const PARALLEL: f64 = 1e-9;

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
                let (along_before, along_after) = (start - before, after - end);
                // Neighbours that go on straight meet anywhere on the edge between them.
                let straight = (along_before.dot(&along_after) > 0.0).then(|| (start + end) / 2.0);
                let corner = intersection(&before, &along_before, &end, &along_after).or(straight)?;
                let added = turn(&start, &corner, &end);
                // The corner lies beyond the edge, where both neighbours go.
                let is_beyond = (corner - start).dot(&along_before) >= -ROUNDING_PX2
                    && (corner - end).dot(&along_after) <= ROUNDING_PX2;
                (is_beyond && added >= -ROUNDING_PX2).then_some((edge, corner, added))
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
    (sine.abs() > PARALLEL * scale).then(|| a + along_a * ((b - a).perp(along_b) / sine))
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

    /// Contour of a rectangle of pixels with a wavy edge, as a wide lens shows it: rows of points that are straight but
    /// for rounding.
    fn wavy_contour(seed: u32) -> Vec<Vector2<f64>> {
        let wave = |along: f64, side: u32| {
            let phase = f64::from(seed * 4 + side);
            (3.0 * ((along / 11.0 + phase * 1.7).sin() + (along / 29.0 + phase * 2.9).sin())).round()
        };
        let steps = |length: i32| (0..length).map(f64::from);
        let across = steps(170).flat_map(|x| [Vector2::new(x, wave(x, 0)), Vector2::new(x, 110.0 + wave(x, 1))]);
        let up = steps(110).flat_map(|y| [Vector2::new(wave(y, 2), y), Vector2::new(170.0 + wave(y, 3), y)]);
        let slanted = |p: Vector2<f64>| Vector2::new(p.x - 0.2 * p.y, p.y + 0.3 * p.x) / (1.0 + 0.001 * p.x);
        across.chain(up).map(slanted).collect()
    }

    #[test]
    fn wavy_sides_that_go_on_nearly_straight_are_four() {
        // What broke a banner of the Kowloon captures: the neighbours of an edge in such a row passed for parallel, it
        // could not be dropped, and a true side was.
        for seed in 0..200 {
            let hull = convex_hull(&wavy_contour(seed));
            let area = (0..hull.len()).map(|i| hull[i].perp(&hull[(i + 1) % hull.len()])).sum::<f64>() / 2.0;
            let quad = enclosing_quad(&hull).unwrap_or_else(|| panic!("no quadrilateral for seed {seed}"));
            assert!(quad_area(&quad) < 1.2 * area, "seed {seed}: {quad:?} for {area} px2");
        }
    }

    #[test]
    fn points_on_a_line_have_no_quadrilateral() {
        let points: Vec<_> = (0..9).map(|x| Vector2::new(f64::from(x), 0.0)).collect();
        assert!(enclosing_quad(&convex_hull(&points)).is_none());
    }
}
