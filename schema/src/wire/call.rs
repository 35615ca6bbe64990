//! What goes into a call. Arrays are lent until the call ends, and read-only unless named as a place for an answer.

use super::answer::{WireAlignment, WireRegion};
use super::array::Array;
use crate::class::Class;
use serde::{Deserialize, Serialize};

/// Views of one size, stacked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireViews {
    /// `<f8`, views × 3: where the offsets in `points` start.
    pub origins: Array,
    /// `|u1`, views × rows × columns: class; sky where nothing is hit.
    pub labels: Array,
    /// `<f4`, views × rows × columns: distance along the ray, metres; infinite where nothing is hit.
    pub range_m: Array,
    /// `<f4`, views × rows × columns × 3: offset from the origin, metres; NaN where nothing is hit.
    pub points: Array,
    /// `<u4`, views × rows × columns: 0, or 1 + index into `feature_table`.
    pub features: Array,
    /// `|V16`: the descriptors of the scene.
    pub feature_table: Array,
}

/// Score views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScoreCall {
    /// Bytes of the shared memory.
    pub memory: usize,
    /// `|u1`, rows × columns: class.
    pub photo: Array,
    /// Of the same size.
    pub views: WireViews,
    /// `<f8`, views: place for the answer, 0–1, higher is better.
    pub scores: Array,
}

/// Memory that the plugin may write to, for what it sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scratch {
    /// From the start of the memory; a multiple of 64.
    pub offset: usize,
    /// At least 1 MiB, and at least one byte per pixel of the photo.
    pub bytes: usize,
}

/// Find the pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchCall {
    /// Bytes of the shared memory.
    pub memory: usize,
    /// For what the plugin sends.
    pub scratch: Scratch,
    /// The map's class table, by rising index.
    pub classes: Vec<Class>,
    /// `|u1`, rows × columns: class; 255 is void.
    pub photo: Array,
    /// The camera.
    pub camera: WireCamera,
    /// The rough pose.
    pub prior: WirePrior,
}

/// Find the regions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectCall {
    /// Bytes of the shared memory.
    pub memory: usize,
    /// For what the plugin sends.
    pub scratch: Scratch,
    /// The map's class table, by rising index.
    pub classes: Vec<Class>,
    /// `|u1`, rows × columns: class; 255 is void.
    pub photo: Array,
    /// The camera of both.
    pub camera: WireCamera,
    /// Where both were taken.
    pub estimate: WireEstimate,
    /// One view of the same size.
    pub views: WireViews,
}

/// Say what the regions mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EstimateCall {
    /// What a detector gets.
    pub comparison: DetectCall,
    /// The regions, in the detector's order.
    pub regions: Vec<WireRegion>,
}

/// Say which class each pixel is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentCall {
    /// Bytes of the shared memory.
    pub memory: usize,
    /// For what the plugin sends.
    pub scratch: Scratch,
    /// The map's class table, by rising index.
    pub classes: Vec<Class>,
    /// `|u1`, rows × columns × 3: red, green, blue (sRGB).
    pub photo: Array,
    /// `|u1`, rows × columns: place for the answer, a class of the table or 255; 255 everywhere when the call begins.
    pub labels: Array,
}

/// Camera intrinsics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireCamera {
    /// `pinhole`, `brown` (k1 k2 p1 p2 k3) or `fisheye` (k1 k2 k3 k4).
    pub model: String,
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

/// The phone's rough pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WirePrior {
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireEstimate {
    /// Easting, northing, height, metres; yaw, pitch, roll, radians.
    pub pose: [f64; 6],
    /// Over easting, northing, yaw.
    pub covariance: [[f64; 3]; 3],
    /// 1σ of the height, metres.
    pub height_sigma_m: f64,
    /// 1σ of pitch and roll, radians.
    pub tilt_sigma_rad: f64,
    /// What the matcher found out beyond the pose.
    pub alignment: Option<WireAlignment>,
}
