//! What rendering promises: analytic scenes, and agreement between the rasteriser and single rays.

mod agreement;
mod analytic;
mod descriptors;
mod lidar;
mod solid;

use super::Scene;
use crate::camera::Camera;
use crate::image::LabelImage;
use crate::mesh::{LabelTexture, Mesh, Object, Surface, Wrap};
use resurvey_schema::{CameraModel, ClassId, ClassTable, Descriptor, GridPoint, Intrinsics, Pose};

pub(super) const ORIGIN: GridPoint = GridPoint::new(835_600.0, 817_800.0, 4.5);
pub(super) const STONE: u8 = 0;
pub(super) const GLASS: u8 = 1;
pub(super) const BANNER: u8 = 3;
pub(super) const CHAIR: u8 = 5;
pub(super) const SKY: u8 = 6;

/// 64 px focal length, 128 × 96 pixels, centred: at 8 m a metre is 8 px.
pub(super) fn camera() -> Camera {
    let (width, height) = (128, 96);
    let (fx, fy, cx, cy) = (64.0, 64.0, 64.0, 48.0);
    Camera::new(Intrinsics { model: CameraModel::Pinhole, width, height, fx, fy, cx, cy, distortion: [0.0; 5] })
        .unwrap()
}

/// A pose at an offset from [`ORIGIN`].
pub(super) fn pose([east, north, up]: [f64; 3], yaw_deg: f64, pitch_deg: f64) -> Pose {
    Pose {
        position: at([east, north, up]),
        yaw_rad: yaw_deg.to_radians(),
        pitch_rad: pitch_deg.to_radians(),
        roll_rad: 0.0,
    }
}

pub(super) fn at([east, north, up]: [f64; 3]) -> GridPoint {
    GridPoint::new(ORIGIN.easting_m + east, ORIGIN.northing_m + north, ORIGIN.height_m + up)
}

/// A quad a-b-c-d of one surface with texture coordinates 0…1: a is bottom left, c top right.
pub(super) fn quad(corners: [[f32; 3]; 4], surface: Surface) -> Object {
    let mesh = Mesh {
        origin: ORIGIN,
        vertices: corners.to_vec(),
        uvs: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_surfaces: vec![0, 0],
        surfaces: vec![surface],
    };
    Object { name: "quad".to_owned(), mesh }
}

/// A wall across the view of a camera that looks north: at `north`, from `west` to `east`, `low` to `high`.
pub(super) fn wall(north: f32, [west, east]: [f32; 2], [low, high]: [f32; 2], surface: Surface) -> Object {
    quad([[west, north, low], [east, north, low], [east, north, high], [west, north, high]], surface)
}

pub(super) fn class(class: u8) -> Surface {
    Surface::Class(ClassId(class))
}

/// A texture whose texels are `rows`, top row first.
pub(super) fn texture<const N: usize>(rows: &[[u8; N]]) -> Surface {
    let labels = LabelImage::from_values(N as u32, rows.len() as u32, rows.concat()).unwrap();
    Surface::Texture(LabelTexture { name: "texture".to_owned(), labels, wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat })
}

pub(super) fn scene(objects: &[Object]) -> Scene {
    scene_with(objects, &[])
}

pub(super) fn scene_with(objects: &[Object], descriptors: &[(u64, Descriptor)]) -> Scene {
    let with_ids: Vec<(u64, &Object)> = objects.iter().enumerate().map(|(fid, object)| (fid as u64, object)).collect();
    Scene::new(ORIGIN, &with_ids, descriptors, &ClassTable::default())
}

/// Columns and rows that hold `class`: first and one past the last; `None` when it does not show.
pub(super) fn extent(labels: &LabelImage, class: u8) -> Option<([u32; 2], [u32; 2])> {
    let pixels = (0..labels.height()).flat_map(|v| (0..labels.width()).map(move |u| (u, v)));
    let mut found: Option<([u32; 2], [u32; 2])> = None;
    for (u, v) in pixels.filter(|&(u, v)| labels.at(u, v) == class) {
        let ([left, right], [top, bottom]) = found.unwrap_or(([u, u], [v, v]));
        found = Some(([left.min(u), right.max(u + 1)], [top.min(v), bottom.max(v + 1)]));
    }
    found
}

pub(super) fn count(labels: &LabelImage, class: u8) -> usize {
    labels.values().iter().filter(|&&value| value == class).count()
}
