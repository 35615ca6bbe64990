//! What the host hands to a plugin: rasters of one size, a camera, a pose. All of it is lent.

use crate::image::{LabelImage, Raster};
use resurvey_schema::service::{PoseEstimate, Prior, ViewFeature};
use resurvey_schema::{GridPoint, Intrinsics};

/// The map as seen from a pose (Lee & Hsu, Eq. 6–14). All rasters have one size.
#[derive(Clone, Copy, Debug)]
pub struct ViewImages<'a> {
    /// Where the offsets in `points` start.
    pub origin: GridPoint,
    /// Class per pixel; sky where the ray hits nothing.
    pub labels: &'a LabelImage,
    /// Distance along the ray, metres; infinite where the ray hits nothing.
    pub range_m: &'a Raster<f32>,
    /// Point hit, offset from `origin`, E, N, H, metres; NaN where the ray hits nothing.
    pub points: &'a Raster<[f32; 3]>,
    /// 0 for the base map and sky, otherwise 1 + index into `feature_table`.
    pub features: &'a Raster<u32>,
    /// The descriptors of the scene.
    pub feature_table: &'a [ViewFeature],
}

/// A labelled photo and its prior.
#[derive(Clone, Copy, Debug)]
pub struct PhotoInput<'a> {
    /// Class per pixel; 255 is void.
    pub labels: &'a LabelImage,
    /// The camera.
    pub camera: &'a Intrinsics,
    /// The rough pose.
    pub prior: &'a Prior,
}

/// Photo and view of the same pose; all rasters have one size.
#[derive(Clone, Copy, Debug)]
pub struct ComparisonInput<'a> {
    /// Class per pixel; 255 is void.
    pub photo: &'a LabelImage,
    /// The map as seen from `estimate.pose`.
    pub view: ViewImages<'a>,
    /// The camera of both.
    pub camera: &'a Intrinsics,
    /// Where both were taken.
    pub estimate: &'a PoseEstimate,
}
