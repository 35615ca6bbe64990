//! The plane of a region's points, and coordinates on it.

use nalgebra::{Matrix3, SymmetricEigen, Vector2, Vector3};

/// Triples of points tried.
const TRIALS: usize = 96;

/// A plane seen from the camera, which is the origin, with axes on it.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// A point on it, offset from the camera, metres.
    pub point: Vector3<f64>,
    /// Unit normal towards the camera.
    pub normal: Vector3<f64>,
    /// Unit vector to the right as seen from the camera's side; level.
    pub right: Vector3<f64>,
    /// Unit vector up the plane; away from the camera on a level one.
    pub up: Vector3<f64>,
}

impl Plane {
    /// The plane on which most of `points` lie within `tolerance_m`, fitted to those; `None` from fewer than three
    /// points, or when they lie on a line or in a plane through the camera.
    pub fn through(points: &[Vector3<f64>], tolerance_m: f64) -> Option<Self> {
        let mut best: Option<(usize, Vector3<f64>, Vector3<f64>)> = None;
        let mut state = 1u64;
        let mut draw = || {
            // Numerical Recipes' generator: the same triples every time.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            points.get(((state >> 33) as usize) % points.len().max(1)).copied()
        };
        for _ in 0..TRIALS {
            let (a, b, c) = (draw()?, draw()?, draw()?);
            let normal = (b - a).cross(&(c - a));
            if normal.norm() < 1e-9 {
                continue;
            }
            let normal = normal.normalize();
            let count = points.iter().filter(|p| (*p - a).dot(&normal).abs() <= tolerance_m).count();
            if best.is_none_or(|(most, ..)| count > most) {
                best = Some((count, a, normal));
            }
        }
        let (_, mut point, mut normal) = best?;
        for _ in 0..2 {
            let near: Vec<&Vector3<f64>> =
                points.iter().filter(|p| (*p - point).dot(&normal).abs() <= tolerance_m).collect();
            point = near.iter().copied().sum::<Vector3<f64>>() / near.len().max(1) as f64;
            let scatter: Matrix3<f64> = near.iter().map(|p| (*p - point) * (*p - point).transpose()).sum();
            let eigen = SymmetricEigen::new(scatter);
            normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        }
        Self::new(point, normal)
    }

    /// The plane through `point` with `normal` of either sense; `None` when it goes through the camera.
    pub fn new(point: Vector3<f64>, normal: Vector3<f64>) -> Option<Self> {
        let towards_camera = -point.dot(&normal).signum();
        let normal = normal * towards_camera;
        if point.dot(&normal).abs() < 1e-6 || !normal.iter().all(|x| x.is_finite()) {
            return None;
        }
        let vertical = Vector3::z();
        let level = normal.z.abs() > 0.99;
        // On a level plane "up" is away from the camera.
        let up = if level { Vector3::new(point.x, point.y, 0.0) } else { vertical };
        let up = (up - normal * up.dot(&normal)).try_normalize(1e-9).unwrap_or_else(|| normal.cross(&Vector3::x()));
        Some(Self { point, normal, right: up.cross(&normal), up })
    }

    /// Distance of `point`, metres, positive on the camera's side.
    pub fn distance_m(&self, point: &Vector3<f64>) -> f64 {
        (point - self.point).dot(&self.normal)
    }

    /// Where the ray from `eye` meets the plane; `None` when it does not.
    pub fn meet(&self, eye: &Vector3<f64>, direction: &Vector3<f64>) -> Option<Vector3<f64>> {
        let times = (self.point - eye).dot(&self.normal) / direction.dot(&self.normal);
        (times.is_finite() && times > 0.0).then(|| eye + direction * times)
    }

    /// Coordinates on the plane, right and up, metres.
    pub fn coordinates(&self, point: &Vector3<f64>) -> Vector2<f64> {
        let offset = point - self.point;
        Vector2::new(offset.dot(&self.right), offset.dot(&self.up))
    }

    /// The point at `coordinates`.
    pub fn at(&self, coordinates: &Vector2<f64>) -> Vector3<f64> {
        self.point + self.right * coordinates.x + self.up * coordinates.y
    }

    /// Whether it is a wall that stands upright.
    pub fn is_upright(&self) -> bool {
        self.normal.z.abs() < 0.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_of_wrong_points_does_not_tilt_the_plane() {
        let wall = (0..40).map(|i| Vector3::new(f64::from(i % 8), 20.0, f64::from(i / 8)));
        let wrong = (0..20).map(|i| Vector3::new(f64::from(i % 5), 30.0 + f64::from(i), f64::from(i / 5)));
        let plane = Plane::through(&wall.chain(wrong).collect::<Vec<_>>(), 0.05).unwrap();
        assert!((plane.normal - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-9);
        assert!((plane.right - Vector3::x()).norm() < 1e-9, "east is on the right when looking north");
        assert!((plane.up - Vector3::z()).norm() < 1e-9);
    }
}
