//! The map as seen from a pose: class, range, point and feature per pixel from one ray each (Lee & Hsu, §3.5–3.8,
//! Eq. 6–14).

use super::projection::Projection;
use super::raster::Renderer;
use super::rays::RayCaster;
use super::scene::Scene;
use super::setup::Setup;
use crate::camera::{Camera, Pinhole, world_from_camera};
use crate::image::{LabelImage, Raster};
use nalgebra::Vector3;
use rayon::prelude::*;
use resurvey_schema::{GridPoint, Pose};

/// What one ray per pixel hits first.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Where the offsets in `points` start.
    pub origin: GridPoint,
    /// Class per pixel; where the ray hits nothing the class named `sky`, void when the table has none.
    pub labels: LabelImage,
    /// Distance along the ray, metres; infinite where the ray hits nothing.
    pub range_m: Raster<f32>,
    /// Point hit, offset from `origin`, E, N, H, metres; NaN where the ray hits nothing.
    pub points: Raster<[f32; 3]>,
    /// 0 for the base map and sky, otherwise 1 + index into the scene's feature table.
    pub features: Raster<u32>,
}

/// One row of a view.
struct Row<'a> {
    labels: &'a mut [u8],
    range_m: &'a mut [f32],
    points: &'a mut [[f32; 3]],
    features: &'a mut [u32],
}

/// The scene as `camera` sees it from `pose`. Pinhole cameras are rasterised, others cast a ray per pixel.
pub fn view(scene: &Scene, camera: &Camera, pose: &Pose) -> View {
    match camera.pinhole() {
        Some(pinhole) => rasterised(scene, &pinhole, pose),
        None => cast(scene, camera, pose),
    }
}

impl View {
    fn empty(scene: &Scene, width: u32, height: u32) -> Self {
        Self {
            origin: scene.origin(),
            labels: LabelImage::filled(width, height, scene.sky().0),
            range_m: Raster::filled(width, height, f32::INFINITY),
            points: Raster::filled(width, height, [f32::NAN; 3]),
            features: Raster::filled(width, height, 0),
        }
    }

    /// Lets `write` fill the rows, in parallel.
    fn fill(&mut self, write: impl Fn(usize, Row) + Sync) {
        let width = (self.labels.width() as usize).max(1);
        (self.labels.values_mut().par_chunks_mut(width))
            .zip(self.range_m.values_mut().par_chunks_mut(width))
            .zip(self.points.values_mut().par_chunks_mut(width))
            .zip(self.features.values_mut().par_chunks_mut(width))
            .enumerate()
            .for_each(|(v, (((labels, range_m), points), features))| {
                write(v, Row { labels, range_m, points, features });
            });
    }
}

fn rasterised(scene: &Scene, camera: &Pinhole, pose: &Pose) -> View {
    let projection = Projection::new(scene, camera, pose);
    let mut renderer = Renderer::new();
    let mut view = View::empty(scene, camera.width(), camera.height());
    renderer.draw(scene, camera, &projection);
    renderer.shade(scene, &projection, &mut view.labels);
    view.fill(|v, row| {
        for (first, length, setup) in renderer.runs(v) {
            let run = first..first + length;
            row.features[run.clone()].fill(scene.feature(setup.triangle as usize));
            intersect(&projection, setup, [first, v], &mut row.range_m[run.clone()], &mut row.points[run]);
        }
    });
    view
}

/// Range and point of the exact intersection of the triangle's plane with the rays of the pixels from column `u`, row
/// `v` on.
fn intersect(
    projection: &Projection,
    setup: &Setup,
    [u, v]: [usize; 2],
    ranges_m: &mut [f32],
    points: &mut [[f32; 3]],
) {
    let y = v as f64 + 0.5;
    let per_column = projection.scene_from_pixels.column(0).into_owned();
    let first_direction = projection.scene_from_pixels * Vector3::new(u as f64 + 0.5, y, 1.0);
    let [step, _, _] = setup.inverse_depth;
    let start = setup.inverse_depth_at(u as f64 + 0.5, y);
    for (index, (range_m, point)) in ranges_m.iter_mut().zip(points).enumerate() {
        let along = f64::from(index as i32);
        let direction = first_direction + per_column * along;
        let depth_m = 1.0 / (start + step * along);
        *range_m = (direction.norm() * depth_m) as f32;
        let offset = projection.centre + direction * depth_m;
        *point = [offset.x as f32, offset.y as f32, offset.z as f32];
    }
}

/// Range from which a ray looks, metres; the counterpart of the rasteriser's least depth.
const FIRST_RANGE_M: f64 = super::projection::NEAR_M;

fn cast(scene: &Scene, camera: &Camera, pose: &Pose) -> View {
    let caster = RayCaster::new(scene);
    let world_from_camera = world_from_camera(pose);
    let mut view = View::empty(scene, camera.width(), camera.height());
    view.fill(|v, row| {
        for u in 0..camera.width() {
            let Some(ray) = camera.ray(f64::from(u) + 0.5, v as f64 + 0.5) else { continue };
            let direction = world_from_camera * ray;
            let start = Vector3::from(scene.offset(pose.position)) + direction * FIRST_RANGE_M;
            let Some(hit) = caster.cast(scene.point(start.into()), direction.into(), f64::INFINITY) else { continue };
            let u = u as usize;
            row.labels[u] = hit.class.0;
            row.range_m[u] = (hit.range_m + FIRST_RANGE_M) as f32;
            row.points[u] = scene.offset(hit.point).map(|value| value as f32);
            row.features[u] = hit.feature;
        }
    });
    view
}
