//! What a triangle needs to be drawn: its edges, its inverse depth and its texture coordinates as linear functions of
//! the pixel.

use super::projection::{NEAR_M, Projection};
use super::scene::Scene;
use super::texture::{UvRange, texel_class};
use crate::mesh::{LabelTexture, Surface};
use nalgebra::Vector3;
use resurvey_schema::ClassId;
use std::ops::Range;

/// Below this share of the product of its corners' distances the volume between camera and triangle is rounding: the
/// triangle is degenerate or seen edge-on.
const FLAT: f64 = 1e-14;
/// Slack of the row range, pixels; the edges decide.
const ROW_SLACK_PX: f64 = 1e-3;
/// A triangle that may show.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setup {
    /// Index in the scene.
    pub(super) triangle: u32,
    /// Inverse depth as a linear form of (u, v, 1).
    pub(super) inverse_depth: [f64; 3],
    pub(super) shade: Shade,
}

/// What gives a drawn triangle its class.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shade {
    Class(ClassId),
    Texture(UvForms),
}

/// Texture coordinates divided by depth, as linear forms of (u, v, 1), and their range on the triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct UvForms {
    forms: [[f64; 3]; 2],
    range: UvRange,
}

/// The half planes whose intersection a triangle covers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edges {
    first_row: usize,
    end_row: usize,
    width: f64,
    /// Bounds on u as (slope, constant) of y: at most three edges and the near plane.
    left: [(f64, f64); 4],
    left_count: usize,
    right: [(f64, f64); 4],
    right_count: usize,
    /// Bounds on y of edges that run along rows: first y inside (inclusive) and last (exclusive).
    top: f64,
    bottom: f64,
}

/// Edges and linear forms of `triangle`; `None` when it cannot show.
pub(super) fn setup(scene: &Scene, projection: &Projection, triangle: u32) -> Option<(Setup, Edges)> {
    let corners = scene.positions()[triangle as usize].map(|corner| projection.project(corner));
    if !projection.may_see_triangle(&corners) {
        return None;
    }
    let [a, b, c] = &corners;
    let forms = [b.cross(c), c.cross(a), a.cross(b)];
    let volume = a.dot(&forms[0]);
    if volume.is_nan() || volume.abs() <= FLAT * a.norm() * b.norm() * c.norm() {
        return None;
    }
    let inverse_depth = (forms[0] + forms[1] + forms[2]) / volume;
    let mut edges = Edges::new(projection, &corners);
    for form in &forms {
        // Shared edges have exactly opposite forms, so that their pixels fall to one side or the other.
        edges.add(if volume > 0.0 { *form } else { -form });
    }
    if corners.iter().any(|corner| corner.z < NEAR_M) {
        edges.add(Vector3::new(0.0, 0.0, 1.0 / NEAR_M) - inverse_depth);
    }
    if edges.first_row >= edges.end_row {
        return None;
    }
    let shade = match scene.surface(triangle as usize) {
        Surface::Class(class) => Shade::Class(*class),
        Surface::Texture(_) => Shade::Texture(UvForms::new(&scene.uvs()[triangle as usize], &forms, volume)),
    };
    Some((Setup { triangle, inverse_depth: inverse_depth.into(), shade }, edges))
}

impl Setup {
    /// Inverse depth at (u, v).
    pub(super) fn inverse_depth_at(&self, u: f64, v: f64) -> f64 {
        let [along_u, along_v, constant] = self.inverse_depth;
        along_u * u + (along_v * v + constant)
    }

    /// Class at (u, v).
    pub(super) fn class_at(&self, scene: &Scene, u: f64, v: f64) -> ClassId {
        match &self.shade {
            Shade::Class(class) => *class,
            Shade::Texture(forms) => {
                let depth = 1.0 / self.inverse_depth_at(u, v);
                let uv = forms.forms.map(|[x, y, constant]| ((x * u + (y * v + constant)) * depth) as f32);
                scene.class_at(self.triangle as usize, forms.range.hold(uv))
            }
        }
    }
}

impl UvForms {
    fn new(uvs: &[[f32; 2]; 3], forms: &[Vector3<f64>; 3], volume: f64) -> Self {
        let form = |axis: usize| {
            (0..3).map(|corner| forms[corner] * f64::from(uvs[corner][axis])).sum::<Vector3<f64>>() / volume
        };
        Self { forms: [form(0).into(), form(1).into()], range: UvRange::of(uvs) }
    }

    /// Classes of the pixels from column `u`, row `v` on.
    pub(super) fn classes(&self, scene: &Scene, setup: &Setup, [u, v]: [f64; 2], pixels: &mut [u8]) {
        let Surface::Texture(texture) = scene.surface(setup.triangle as usize) else { return };
        self.classes_of(texture, setup, [u + 0.5, v + 0.5], pixels);
    }

    fn classes_of(&self, texture: &LabelTexture, setup: &Setup, [u, v]: [f64; 2], pixels: &mut [u8]) {
        let start = |[x, y, constant]: [f64; 3]| (x * u + (y * v + constant)) as f32;
        let starts = [start(self.forms[0]), start(self.forms[1]), start(setup.inverse_depth)];
        let steps = [self.forms[0][0] as f32, self.forms[1][0] as f32, setup.inverse_depth[0] as f32];
        for (index, pixel) in pixels.iter_mut().enumerate() {
            let along = (index as i32) as f32;
            let depth = 1.0 / (starts[2] + steps[2] * along);
            let uv = [(starts[0] + steps[0] * along) * depth, (starts[1] + steps[1] * along) * depth];
            let [u, v] = self.range.hold(uv);
            *pixel = texel_class(texture, u, v).0;
        }
    }
}

impl Edges {
    fn new(projection: &Projection, corners: &[Vector3<f64>; 3]) -> Self {
        let (mut low, mut high) = (0.0, projection.height);
        if corners.iter().all(|corner| corner.z >= NEAR_M) {
            let rows = corners.map(|corner| corner.y / corner.z);
            low = rows[0].min(rows[1]).min(rows[2]);
            high = rows[0].max(rows[1]).max(rows[2]);
        }
        Self {
            first_row: column_at(low - ROW_SLACK_PX, projection.height),
            end_row: column_at(high + ROW_SLACK_PX, projection.height),
            width: projection.width,
            left: [(0.0, 0.0); 4],
            left_count: 0,
            right: [(0.0, 0.0); 4],
            right_count: 0,
            top: f64::NEG_INFINITY,
            bottom: f64::INFINITY,
        }
    }

    /// Keeps the pixels whose centre gives `form` · (u, v, 1) > 0, and of those with 0 the ones on a top or left edge.
    fn add(&mut self, form: Vector3<f64>) {
        let bound = (-form.y / form.x, -form.z / form.x);
        if form.x > 0.0 && self.left_count < 4 {
            self.left[self.left_count] = bound;
            self.left_count += 1;
        } else if form.x < 0.0 && self.right_count < 4 {
            self.right[self.right_count] = bound;
            self.right_count += 1;
        } else if form.y > 0.0 {
            self.top = self.top.max(-form.z / form.y);
        } else if form.y < 0.0 {
            self.bottom = self.bottom.min(-form.z / form.y);
        } else if form.z <= 0.0 {
            self.bottom = f64::NEG_INFINITY;
        }
    }

    pub(super) fn rows(&self) -> Range<usize> {
        self.first_row..self.end_row
    }

    /// Columns `first..end` whose centres are covered in the row with centre `y`.
    pub(super) fn columns(&self, y: f64) -> (usize, usize) {
        if y < self.top || y >= self.bottom {
            return (0, 0);
        }
        let at = |(slope, constant): &(f64, f64)| slope * y + constant;
        let left = self.left[..self.left_count].iter().map(at).fold(0.0, f64::max);
        let right = self.right[..self.right_count].iter().map(at).fold(self.width, f64::min);
        (column_at(left, self.width), column_at(right, self.width))
    }
}

/// Index of the first pixel whose centre is not before `position`, 0…`size`.
fn column_at(position: f64, size: f64) -> usize {
    // ceil(position − 0.5) without a call to ceil: truncation is floor for what is not negative.
    let from_end = size + 0.5 - position.max(0.0).min(size);
    size as usize - (from_end as usize).min(size as usize)
}
