//! The pinhole camera of `docs/architecture.md`: x right, y down, z forward; yaw clockwise from grid north, pitch up,
//! roll right side down.

use resurvey_schema::{CameraModel, GridPoint, Intrinsics, Pose};

/// A pinhole camera at a pose.
#[derive(Clone, Copy, Debug)]
pub struct ToyCamera {
    /// Its intrinsics; the model is taken to be pinhole.
    pub intrinsics: Intrinsics,
    /// Where it is.
    pub pose: Pose,
    axes: [[f64; 3]; 3],
}

impl ToyCamera {
    /// The camera with `intrinsics` at `pose`.
    pub fn new(intrinsics: Intrinsics, pose: Pose) -> Self {
        let (sin_y, cos_y) = pose.yaw_rad.sin_cos();
        let (sin_p, cos_p) = pose.pitch_rad.sin_cos();
        let (sin_r, cos_r) = pose.roll_rad.sin_cos();
        let forward = [sin_y * cos_p, cos_y * cos_p, sin_p];
        let right0 = [cos_y, -sin_y, 0.0];
        let down0 = cross(forward, right0);
        let right = add(scale(right0, cos_r), scale(down0, sin_r));
        let down = add(scale(right0, -sin_r), scale(down0, cos_r));
        Self { intrinsics, pose, axes: [right, down, forward] }
    }

    /// A camera image of `width` × `height` with square pixels, centred, with `diagonal_fov_deg` over the diagonal.
    pub fn intrinsics(width: u32, height: u32, diagonal_fov_deg: f64) -> Intrinsics {
        let (w, h) = (f64::from(width), f64::from(height));
        let focal = w.hypot(h) / 2.0 / (diagonal_fov_deg / 2.0).to_radians().tan();
        Intrinsics {
            model: CameraModel::Pinhole,
            width,
            height,
            fx: focal,
            fy: focal,
            cx: w / 2.0,
            cy: h / 2.0,
            distortion: [0.0; 5],
        }
    }

    /// Direction (E, N, H) of the ray through pixel coordinates, one unit deep along the optical axis.
    pub fn ray_at_unit_depth(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        let [right, down, forward] = self.axes;
        let (x, y) = ((u - self.intrinsics.cx) / self.intrinsics.fx, (v - self.intrinsics.cy) / self.intrinsics.fy);
        add(forward, add(scale(right, x), scale(down, y)))
    }

    /// Pixel coordinates of `point`; `None` when it is behind the camera.
    pub fn project(&self, point: GridPoint) -> Option<[f64; 2]> {
        let to_point = between(self.pose.position, point);
        let [x, y, depth_m] = self.axes.map(|axis| dot(axis, to_point));
        let camera = &self.intrinsics;
        (depth_m > 1e-9).then(|| [camera.fx * x / depth_m + camera.cx, camera.fy * y / depth_m + camera.cy])
    }
}

/// From `start` to `end`, E, N, H, metres.
pub(super) fn between(start: GridPoint, end: GridPoint) -> [f64; 3] {
    [end.easting_m - start.easting_m, end.northing_m - start.northing_m, end.height_m - start.height_m]
}

/// The point `offset` from `start`.
pub(super) fn offset(start: GridPoint, offset: [f64; 3]) -> GridPoint {
    GridPoint::new(start.easting_m + offset[0], start.northing_m + offset[1], start.height_m + offset[2])
}

pub(super) fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn scale(a: [f64; 3], factor: f64) -> [f64; 3] {
    a.map(|x| x * factor)
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
