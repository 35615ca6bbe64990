//! Brown's radial and tangential distortion (Brown 1966), as OpenCV's `projectPoints` has it.

/// Steps of the two-dimensional Newton iteration; it converges quadratically from the radial solution.
const MAX_NEWTON_STEPS: usize = 30;
/// Residual below which an undistorted point counts as found, in units of the focal length: 1e-8 px at f = 1000 px.
const TOLERANCE: f64 = 1e-11;

/// Distortion of normalised image coordinates, with the radius up to which it can be inverted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Brown {
    k: [f64; 3],
    p: [f64; 2],
    /// Largest radius before the radial polynomial turns back; infinite when it never does.
    max_radius: f64,
}

impl Brown {
    /// The model of k1 k2 p1 p2 k3.
    pub(super) fn new([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        let max_radius = super::model::first_descent(|r| {
            let s = r * r;
            1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * 7.0 * k3))
        });
        Self { k: [k1, k2, k3], p: [p1, p2], max_radius }
    }

    /// Where (x, y) = (X/Z, Y/Z) appears; `None` beyond the invertible radius.
    pub(super) fn distort(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        (x.hypot(y) < self.max_radius).then(|| self.distort_unchecked([x, y]))
    }

    fn distort_unchecked(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let s = x * x + y * y;
        let radial = self.radial(s);
        let [p1, p2] = self.p;
        [x * radial + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x), y * radial + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y]
    }

    /// The point that [`distort`](Self::distort) takes to (x, y); `None` where none is found inside the invertible
    /// radius.
    pub(super) fn undistort(&self, target: [f64; 2]) -> Option<[f64; 2]> {
        let mut point = self.undistort_radially(target)?;
        for _ in 0..MAX_NEWTON_STEPS {
            let found = self.distort_unchecked(point);
            let residual = [found[0] - target[0], found[1] - target[1]];
            if residual[0].abs().max(residual[1].abs()) < TOLERANCE {
                return (point[0].hypot(point[1]) < self.max_radius).then_some(point);
            }
            let [[a, b], [c, d]] = self.jacobian(point);
            let determinant = a * d - b * c;
            point[0] -= (d * residual[0] - b * residual[1]) / determinant;
            point[1] -= (a * residual[1] - c * residual[0]) / determinant;
        }
        None
    }

    /// The solution without tangential terms, which are small.
    fn undistort_radially(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let distorted = x.hypot(y);
        if distorted < f64::MIN_POSITIVE {
            return Some([0.0, 0.0]);
        }
        let radius = match super::model::invert_rising(|r| r * self.radial(r * r), distorted, self.max_radius) {
            Some(radius) => radius,
            // A target just outside the radial range can be inside once the tangential terms are added.
            None if self.max_radius.is_finite() => self.max_radius * 0.999,
            None => return None,
        };
        Some([x / distorted * radius, y / distorted * radius])
    }

    fn radial(&self, s: f64) -> f64 {
        1.0 + s * (self.k[0] + s * (self.k[1] + s * self.k[2]))
    }

    fn jacobian(&self, [x, y]: [f64; 2]) -> [[f64; 2]; 2] {
        let s = x * x + y * y;
        let radial = self.radial(s);
        let slope = 2.0 * (self.k[0] + s * (2.0 * self.k[1] + s * 3.0 * self.k[2]));
        let [p1, p2] = self.p;
        let mixed = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y;
        [
            [radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, mixed],
            [mixed, radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x],
        ]
    }
}
