//! The virtual LIDAR of the paper (Lee & Hsu, §3.5–3.8, Eq. 6–14): visible surfaces as points with a class, and those
//! points projected back into the image.
//!
//! The paper samples with rays and keeps the points; here the points of a view, which has one ray per pixel, are
//! thinned to the LIDAR's spacing. Beyond f · spacing (35 m for the paper's camera at 0.1 m) pixels are further apart
//! than that and all of them stay.

use super::view::View;
use crate::camera::{Camera, camera_from_world};
use crate::image::LabelImage;
use nalgebra::Vector3;
use resurvey_schema::{ClassId, ClassTable, GridPoint, Pose};
use std::collections::HashMap;

/// Spacing of the paper's LIDAR, metres.
pub const SPACING_M: f64 = 0.1;

/// A point on a visible surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LidarPoint {
    /// Where.
    pub position: GridPoint,
    /// Class of the surface there.
    pub class: ClassId,
}

/// Points of `view`, row by row, each left out that is nearer than `spacing_m` to one before it.
pub fn scan(view: &View, spacing_m: f64) -> Vec<LidarPoint> {
    let mut kept = Kept { spacing_m, cells: HashMap::new() };
    let pixels = view.points.values().iter().zip(view.labels.values());
    let hit = pixels.filter(|(point, _)| point.iter().all(|value| value.is_finite()));
    hit.filter(|(point, _)| kept.keep(point.map(f64::from)))
        .map(|(point, class)| {
            let [east, north, up] = point.map(f64::from);
            let GridPoint { easting_m, northing_m, height_m } = view.origin;
            let position = GridPoint::new(easting_m + east, northing_m + north, height_m + up);
            LidarPoint { position, class: ClassId(*class) }
        })
        .collect()
}

/// Classes of `points` as `camera` sees them from `pose`, the nearest where several meet; void between them (the
/// holes of the paper's virtual image).
pub fn project(points: &[LidarPoint], camera: &Camera, pose: &Pose) -> LabelImage {
    let camera_from_world = camera_from_world(pose);
    let mut labels = LabelImage::filled(camera.width(), camera.height(), ClassId::VOID.0);
    let mut nearest_m2 = vec![f64::INFINITY; labels.values().len()];
    for point in points {
        let offset = Vector3::new(
            point.position.easting_m - pose.position.easting_m,
            point.position.northing_m - pose.position.northing_m,
            point.position.height_m - pose.position.height_m,
        );
        let Some([u, v]) = camera.project(camera_from_world * offset) else { continue };
        if u < 0.0 || v < 0.0 || u >= f64::from(camera.width()) || v >= f64::from(camera.height()) {
            continue;
        }
        let index = v as usize * camera.width() as usize + u as usize;
        if offset.norm_squared() < nearest_m2[index] {
            nearest_m2[index] = offset.norm_squared();
            labels.values_mut()[index] = point.class.0;
        }
    }
    labels
}

/// `points` as a binary little-endian PLY file: double x y z (E, N, H), uchar class, red, green, blue.
pub fn write_ply(points: &[LidarPoint], classes: &ClassTable) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment x y z are easting, northing, height in metres\n\
         element vertex {}\nproperty double x\nproperty double y\nproperty double z\nproperty uchar class\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
        points.len()
    );
    let mut bytes = header.into_bytes();
    bytes.reserve(points.len() * 28);
    for point in points {
        for value in <[f64; 3]>::from(point.position) {
            bytes.extend(value.to_le_bytes());
        }
        let colour = classes.get(point.class).map_or([255; 3], |class| class.colour);
        bytes.push(point.class.0);
        bytes.extend(colour);
    }
    bytes
}

/// Points kept so far, by the cube of one spacing they lie in.
struct Kept {
    spacing_m: f64,
    cells: HashMap<[i64; 3], Vec<[f64; 3]>>,
}

impl Kept {
    /// Whether `point` is far enough from all before; it is then kept itself.
    fn keep(&mut self, point: [f64; 3]) -> bool {
        let [x, y, z] = point.map(|value| (value / self.spacing_m).floor() as i64);
        // The point's own cell first: it decides for most.
        const ORDER: [i64; 3] = [0, -1, 1];
        let near =
            ORDER.iter().flat_map(|dx| ORDER.iter().flat_map(move |dy| ORDER.iter().map(move |dz| [dx, dy, dz])));
        let limit_m2 = self.spacing_m * self.spacing_m;
        let crowded = |other: &[f64; 3]| (0..3).map(|k| (other[k] - point[k]).powi(2)).sum::<f64>() < limit_m2;
        let taken = near
            .filter_map(|[dx, dy, dz]| {
                self.cells.get(&[x.saturating_add(*dx), y.saturating_add(*dy), z.saturating_add(*dz)])
            })
            .any(|others| others.iter().any(crowded));
        if !taken {
            self.cells.entry([x, y, z]).or_default().push(point);
        }
        !taken
    }
}
