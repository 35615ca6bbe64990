//! A z-buffer rasteriser for pinhole cameras, in 2D homogeneous coordinates (Olano & Greer 1997): a triangle that
//! crosses the camera plane needs no clipping, and triangles that share an edge cover every pixel of it once.
//!
//! A pixel shows the triangle with the largest inverse depth in f32, among equals the one with the lowest index: order
//! and culling cannot change an image. So it is drawn in bands of rows that stay in cache, what showed last time first,
//! then whatever of the scene that does not hide.

use super::band::{Band, LANES};
use super::painter::{Painter, Triangles};
use super::projection::Projection;
use super::scene::Scene;
use super::shade::Shader;
use crate::camera::Pinhole;
use crate::image::{LabelImage, Raster};
use pulp::{Arch, Simd, WithSimd};
use resurvey_schema::Pose;

/// Buffers and code to draw one image after the other without allocating anew; one per thread. Fastest when an image is
/// like the one before.
#[derive(Clone, Debug)]
pub struct Renderer {
    painter: Painter,
    shader: Shader,
}

impl Default for Renderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Renderer {
    /// A renderer without buffers, for the best instruction set that the processor has; they grow with the first image.
    pub fn new() -> Self {
        Self::with(Arch::new())
    }

    /// A renderer for the instruction set that every processor has; its images are the same.
    pub fn baseline() -> Self {
        Self::with(Arch::Scalar)
    }

    pub(super) fn with(arch: Arch) -> Self {
        Self { painter: Painter::new(arch), shader: Shader::default() }
    }

    /// Classes as `camera` sees them from `pose`, sky where nothing is; `labels` gets the camera's size.
    ///
    /// Surfaces nearer than 0.05 m along the optical axis are not drawn.
    pub fn render_labels(&mut self, scene: &Scene, camera: &Pinhole, pose: &Pose, labels: &mut LabelImage) {
        self.render_from(scene, Triangles::All, camera, pose, labels);
    }

    /// The same, of the triangles with the given indices alone; indices outside the scene are left out.
    pub fn render_labels_of(
        &mut self,
        (scene, triangles): (&Scene, &[u32]),
        camera: &Pinhole,
        pose: &Pose,
        labels: &mut LabelImage,
    ) {
        self.render_from(scene, Triangles::Only(triangles), camera, pose, labels);
    }

    /// Indices of the triangles that show to `camera` from `pose`, rising.
    pub fn visible_triangles(&mut self, scene: &Scene, camera: &Pinhole, pose: &Pose) -> Vec<u32> {
        let projection = Projection::new(scene, camera, pose);
        self.painter.look_next();
        self.painter.draw(scene, Triangles::All, &projection, 0..camera.height() as usize, |_, _| {});
        self.painter.shown().to_vec()
    }

    /// Classes as `camera` sees them from `pose`, row by row: `receive` gets the index of each row and its classes,
    /// padded with void to a multiple of 64 pixels.
    pub fn render_rows(&mut self, scene: &Scene, camera: &Pinhole, pose: &Pose, mut receive: impl FnMut(usize, &[u8])) {
        let projection = Projection::new(scene, camera, pose);
        let Self { painter, shader } = self;
        shader.start();
        painter.draw(scene, Triangles::All, &projection, 0..camera.height() as usize, |arch, band| {
            let rows = shader.rows(arch, scene, &projection, band).enumerate();
            rows.for_each(|(row, classes)| receive(band.first_row() + row, classes));
        });
    }

    /// Classes, and depths along the optical axis, metres, infinite where nothing is; both get the camera's size.
    pub fn render_labels_and_depths(
        &mut self,
        scene: &Scene,
        camera: &Pinhole,
        pose: &Pose,
        (labels, depths_m): (&mut LabelImage, &mut Raster<f32>),
    ) {
        let projection = Projection::new(scene, camera, pose);
        let (columns, rows) = (camera.width(), camera.height());
        if (labels.width(), labels.height()) != (columns, rows) {
            *labels = LabelImage::filled(columns, rows, scene.sky().0);
        }
        if (depths_m.width(), depths_m.height()) != (columns, rows) {
            *depths_m = Raster::filled(columns, rows, f32::INFINITY);
        }
        let Self { painter, shader } = self;
        shader.start();
        let (width, labels, depths_m) = (columns as usize, labels.values_mut(), depths_m.values_mut());
        painter.draw(scene, Triangles::All, &projection, 0..rows as usize, |arch, band| {
            let part = band.first_row() * width..(band.first_row() + band.rows()) * width;
            shader.fill(arch, scene, &projection, band, &mut labels[part.clone()]);
            arch.dispatch(Depths { band, depths_m: &mut depths_m[part] });
        });
    }

    fn render_from(
        &mut self,
        scene: &Scene,
        triangles: Triangles,
        camera: &Pinhole,
        pose: &Pose,
        labels: &mut LabelImage,
    ) {
        let projection = Projection::new(scene, camera, pose);
        if (labels.width(), labels.height()) != (camera.width(), camera.height()) {
            *labels = LabelImage::filled(camera.width(), camera.height(), scene.sky().0);
        }
        let Self { painter, shader } = self;
        shader.start();
        let (width, values) = (camera.width() as usize, labels.values_mut());
        painter.draw(scene, triangles, &projection, 0..camera.height() as usize, |arch, band| {
            let first = band.first_row() * width;
            shader.fill(arch, scene, &projection, band, &mut values[first..first + band.rows() * width]);
        });
    }
}

/// Depths of the pixels of a band.
struct Depths<'a> {
    band: &'a Band,
    depths_m: &'a mut [f32],
}

impl WithSimd for Depths<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { band, depths_m } = self;
        for (row, depths_m) in depths_m.chunks_exact_mut(band.width().max(1)).enumerate() {
            for (depths_m, block) in depths_m.chunks_mut(LANES).zip(band.row(row)) {
                let mut all_m = [0.0; LANES];
                for (depth_m, inverse_depth) in all_m.iter_mut().zip(&block.inverse_depths) {
                    // One over nothing is infinite.
                    *depth_m = 1.0 / inverse_depth;
                }
                depths_m.copy_from_slice(&all_m[..depths_m.len()]);
            }
        }
    }
}
