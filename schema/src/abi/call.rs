//! What goes into a call. Everything is borrowed for its length and read-only.

use super::record::Image;
use crate::service::ViewFeature;

/// Camera intrinsics.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Camera {
    /// Bytes of this struct.
    pub size: u32,
    /// 0 pinhole, 1 Brown, 2 fisheye.
    pub model: u32,
    /// Columns, pixels.
    pub width: u32,
    /// Rows, pixels.
    pub height: u32,
    /// Focal length along u, pixels.
    pub fx: f64,
    /// Focal length along v, pixels.
    pub fy: f64,
    /// Principal point, pixels.
    pub cx: f64,
    /// Principal point, pixels.
    pub cy: f64,
    /// As the model says; unused ones are zero.
    pub distortion: [f64; 5],
}

/// A rough pose with its uncertainty.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Prior {
    /// Bytes of this struct.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Easting, northing, height, metres; yaw, pitch, roll, radians.
    pub pose: [f64; 6],
    /// 1σ in plan, metres.
    pub position_sigma_m: f64,
    /// 1σ of the height, metres.
    pub height_sigma_m: f64,
    /// 1σ of the heading, radians.
    pub yaw_sigma_rad: f64,
    /// 1σ of pitch and roll, radians.
    pub tilt_sigma_rad: f64,
}

/// A pose with its covariance.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct PoseEstimate {
    /// Bytes of this struct.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Easting, northing, height, metres; yaw, pitch, roll, radians.
    pub pose: [f64; 6],
    /// Row-major over easting, northing, yaw.
    pub covariance: [f64; 9],
    /// 1σ of the height, metres.
    pub height_sigma_m: f64,
    /// 1σ of pitch and roll, radians.
    pub tilt_sigma_rad: f64,
    /// 1 when the fields on the alignment count.
    pub has_alignment: u32,
    /// Zero.
    pub reserved_2: u32,
    /// Covariance over easting, northing, yaw, height, pitch, roll: the lower triangle, row by row.
    pub alignment_covariance: [f64; 21],
    /// 1σ by which walls stand off the map, metres.
    pub map_sigma_m: f64,
    /// 1σ by which contours of the labels wander, pixels.
    pub label_sigma_px: f64,
}

/// The map as seen from a pose.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct View {
    /// Bytes of this struct.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Where the offsets in `points` start.
    pub origin: [f64; 3],
    /// `u8`: class.
    pub labels: Image,
    /// `f32`: distance along the ray, metres; infinite where nothing is hit.
    pub range_m: Image,
    /// Three `f32`: offset from `origin`, metres; NaN where nothing is hit.
    pub points: Image,
    /// `u32`: 0, or 1 + index into `feature_table`.
    pub features: Image,
    /// The descriptors of the scene.
    pub feature_table: *const ViewFeature,
    /// Their number.
    pub feature_count: usize,
}

/// A labelled photo and its prior.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Photo {
    /// Bytes of this struct.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// `u8`: class; 255 is void.
    pub labels: Image,
    /// The camera.
    pub camera: *const Camera,
    /// The rough pose.
    pub prior: *const Prior,
}

/// What a segmenter sees.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Picture {
    /// Bytes of this struct.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Three `u8`: red, green, blue (sRGB), upright and of the camera's size.
    pub pixels: Image,
}

/// Photo and view of the same pose.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Comparison {
    /// Bytes of this struct.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// `u8`: class; 255 is void.
    pub photo: Image,
    /// The map as seen from the pose.
    pub view: *const View,
    /// The camera of both.
    pub camera: *const Camera,
    /// Where both were taken.
    pub estimate: *const PoseEstimate,
}

/// How views are to be rendered.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct RenderRequest {
    /// Bytes of this struct.
    pub size: u32,
    /// Every so many pixels along u and v; at least 1.
    pub stride: u32,
    /// 1 with the descriptors placed on the map, 0 without.
    pub with_descriptors: u32,
    /// Zero.
    pub reserved: u32,
}

/// How views are to be compared with the photo.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct CompareRequest {
    /// Bytes of this struct.
    pub size: u32,
    /// Every so many pixels along u and v; at least 1.
    pub stride: u32,
    /// Bit `c % 64` of word `c / 64` for class `c`.
    pub ignored_in_photo: [u64; 4],
    /// Likewise for the view.
    pub ignored_in_view: [u64; 4],
    /// Tolerance of the boundary counts, full-size pixels; 0 leaves them out.
    pub boundary_tolerance_px: f64,
}

/// How panoramas are to be compared with the photo.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct PanoramaRequest {
    /// Bytes of this struct.
    pub size: u32,
    /// Columns over the full circle.
    pub columns: u32,
    /// Columns between neighbouring headings.
    pub yaw_step_columns: u32,
    /// Number of headings.
    pub yaw_count: u32,
    /// First heading, radians.
    pub first_yaw_rad: f64,
    /// Pitch of every candidate, radians.
    pub pitch_rad: f64,
    /// Roll of every candidate, radians.
    pub roll_rad: f64,
    /// As in [`CompareRequest`].
    pub ignored_in_photo: [u64; 4],
    /// As in [`CompareRequest`].
    pub ignored_in_view: [u64; 4],
}
