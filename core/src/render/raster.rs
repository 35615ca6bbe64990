//! A z-buffer rasteriser for pinhole cameras, in 2D homogeneous coordinates (Olano & Greer 1997): a triangle that
//! crosses the camera plane needs no clipping, and triangles that share an edge cover every pixel of it once.
//!
//! First pass: the nearest triangle per pixel. Second pass: classes, from the exact intersection of ray and plane.

use super::frame::{Frame, Span};
use super::occlusion::Occlusion;
use super::projection::Projection;
use super::scene::Scene;
use super::setup::{HomogeneousTriangle, Setup};
use super::texels::Texels;
use crate::camera::Pinhole;
use crate::image::LabelImage;
use crate::mesh::Surface;
use resurvey_schema::Pose;

/// Buffers and code to draw one image after the other without allocating anew; one per thread.
#[derive(Clone, Debug, Default)]
pub struct Renderer {
    frame: Frame,
    setups: Vec<Setup>,
    /// Of the setups with a texture that show.
    texels: Vec<Option<Texels>>,
    occlusion: Occlusion,
    /// Nearest depth and index of the clusters in the image.
    order: Vec<(f32, u32)>,
}

/// Triangles drawn before it is first looked at what they hide: small scenes are drawn whole.
const FIRST_LOOK: usize = 192;
/// Growth of the number of triangles from one look to the next.
const LOOK_GROWTH: usize = 3;

impl Renderer {
    /// A renderer without buffers; they grow with the first image.
    pub fn new() -> Self {
        Self::default()
    }

    /// Classes as `camera` sees them from `pose`, sky where nothing is; `labels` gets the camera's size.
    ///
    /// Surfaces nearer than 0.05 m along the optical axis are not drawn.
    pub fn render_labels(&mut self, scene: &Scene, camera: &Pinhole, pose: &Pose, labels: &mut LabelImage) {
        let projection = Projection::new(scene, camera, pose);
        self.draw(scene, camera, &projection);
        self.shade(scene, &projection, labels);
    }

    /// The same, of the triangles with the given indices alone; indices outside the scene are left out.
    pub fn render_labels_of(
        &mut self,
        (scene, triangles): (&Scene, &[u32]),
        camera: &Pinhole,
        pose: &Pose,
        labels: &mut LabelImage,
    ) {
        let projection = Projection::new(scene, camera, pose);
        self.start(camera);
        for &triangle in triangles.iter().filter(|&&triangle| (triangle as usize) < scene.positions().len()) {
            self.draw_triangle(scene, &projection, triangle);
        }
        self.shade(scene, &projection, labels);
    }

    /// Indices of the triangles that show in the image drawn last, rising.
    pub fn visible_triangles(&self) -> Vec<u32> {
        let mut seen = vec![false; self.setups.len()];
        for v in 0..self.frame.height() {
            self.frame.ids(v).iter().filter(|&&id| id > 0).for_each(|&id| seen[id as usize - 1] = true);
        }
        let mut visible: Vec<u32> =
            self.setups.iter().zip(seen).filter(|(_, seen)| *seen).map(|(setup, _)| setup.triangle).collect();
        visible.sort_unstable();
        visible
    }

    /// First pass over the whole scene, near clusters first; those hidden by what is drawn are left out. Of surfaces at
    /// exactly the same depth the one whose cluster begins nearer shows.
    pub(super) fn draw(&mut self, scene: &Scene, camera: &Pinhole, projection: &Projection) {
        self.start(camera);
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend(
            (0_u32..).zip(scene.clusters()).filter_map(|(index, cluster)| {
                projection.nearest_depth_m(cluster).map(|depth_m| (depth_m as f32, index))
            }),
        );
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut next_look = FIRST_LOOK;
        for &(_, index) in &order {
            let cluster = &scene.clusters()[index as usize];
            if self.occlusion.hides(projection, cluster) {
                continue;
            }
            for triangle in cluster.triangles.clone() {
                self.draw_triangle(scene, projection, triangle as u32);
            }
            if self.setups.len() >= next_look {
                self.occlusion.take(&self.frame);
                next_look *= LOOK_GROWTH;
            }
        }
        self.order = order;
    }

    /// Runs of row `v` where one triangle is nearest: first column, length, triangle.
    pub(super) fn runs(&self, v: usize) -> impl Iterator<Item = (usize, usize, &Setup)> {
        let mut next = 0;
        self.frame.ids(v).chunk_by(|a, b| a == b).filter_map(move |run| {
            let first = next;
            next += run.len();
            let index = (run[0] as usize).checked_sub(1)?;
            Some((first, run.len(), self.setups.get(index)?))
        })
    }

    /// Second pass.
    pub(super) fn shade(&mut self, scene: &Scene, projection: &Projection, labels: &mut LabelImage) {
        let (width, height) = (self.frame.width(), self.frame.height());
        if (labels.width() as usize, labels.height() as usize) != (width, height) {
            *labels = LabelImage::filled(width as u32, height as u32, scene.sky().0);
        }
        self.texels.clear();
        self.texels.resize(self.setups.len(), None);
        for (v, row) in labels.values_mut().chunks_exact_mut(width.max(1)).enumerate() {
            let mut u = 0;
            for run in self.frame.ids(v).chunk_by(|a, b| a == b) {
                let pixels = &mut row[u..u + run.len()];
                match (run[0] as usize).checked_sub(1) {
                    None => pixels.fill(scene.sky().0),
                    Some(index) => {
                        let setup = &self.setups[index];
                        match scene.surface(setup.triangle as usize) {
                            Surface::Class(class) => pixels.fill(class.0),
                            Surface::Texture(texture) => {
                                let texels = &mut self.texels[index];
                                if texels.is_none() {
                                    *texels = texels_of(scene, projection, setup);
                                }
                                if let Some(texels) = texels {
                                    texels.fill(texture, [u, v], pixels);
                                }
                            }
                        }
                    }
                }
                u += run.len();
            }
        }
    }

    fn start(&mut self, camera: &Pinhole) {
        self.frame.clear(camera.width() as usize, camera.height() as usize);
        self.setups.clear();
        self.occlusion.clear();
    }

    fn draw_triangle(&mut self, scene: &Scene, projection: &Projection, triangle: u32) {
        let corners = scene.positions()[triangle as usize].map(|corner| projection.project(corner));
        if !projection.may_see_triangle(&corners) {
            return;
        }
        let rows = projection.rows(&corners);
        if rows.is_empty() {
            return;
        }
        let Some(homogeneous) = HomogeneousTriangle::new(corners) else { return };
        let inverse_depth = homogeneous.inverse_depth();
        let edges = homogeneous.edges(projection, rows);
        self.setups.push(Setup { triangle, inverse_depth });
        let id = self.setups.len() as u32;
        let [step, per_row, constant] = inverse_depth;
        for v in edges.rows() {
            let y = v as f64 + 0.5;
            let (first, end) = edges.columns(y);
            if first < end {
                let start = (step * (first as f64 + 0.5) + (per_row * y + constant)) as f32;
                self.frame.draw(Span { v, first, end, start, step: step as f32 }, id);
            }
        }
    }
}

fn texels_of(scene: &Scene, projection: &Projection, setup: &Setup) -> Option<Texels> {
    let corners = scene.positions()[setup.triangle as usize].map(|corner| projection.project(corner));
    Texels::new(scene, setup, &HomogeneousTriangle::new(corners)?)
}
