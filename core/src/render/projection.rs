//! From the scene's offsets to homogeneous pixels.

use super::edges::first_centre;
use super::scene::{Cluster, Scene};
use crate::camera::{Pinhole, camera_from_world, world_from_camera};
use nalgebra::{Matrix3, Vector3};
use resurvey_schema::Pose;
use std::ops::Range;

/// Least depth drawn, metres.
pub(super) const NEAR_M: f64 = 0.05;

/// Slack of the box around a triangle, pixels; its edges decide.
const SLACK_PX: f64 = 1e-3;

/// A camera at a pose in a scene.
#[derive(Clone, Debug)]
pub(super) struct Projection {
    /// Takes offsets from `centre` to (u·z, v·z, z).
    pixels_from_scene: Matrix3<f64>,
    /// Takes (u, v, 1) to the direction, E, N, H, whose depth is 1.
    pub(super) scene_from_pixels: Matrix3<f64>,
    /// The camera, offset from the scene's origin.
    pub(super) centre: Vector3<f64>,
    pub(super) width: f64,
    pub(super) height: f64,
    /// Rows are the linear forms that are positive inside: left, right, top, bottom; offsets from `centre`.
    sides: [Vector3<f64>; 4],
    forward: Vector3<f64>,
}

impl Projection {
    pub(super) fn new(scene: &Scene, camera: &Pinhole, pose: &Pose) -> Self {
        let pixels_from_scene = camera.matrix() * camera_from_world(pose).matrix();
        let [u, v, z] = [0, 1, 2].map(|row| pixels_from_scene.row(row).transpose());
        let (width, height) = (f64::from(camera.width()), f64::from(camera.height()));
        Self {
            pixels_from_scene,
            scene_from_pixels: world_from_camera(pose).matrix() * camera.inverse(),
            centre: Vector3::from(scene.offset(pose.position)),
            width,
            height,
            sides: [u, z * width - u, v, z * height - v],
            forward: z,
        }
    }

    /// (u·z, v·z, z) of a corner.
    pub(super) fn project(&self, corner: [f32; 3]) -> Vector3<f64> {
        self.pixels_from_scene * (Vector3::from(corner.map(f64::from)) - self.centre)
    }

    /// Rows that the triangle may cover; empty when it covers no pixel centre.
    pub(super) fn rows(&self, corners: &[Vector3<f64>; 3]) -> Range<usize> {
        if corners.iter().any(|corner| corner.z < NEAR_M) {
            return 0..self.height as usize;
        }
        let [a, b, c] = corners.map(|corner| corner.xy() / corner.z);
        let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
        let between =
            |low: f64, high: f64, size: f64| first_centre(low - SLACK_PX, size)..first_centre(high + SLACK_PX, size);
        if between(low.x, high.x, self.width).is_empty() { 0..0 } else { between(low.y, high.y, self.height) }
    }

    /// Whether some point of the triangle may be inside the image: not all corners lie beyond the same side.
    pub(super) fn may_see_triangle(&self, corners: &[Vector3<f64>; 3]) -> bool {
        let outside = |beyond: fn(&Self, &Vector3<f64>) -> bool| corners.iter().all(|corner| beyond(self, corner));
        !(outside(|_, corner| corner.z < NEAR_M)
            || outside(|_, corner| corner.x < 0.0)
            || outside(|_, corner| corner.y < 0.0)
            || outside(|view, corner| corner.x > view.width * corner.z)
            || outside(|view, corner| corner.y > view.height * corner.z))
    }

    /// Depth of the nearest point of a cluster's box, metres; `None` when all of it is outside the image.
    pub(super) fn nearest_depth_m(&self, cluster: &Cluster) -> Option<f64> {
        let low = Vector3::from(cluster.min.map(f64::from)) - self.centre;
        let high = Vector3::from(cluster.max.map(f64::from)) - self.centre;
        let largest = |form: &Vector3<f64>| form.component_mul(&low).sup(&form.component_mul(&high)).sum();
        let may_show = largest(&self.forward) >= NEAR_M && self.sides.iter().all(|side| largest(side) >= 0.0);
        may_show.then(|| -largest(&-self.forward))
    }
}
