//! The shapes of descriptors: a rectangle just off its wall, a box on the ground.

use super::scene::Scene;
use nalgebra::Vector3;
use resurvey_schema::{DynamicDescriptor, MaterialDescriptor};

/// How far a rectangle lies off the surface it belongs to, metres: more than f32 rounding, less than anyone sees.
const LIFT_M: f64 = 0.02;
/// How far from the stored rectangle its surface is looked for, metres: stored corners carry the error of a pose and a
/// plane fit.
const REACH_M: f64 = 0.15;
/// Least |cosine| between the normals of a rectangle and its surface.
const MIN_COSINE: f64 = 0.7;

/// Corner offsets of one triangle.
type Triangle = [[f64; 3]; 3];

/// The rectangle of a material descriptor, moved along its normal until it lies 0.02 m in front of every surface of
/// the scene that runs along it within 0.15 m: stored corners a few centimetres behind the wall still show.
pub(super) fn on_wall(scene: &Scene, descriptor: &MaterialDescriptor) -> Vec<Triangle> {
    let corners = descriptor.corners.map(|corner| Vector3::from(scene.offset(corner)));
    let Some(normal) = normal(descriptor, &corners) else { return Vec::new() };
    let lift_m = outermost_surface_m(scene, &corners, normal).map_or(LIFT_M, |surface_m| (surface_m + LIFT_M).max(0.0));
    let [a, b, c, d] = corners.map(|corner| <[f64; 3]>::from(corner + normal * lift_m));
    vec![[a, b, c], [a, c, d]]
}

/// The box of a dynamic descriptor; its front is along its yaw, north when unknown.
pub(super) fn block(scene: &Scene, descriptor: &DynamicDescriptor) -> Vec<Triangle> {
    let [along_m, across_m, up_m] = descriptor.size_m;
    let (sin, cos) = descriptor.yaw_rad.unwrap_or(0.0).sin_cos();
    let along = Vector3::new(sin, cos, 0.0) * (along_m / 2.0);
    let across = Vector3::new(cos, -sin, 0.0) * (across_m / 2.0);
    let foot = Vector3::from(scene.offset(descriptor.position));
    let corner = |index: usize| -> [f64; 3] {
        let sign = |bit: usize| if index & bit == 0 { -1.0 } else { 1.0 };
        let up = if index & 4 == 0 { 0.0 } else { up_m };
        (foot + along * sign(1) + across * sign(2) + Vector3::z() * up).into()
    };
    const FACES: [[usize; 4]; 6] = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    FACES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]].map(|triangle| triangle.map(corner))).collect()
}

fn normal(descriptor: &MaterialDescriptor, corners: &[Vector3<f64>; 4]) -> Option<Vector3<f64>> {
    let stored = Vector3::from(descriptor.normal).try_normalize(1e-9);
    stored.or_else(|| (corners[2] - corners[0]).cross(&(corners[3] - corners[1])).try_normalize(1e-9))
}

/// Signed distance along `normal` from the rectangle to the outermost surface along it, at its centre and near its
/// corners.
fn outermost_surface_m(scene: &Scene, corners: &[Vector3<f64>; 4], normal: Vector3<f64>) -> Option<f64> {
    let centre = corners.iter().sum::<Vector3<f64>>() / 4.0;
    let mut probes = corners.map(|corner| corner + (centre - corner) * 0.1).to_vec();
    probes.push(centre);
    let low = probes.iter().fold(centre, |low, probe| low.inf(probe)).add_scalar(-REACH_M);
    let high = probes.iter().fold(centre, |high, probe| high.sup(probe)).add_scalar(REACH_M);
    let near = scene.clusters().iter().filter(|cluster| {
        (0..3).all(|axis| f64::from(cluster.min[axis]) <= high[axis] && f64::from(cluster.max[axis]) >= low[axis])
    });
    let triangles = near.flat_map(|cluster| &scene.positions()[cluster.triangles.clone()]);
    triangles
        .flat_map(|triangle| {
            let triangle = triangle.map(|corner| Vector3::from(corner.map(f64::from)));
            probes.iter().filter_map(move |probe| along_normal_m(&triangle, *probe, normal))
        })
        .max_by(f64::total_cmp)
}

/// Where the line from `probe` along `normal` meets a triangle that runs along the rectangle, metres.
fn along_normal_m([a, b, c]: &[Vector3<f64>; 3], probe: Vector3<f64>, normal: Vector3<f64>) -> Option<f64> {
    let facing = (b - a).cross(&(c - a)).try_normalize(1e-12)?;
    let cosine = facing.dot(&normal);
    if cosine.abs() < MIN_COSINE {
        return None;
    }
    let distance_m = facing.dot(&(a - probe)) / cosine;
    let foot = probe + normal * distance_m;
    let side = |from: &Vector3<f64>, to: &Vector3<f64>| (to - from).cross(&(foot - from)).dot(&facing) >= 0.0;
    (distance_m.abs() <= REACH_M && side(a, b) && side(b, c) && side(c, a)).then_some(distance_m)
}
