//! What a plugin asks of the host during a call, and what it gets. Arrays of a request lie in the scratch; arrays of an
//! answer are lent until the next request or the end of the call.

use super::answer::WireDescriptor;
use super::array::Array;
use super::call::WireViews;
use serde::{Deserialize, Serialize};

/// Render views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RenderRequest {
    /// Every so many pixels along u and v; at least 1.
    pub stride: u32,
    /// Whether descriptors are placed on the map.
    pub with_descriptors: bool,
    /// `<f8`, poses × 6.
    pub poses: Array,
}

/// Compare views with the photo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CompareViewsRequest {
    /// Every so many pixels along u and v; at least 1.
    pub stride: u32,
    /// Class c is in the set when bit c % 64 of word c / 64 is 1.
    pub ignored_in_photo: [u64; 4],
    /// Likewise.
    pub ignored_in_view: [u64; 4],
    /// Full-size pixels; 0 leaves the boundary counts out.
    pub boundary_tolerance_px: f64,
    /// `<f8`, poses × 6.
    pub poses: Array,
}

/// Compare panoramas with the photo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComparePanoramasRequest {
    /// Pitch of every candidate, radians.
    pub pitch_rad: f64,
    /// Roll of every candidate, radians.
    pub roll_rad: f64,
    /// First heading, radians.
    pub first_yaw_rad: f64,
    /// Columns between neighbouring headings.
    pub yaw_step_columns: u32,
    /// Number of headings.
    pub yaw_count: u32,
    /// Columns over the full circle.
    pub columns: u32,
    /// As in [`CompareViewsRequest`].
    pub ignored_in_photo: [u64; 4],
    /// As in [`CompareViewsRequest`].
    pub ignored_in_view: [u64; 4],
    /// `<f8`, positions × 3.
    pub positions: Array,
}

/// Something about points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointsRequest {
    /// `<f8`, points × 3.
    pub points: Array,
}

/// Directions of rays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PixelRaysRequest {
    /// Of the camera.
    pub pose: [f64; 6],
    /// `<f8`, pixels × 2: u, v.
    pub pixels: Array,
}

/// Pixels of points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProjectRequest {
    /// Of the camera.
    pub pose: [f64; 6],
    /// `<f8`, points × 3.
    pub points: Array,
}

/// What rays hit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CastRaysRequest {
    /// Easting, northing, height, metres.
    pub origin: [f64; 3],
    /// `<f8`, rays × 3.
    pub directions: Array,
    /// Metres; without it there is no limit.
    #[serde(default)]
    pub limit_m: Option<f64>,
    /// Whether descriptors are placed on the map.
    pub with_descriptors: bool,
}

/// A descriptor of the map near a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NearFeature {
    /// Feature id.
    pub fid: u64,
    /// The descriptor.
    pub descriptor: WireDescriptor,
}

/// The answer to a request: the fields that the request asks for, the others are left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Served {
    /// Bytes of the shared memory.
    pub memory: usize,
    /// Of `render`: views of the first poses, at least one. Ask again for the rest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub views: Option<WireViews>,
    /// Values in the order of the request.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub values: Option<Array>,
    /// Of `descriptors_near`, by rising feature id.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub features: Option<Vec<NearFeature>>,
    /// Of `ground_height`, metres; without it there is no ground below.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Of the two conversions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
}
