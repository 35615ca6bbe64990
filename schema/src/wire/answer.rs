//! What comes out of a call. A number may be `null`, which stands for NaN and breaks a rule wherever it is checked.

use super::array::{Array, Number};
use serde::{Deserialize, Serialize};

/// The answer of a search.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireLocalization {
    /// Easting, northing, height, metres; yaw, pitch, roll, radians.
    pub pose: [Number; 6],
    /// Score of the pose, 0–1.
    pub score: Number,
    /// Over easting, northing, yaw; symmetric.
    pub covariance: [[Number; 3]; 3],
    /// What aligning photo and view told.
    #[serde(default)]
    pub alignment: Option<WireAlignment>,
    /// The second-best place.
    #[serde(default)]
    pub runner_up: Option<WireRunnerUp>,
    /// Candidates scored.
    #[serde(default)]
    pub candidates: u64,
    /// Candidates left out because they lie inside a solid building.
    #[serde(default)]
    pub skipped: u64,
}

/// What aligning photo and view told beyond the pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireAlignment {
    /// Over easting, northing, yaw, height, pitch, roll; symmetric, its lower triangle counts.
    pub covariance: [[Number; 6]; 6],
    /// 1σ by which walls stand off the map, metres.
    pub map_sigma_m: Number,
    /// 1σ by which contours of the labels wander, pixels.
    pub label_sigma_px: Number,
}

/// The second-best place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireRunnerUp {
    /// Distance in plan from the best, metres.
    pub distance_m: Number,
    /// Its likelihood over that of the best, 0–1.
    pub score_ratio: Number,
}

/// A region in which photo and view differ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireRegion {
    /// Class in the view.
    pub class_before: u8,
    /// Class in the photo.
    pub class_after: u8,
    /// Left, top, right, bottom, pixels; right and bottom are one past the last.
    pub bounds: [u32; 4],
    /// Number of ones in `mask`.
    pub pixels: u32,
    /// `|u1`, rows × columns of the box: 1 inside, 0 outside.
    pub mask: Array,
}

/// A proposal of an estimator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum WireProposal {
    /// Put a descriptor on the map.
    Place {
        /// Index of the region it comes from.
        region: u32,
        /// The descriptor.
        descriptor: WireDescriptor,
    },
    /// Take one off.
    Remove {
        /// Index of the region it comes from.
        region: u32,
        /// Class in the view.
        class: u8,
        /// Where it stood: easting, northing, height, metres.
        near: [Number; 3],
        /// 1σ of `near`, metres.
        sigma_m: Number,
    },
    /// Leave the map alone.
    Reject(WireRejection),
}

/// Why a change is left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WireRejection {
    /// Index of the region it comes from.
    pub region: u32,
    /// Class in the view.
    pub class_before: u8,
    /// Class in the photo.
    pub class_after: u8,
    /// Size of the region.
    pub pixels: u32,
    /// Short stable name.
    pub requirement: String,
    /// What was measured.
    pub measured: Number,
    /// What it was measured against.
    pub limit: Number,
    /// Of both.
    pub unit: String,
}

/// A descriptor of either kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum WireDescriptor {
    /// A quadrilateral on a surface.
    Material {
        /// Its class.
        class: u8,
        /// Bottom-left, bottom-right, top-right, top-left, seen from outside.
        corners: [[Number; 3]; 4],
        /// Outward unit normal.
        normal: [Number; 3],
        /// 1σ of the position, metres; of width and height, metres; of the area, m².
        #[serde(default)]
        sigma: Option<[Option<f64>; 3]>,
    },
    /// An object on the ground.
    Dynamic {
        /// Its class.
        class: u8,
        /// Ground contact.
        position: [Number; 3],
        /// Along, across, up, metres.
        size_m: [Number; 3],
        /// Heading of the front, radians.
        #[serde(default)]
        yaw_rad: Option<f64>,
        /// As above.
        #[serde(default)]
        sigma: Option<[Option<f64>; 3]>,
    },
}
