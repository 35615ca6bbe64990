//! The map as seen from a pose: class, range, point and feature per pixel from one ray each (Lee & Hsu, §3.5–3.8,
//! Eq. 6–14).

use super::projection::Projection;
use super::raster::Renderer;
use super::rays::RayCaster;
use super::scene::Scene;
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

/// One pixel of a view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixel {
    pub(super) class: u8,
    pub(super) range_m: f32,
    pub(super) point: [f32; 3],
    pub(super) feature: u32,
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

    /// Sets every pixel to what `pixel` finds, in parallel by rows.
    fn fill<R: IntoIterator<Item = Option<Pixel>>>(&mut self, row: impl Fn(usize) -> R + Sync) {
        let width = (self.labels.width() as usize).max(1);
        (self.labels.values_mut().par_chunks_mut(width))
            .zip(self.range_m.values_mut().par_chunks_mut(width))
            .zip(self.points.values_mut().par_chunks_mut(width))
            .zip(self.features.values_mut().par_chunks_mut(width))
            .enumerate()
            .for_each(|(v, (((labels, ranges), points), features))| {
                for (u, pixel) in row(v).into_iter().enumerate().take(width) {
                    let Some(pixel) = pixel else { continue };
                    labels[u] = pixel.class;
                    ranges[u] = pixel.range_m;
                    points[u] = pixel.point;
                    features[u] = pixel.feature;
                }
            });
    }
}

fn rasterised(scene: &Scene, camera: &Pinhole, pose: &Pose) -> View {
    let projection = Projection::new(scene, camera, pose);
    let mut renderer = Renderer::new();
    let mut view = View::empty(scene, camera.width(), camera.height());
    renderer.draw(scene, camera, &projection);
    renderer.shade(scene, &projection, &mut view.labels);
    let labels = view.labels.clone();
    view.fill(|v| {
        let (projection, labels) = (&projection, labels.row(v as u32));
        renderer.row(v).enumerate().map(move |(u, setup)| {
            let setup = setup?;
            let (x, y) = (u as f64 + 0.5, v as f64 + 0.5);
            // The exact intersection of the ray with the triangle's plane.
            let direction = projection.scene_from_pixels * Vector3::new(x, y, 1.0);
            let depth_m = 1.0 / setup.inverse_depth_at(x, y);
            let point = projection.centre + direction * depth_m;
            Some(Pixel {
                class: labels[u],
                range_m: (direction.norm() * depth_m) as f32,
                point: [point.x as f32, point.y as f32, point.z as f32],
                feature: scene.feature(setup.triangle as usize),
            })
        })
    });
    view
}

/// Range from which a ray looks, metres; the counterpart of the rasteriser's least depth.
const FIRST_RANGE_M: f64 = super::projection::NEAR_M;

fn cast(scene: &Scene, camera: &Camera, pose: &Pose) -> View {
    let caster = RayCaster::new(scene);
    let world_from_camera = world_from_camera(pose);
    let mut view = View::empty(scene, camera.width(), camera.height());
    view.fill(|v| {
        let caster = &caster;
        (0..camera.width()).map(move |u| {
            let direction = world_from_camera * camera.ray(f64::from(u) + 0.5, v as f64 + 0.5)?;
            let start = Vector3::from(scene.offset(pose.position)) + direction * FIRST_RANGE_M;
            let hit = caster.cast(scene.point(start.into()), direction.into(), f64::INFINITY)?;
            let [x, y, z] = scene.offset(hit.point);
            Some(Pixel {
                class: hit.class.0,
                range_m: (hit.range_m + FIRST_RANGE_M) as f32,
                point: [x as f32, y as f32, z as f32],
                feature: hit.feature,
            })
        })
    });
    view
}
