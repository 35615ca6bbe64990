//! The pinhole camera of the captures, written down once more from the conventions.

use super::world::Offset;

/// A camera at a pose. Angles in radians; yaw clockwise from grid north, pitch up, roll right side down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal length, pixels; pixels are square and the principal point is the centre.
    pub focal_px: f64,
    /// Centre of projection, from the scene's origin.
    pub position: Offset,
    /// Heading.
    pub yaw_rad: f64,
    /// Elevation.
    pub pitch_rad: f64,
    /// Rotation about the optical axis.
    pub roll_rad: f64,
}

/// Right, down and forward as unit vectors: east, north, up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Towards higher columns.
    pub right: Offset,
    /// Towards higher rows.
    pub down: Offset,
    /// The optical axis.
    pub forward: Offset,
}

impl Camera {
    /// Focal length of the 960×720 image whose diagonal spans 120°, rounded as in the captures.
    pub const FOCAL_PX: f64 = 346.410_162;

    /// The paper's camera at `position`.
    pub fn new(position: Offset, [yaw_rad, pitch_rad, roll_rad]: [f64; 3]) -> Self {
        Self { width: 960, height: 720, focal_px: Self::FOCAL_PX, position, yaw_rad, pitch_rad, roll_rad }
    }

    /// The same view with a tenth of the columns and rows, for a quick look.
    pub fn tenth(&self) -> Self {
        Self { width: self.width / 10, height: self.height / 10, focal_px: self.focal_px / 10.0, ..*self }
    }

    /// The camera's axes in the scene.
    pub fn axes(&self) -> Axes {
        let (sin_yaw, cos_yaw) = self.yaw_rad.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch_rad.sin_cos();
        let (sin_roll, cos_roll) = self.roll_rad.sin_cos();
        let forward = [sin_yaw * cos_pitch, cos_yaw * cos_pitch, sin_pitch];
        let level_right = [cos_yaw, -sin_yaw, 0.0];
        let level_down = cross(forward, level_right);
        let mix = |a: f64, b: f64| [0, 1, 2].map(|i| a * level_right[i] + b * level_down[i]);
        Axes { right: mix(cos_roll, sin_roll), down: mix(-sin_roll, cos_roll), forward }
    }

    /// Direction through pixel coordinates `u`, `v`, scaled so that its length along the optical axis is 1.
    pub fn ray(&self, axes: &Axes, u: f64, v: f64) -> Offset {
        let x = (u - f64::from(self.width) / 2.0) / self.focal_px;
        let y = (v - f64::from(self.height) / 2.0) / self.focal_px;
        [0, 1, 2].map(|i| axes.forward[i] + x * axes.right[i] + y * axes.down[i])
    }

    /// Pixel coordinates of a point; `None` behind the camera.
    pub fn pixel(&self, axes: &Axes, point: Offset) -> Option<[f64; 2]> {
        let offset = subtract(point, self.position);
        let depth = dot(offset, axes.forward);
        (depth > 0.05).then(|| {
            let u = self.focal_px * dot(offset, axes.right) / depth + f64::from(self.width) / 2.0;
            let v = self.focal_px * dot(offset, axes.down) / depth + f64::from(self.height) / 2.0;
            [u, v]
        })
    }

    /// Whether pixel coordinates lie inside the image by at least `margin_px`.
    pub fn holds(&self, [u, v]: [f64; 2], margin_px: f64) -> bool {
        u >= margin_px
            && v >= margin_px
            && u <= f64::from(self.width) - margin_px
            && v <= f64::from(self.height) - margin_px
    }
}

/// Cross product.
pub fn cross(a: Offset, b: Offset) -> Offset {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Dot product.
pub fn dot(a: Offset, b: Offset) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a − b`.
pub fn subtract(a: Offset, b: Offset) -> Offset {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Distance between two points, metres.
pub fn distance_m(a: Offset, b: Offset) -> f64 {
    let offset = subtract(a, b);
    dot(offset, offset).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_camera_that_looks_east_sees_north_on_its_left() {
        let camera = Camera::new([0.0; 3], [90_f64.to_radians(), 0.0, 0.0]);
        let axes = camera.axes();
        let [u, v] = camera.pixel(&axes, [10.0, 5.0, 0.0]).unwrap();
        assert!((u - (480.0 - 346.410_162 / 2.0)).abs() < 1e-9 && (v - 360.0).abs() < 1e-9);
    }

    #[test]
    fn pitch_up_moves_the_horizon_down_and_roll_puts_the_right_side_down() {
        let horizon = |pitch: f64, roll: f64| {
            let camera = Camera::new([0.0; 3], [0.0, pitch, roll]);
            camera.pixel(&camera.axes(), [0.0, 100.0, 0.0]).unwrap()
        };
        assert!((horizon(0.1, 0.0)[1] - (360.0 + 346.410_162 * 0.1_f64.tan())).abs() < 1e-9);
        // With the right side of the camera down, things on the right appear higher in the image.
        let camera = Camera::new([0.0; 3], [0.0, 0.0, 0.1]);
        assert!(camera.pixel(&camera.axes(), [10.0, 100.0, 0.0]).unwrap()[1] < 360.0);
    }

    #[test]
    fn ray_and_pixel_are_inverse() {
        let camera = Camera::new([3.0, -2.0, 1.6], [1.0, 0.2, -0.05]);
        let axes = camera.axes();
        let ray = camera.ray(&axes, 123.25, 456.5);
        let point = [0, 1, 2].map(|i| camera.position[i] + 17.0 * ray[i]);
        let [u, v] = camera.pixel(&axes, point).unwrap();
        assert!((u - 123.25).abs() < 1e-9 && (v - 456.5).abs() < 1e-9);
    }
}
