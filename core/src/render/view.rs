//! The map as seen from a pose: class, range, point and feature per pixel from one ray each (Lee & Hsu, §3.5–3.8,
//! Eq. 6–14).

use super::band::{Band, LANES};
use super::code::Code;
use super::painter::{Painter, Triangles};
use super::projection::Projection;
use super::rays::RayCaster;
use super::scene::Scene;
use super::shade::Shader;
use crate::camera::{Camera, Pinhole, world_from_camera};
use crate::image::{LabelImage, Raster};
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};
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

/// Neighbouring rows of a view.
struct Rows<'a> {
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

    /// Index of the first of every `count` rows, and what they hold.
    fn rows(&mut self, count: usize) -> impl IndexedParallelIterator<Item = (usize, Rows<'_>)> {
        let pixels = (self.labels.width() as usize * count).max(1);
        (self.labels.values_mut().par_chunks_mut(pixels))
            .zip(self.range_m.values_mut().par_chunks_mut(pixels))
            .zip(self.points.values_mut().par_chunks_mut(pixels))
            .zip(self.features.values_mut().par_chunks_mut(pixels))
            .enumerate()
            .map(move |(index, (((labels, range_m), points), features))| {
                (index * count, Rows { labels, range_m, points, features })
            })
    }
}

impl Rows<'_> {
    /// The part of them that a band holds, which begins `first_pixel` in.
    fn of_band(&mut self, first_pixel: usize, band: &Band) -> Rows<'_> {
        let part = first_pixel..first_pixel + band.rows() * band.width();
        Rows {
            labels: &mut self.labels[part.clone()],
            range_m: &mut self.range_m[part.clone()],
            points: &mut self.points[part.clone()],
            features: &mut self.features[part],
        }
    }
}

/// Rows that one thread works on at once.
const TOGETHER: usize = 96;

fn rasterised(scene: &Scene, camera: &Pinhole, pose: &Pose) -> View {
    let projection = Projection::new(scene, camera, pose);
    let mut view = View::empty(scene, camera.width(), camera.height());
    let start = || (Painter::new(Arch::new()), Shader::default());
    view.rows(TOGETHER).for_each_init(start, |(painter, shader), (first_row, mut rows)| {
        shader.start();
        let end_row = first_row + rows.labels.len() / camera.width() as usize;
        painter.draw(scene, Triangles::All, &projection, first_row..end_row, |arch, band| {
            let rows = rows.of_band((band.first_row() - first_row) * band.width(), band);
            shader.fill(arch, scene, &projection, band, rows.labels);
            arch.dispatch(Measure { scene, projection: &projection, band, rows });
        });
    });
    view
}

/// Ranges, points and features of the pixels of a band.
struct Measure<'a> {
    scene: &'a Scene,
    projection: &'a Projection,
    band: &'a Band,
    rows: Rows<'a>,
}

impl WithSimd for Measure<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { scene, projection, band, rows } = self;
        let width = band.width();
        for row in 0..band.rows() {
            let codes = band.row(row).iter().flat_map(|block| &block.codes);
            let features = &mut rows.features[row * width..(row + 1) * width];
            let (mut last, mut last_feature) = (u32::MAX, 0);
            for (feature, &code) in features.iter_mut().zip(codes) {
                if code != last {
                    last = code;
                    last_feature = Code(code).triangle().map_or(0, |triangle| scene.feature(triangle as usize));
                }
                *feature = last_feature;
            }
            for (block, seen) in band.row(row).iter().enumerate() {
                let first = block * LANES;
                let pixels = row * width + first..row * width + (first + LANES).min(width);
                let at = [first, band.first_row() + row];
                let inverse_depths = &seen.inverse_depths;
                measure(projection, at, inverse_depths, &mut rows.range_m[pixels.clone()], &mut rows.points[pixels]);
            }
        }
    }
}

/// Ranges and points of the pixels from column `u`, row `v` on, from the depths along the optical axis.
#[inline(always)]
fn measure(
    projection: &Projection,
    [u, v]: [usize; 2],
    inverse_depths: &[f32; LANES],
    ranges_m: &mut [f32],
    points: &mut [[f32; 3]],
) {
    let per_column = projection.scene_from_pixels.column(0);
    let first_direction = projection.scene_from_pixels * Vector3::new(u as f64 + 0.5, v as f64 + 0.5, 1.0);
    for (lane, (range_m, point)) in ranges_m.iter_mut().zip(points).enumerate() {
        if inverse_depths[lane] > 0.0 {
            let depth_m = 1.0 / f64::from(inverse_depths[lane]);
            let offset_m: [f64; 3] =
                std::array::from_fn(|axis| (first_direction[axis] + per_column[axis] * lane as f64) * depth_m);
            *range_m = offset_m.iter().map(|value| value * value).sum::<f64>().sqrt() as f32;
            *point = std::array::from_fn(|axis| (projection.centre[axis] + offset_m[axis]) as f32);
        }
    }
}

/// Range from which a ray looks, metres; the counterpart of the rasteriser's least depth.
const FIRST_RANGE_M: f64 = super::projection::NEAR_M;

fn cast(scene: &Scene, camera: &Camera, pose: &Pose) -> View {
    let caster = RayCaster::new(scene);
    let world_from_camera = world_from_camera(pose);
    let mut view = View::empty(scene, camera.width(), camera.height());
    view.rows(1).for_each(|(v, row)| {
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
