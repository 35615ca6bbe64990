//! From the scene's offsets to homogeneous pixels.
#![allow(clippy::needless_range_loop, reason = "lanes and axes: plain loops become vector code")]

use super::hierarchy::Bounds;
use super::scene::Scene;
use crate::camera::{Pinhole, camera_from_world, world_from_camera};
use nalgebra::{Matrix3, Vector3};
use resurvey_schema::Pose;

/// Least depth drawn, metres.
pub(super) const NEAR_M: f64 = 0.05;

/// Slack of the box around a triangle, pixels; its edges decide.
pub(super) const SLACK_PX: f64 = 1e-3;

/// A camera at a pose in a scene.
#[derive(Clone, Debug)]
pub(super) struct Projection {
    /// Takes offsets from `centre` to (u·z, v·z, z); rows.
    pixels_from_scene: [[f64; 3]; 3],
    /// Takes (u, v, 1) to the direction, E, N, H, whose depth is 1.
    pub(super) scene_from_pixels: Matrix3<f64>,
    /// The camera, offset from the scene's origin.
    pub(super) centre: Vector3<f64>,
    pub(super) width: f64,
    pub(super) height: f64,
    /// Linear forms that are positive inside: left, right, top, bottom; offsets from `centre`.
    sides: [[f64; 3]; 4],
}

/// Where a box is seen.
#[derive(Clone, Copy, Debug)]
pub(super) enum Seen {
    /// Nowhere in the image.
    Outside,
    /// Some of it passes the camera: it may be anywhere.
    Anywhere,
    /// Between these columns and rows, first and end, and no nearer than this inverse depth.
    Within { columns: [i32; 2], rows: [i32; 2], nearest: f32 },
}

impl Projection {
    pub(super) fn new(scene: &Scene, camera: &Pinhole, pose: &Pose) -> Self {
        let pixels_from_scene = camera.matrix() * camera_from_world(pose).matrix();
        let [u, v, z] = [0, 1, 2].map(|row| pixels_from_scene.row(row).transpose());
        let (width, height) = (f64::from(camera.width()), f64::from(camera.height()));
        Self {
            pixels_from_scene: [u, v, z].map(Into::into),
            scene_from_pixels: world_from_camera(pose).matrix() * camera.inverse(),
            centre: Vector3::from(scene.offset(pose.position)),
            width,
            height,
            sides: [u, z * width - u, v, z * height - v].map(Into::into),
        }
    }

    /// The camera, rounded offset from the scene's origin.
    pub(super) fn eye(&self) -> [f32; 3] {
        [self.centre.x as f32, self.centre.y as f32, self.centre.z as f32]
    }

    /// (u·z, v·z, z) of an offset from the scene's origin.
    #[inline(always)]
    pub(super) fn pixel(&self, [east, north, up]: [f64; 3]) -> [f64; 3] {
        let (east, north, up) = (east - self.centre.x, north - self.centre.y, up - self.centre.z);
        let [u, v, z] = &self.pixels_from_scene;
        let form = |row: &[f64; 3]| row[0] * east + row[1] * north + row[2] * up;
        [form(u), form(v), form(z)]
    }

    /// Where `bounds` is seen.
    #[inline(always)]
    pub(super) fn see(&self, bounds: &Bounds) -> Seen {
        let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            low[axis] = f64::from(bounds.min[axis]) - self.centre[axis];
            high[axis] = f64::from(bounds.max[axis]) - self.centre[axis];
        }
        let mut corners = [[0.0; 8]; 3];
        for k in 0..3 {
            let [east, north, up] = self.pixels_from_scene[k];
            let easts = [low[0] * east, high[0] * east];
            let norths = [low[1] * north, high[1] * north];
            let ups = [low[2] * up, high[2] * up];
            for corner in 0..8 {
                corners[k][corner] = easts[corner & 1] + norths[corner >> 1 & 1] + ups[corner >> 2];
            }
        }
        let [u, v, z] = &corners;
        if largest(z) < NEAR_M {
            return Seen::Outside;
        }
        let least_z = smallest(z);
        if least_z < NEAR_M {
            let mut outside = false;
            for side in &self.sides {
                outside |= reach(side, &low, &high) < 0.0;
            }
            return if outside { Seen::Outside } else { Seen::Anywhere };
        }
        let (mut columns, mut rows) = ([0.0; 8], [0.0; 8]);
        for corner in 0..8 {
            columns[corner] = u[corner] / z[corner];
            rows[corner] = v[corner] / z[corner];
        }
        let (columns, rows) = ([smallest(&columns), largest(&columns)], [smallest(&rows), largest(&rows)]);
        let misses = |[low, high]: [f64; 2], size: f64| high < -1.0 || low > size + 1.0;
        if misses(columns, self.width) || misses(rows, self.height) {
            return Seen::Outside;
        }
        // What is inside or near the image fits an i32, and anything else may be cut off.
        let range = |[low, high]: [f64; 2]| [low as i32 - 1, (high + 2.0) as i32];
        Seen::Within { columns: range(columns), rows: range(rows), nearest: (1.0 / least_z) as f32 }
    }
}

/// The largest value of a linear form in a box.
#[inline(always)]
fn reach(form: &[f64; 3], low: &[f64; 3], high: &[f64; 3]) -> f64 {
    let mut sum = 0.0;
    for axis in 0..3 {
        let (a, b) = (form[axis] * low[axis], form[axis] * high[axis]);
        sum += if a > b { a } else { b };
    }
    sum
}

#[inline(always)]
fn smallest(values: &[f64; 8]) -> f64 {
    let smaller = |a: f64, b: f64| if a < b { a } else { b };
    let mut halves = [0.0; 4];
    for k in 0..4 {
        halves[k] = smaller(values[k], values[k + 4]);
    }
    smaller(smaller(halves[0], halves[2]), smaller(halves[1], halves[3]))
}

#[inline(always)]
fn largest(values: &[f64; 8]) -> f64 {
    let larger = |a: f64, b: f64| if a > b { a } else { b };
    let mut halves = [0.0; 4];
    for k in 0..4 {
        halves[k] = larger(values[k], values[k + 4]);
    }
    larger(larger(halves[0], halves[2]), larger(halves[1], halves[3]))
}
