//! From the scene's offsets to homogeneous pixels.

use super::scene::{Cluster, Scene};
use crate::camera::{Pinhole, camera_from_world, world_from_camera};
use nalgebra::{Matrix3, Vector3};
use resurvey_schema::Pose;

/// Least depth drawn, metres.
pub(super) const NEAR_M: f64 = 0.05;

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

    /// Whether some point of the triangle may be inside the image: not all corners lie beyond the same side.
    pub(super) fn may_see_triangle(&self, corners: &[Vector3<f64>; 3]) -> bool {
        let outside = |beyond: fn(&Self, &Vector3<f64>) -> bool| corners.iter().all(|corner| beyond(self, corner));
        !(outside(|_, corner| corner.z < NEAR_M)
            || outside(|_, corner| corner.x < 0.0)
            || outside(|_, corner| corner.y < 0.0)
            || outside(|view, corner| corner.x > view.width * corner.z)
            || outside(|view, corner| corner.y > view.height * corner.z))
    }

    /// The same for the box of a cluster.
    pub(super) fn may_see(&self, cluster: &Cluster) -> bool {
        let low = Vector3::from(cluster.min.map(f64::from)) - self.centre;
        let high = Vector3::from(cluster.max.map(f64::from)) - self.centre;
        let largest = |form: &Vector3<f64>| form.component_mul(&low).sup(&form.component_mul(&high)).sum();
        largest(&self.forward) >= NEAR_M && self.sides.iter().all(|side| largest(side) >= 0.0)
    }
}
