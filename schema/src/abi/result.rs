//! What comes out of a call: filled structs of the host, and callbacks where the number is not known before.

use super::Status;
use super::record::Text;
use core::ffi::c_void;

/// Where a plugin delivers results of unknown length, on the thread of the call and before it returns.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Results {
    /// Bytes of this struct.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// Goes first into each function below.
    pub context: *mut c_void,
    /// Takes cells of the heat map of a search: easting m, northing m, score.
    pub heat: Option<unsafe extern "C" fn(*mut c_void, *const [f64; 3], count: usize) -> Status>,
    /// Takes one region of a detector.
    pub region: Option<unsafe extern "C" fn(*mut c_void, *const Region) -> Status>,
    /// Takes one proposal of an estimator.
    pub proposal: Option<unsafe extern "C" fn(*mut c_void, *const Proposal) -> Status>,
}

/// The answer of a search; the host owns it.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Localization {
    /// Bytes of this struct, set by the host and left alone by the plugin.
    pub size: u32,
    /// 1 when the two fields on the runner-up count.
    pub has_runner_up: u32,
    /// Easting, northing, height, metres; yaw, pitch, roll, radians.
    pub pose: [f64; 6],
    /// Score of the pose, 0–1.
    pub score: f64,
    /// Row-major over easting, northing, yaw; symmetric.
    pub covariance: [f64; 9],
    /// Distance of the runner-up in plan, metres.
    pub runner_up_distance_m: f64,
    /// Likelihood of the runner-up over that of the pose, 0–1.
    pub runner_up_score_ratio: f64,
    /// Candidates scored.
    pub candidates: u64,
    /// Candidates left out because they lie inside a solid building.
    pub skipped: u64,
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

/// A region in which photo and view disagree. In arrays it comes with a byte step.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Region {
    /// Bytes of this struct.
    pub size: u32,
    /// Class in the view.
    pub class_before: u8,
    /// Class in the photo.
    pub class_after: u8,
    /// Zero.
    pub reserved: [u8; 2],
    /// First column of the bounds.
    pub left: u32,
    /// First row.
    pub top: u32,
    /// One past the last column.
    pub right: u32,
    /// One past the last row.
    pub bottom: u32,
    /// Number of ones in `mask`.
    pub pixels: u32,
    /// Zero.
    pub reserved_2: u32,
    /// Row-major over the bounds, without padding: 1 inside, 0 outside.
    pub mask: *const u8,
    /// Bytes of `mask`.
    pub mask_length: usize,
}

/// A descriptor of either kind.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Descriptor {
    /// Bytes of this struct.
    pub size: u32,
    /// 1 material, 2 dynamic.
    pub kind: u8,
    /// Its class.
    pub class: u8,
    /// [`Descriptor::HAS_YAW`] and its neighbours.
    pub has: u8,
    /// Zero.
    pub reserved: u8,
    /// Material: bottom-left, bottom-right, top-right, top-left, seen from outside.
    pub corners: [[f64; 3]; 4],
    /// Material: outward unit normal.
    pub normal: [f64; 3],
    /// Dynamic: ground contact.
    pub position: [f64; 3],
    /// Dynamic: along, across, up, metres.
    pub size_m: [f64; 3],
    /// Dynamic: heading of the front, radians.
    pub yaw_rad: f64,
    /// 1σ of the position, metres.
    pub sigma_position_m: f64,
    /// 1σ of width and height, metres.
    pub sigma_size_m: f64,
    /// 1σ of the area, m².
    pub sigma_area_m2: f64,
}

impl Descriptor {
    /// Value of `kind` for a material descriptor.
    pub const MATERIAL: u8 = 1;
    /// Value of `kind` for a dynamic descriptor.
    pub const DYNAMIC: u8 = 2;
    /// Bit of `has`: `yaw_rad` counts.
    pub const HAS_YAW: u8 = 1;
    /// Bit of `has`: `sigma_position_m` counts.
    pub const HAS_SIGMA: u8 = 2;
    /// Bit of `has`: `sigma_size_m` counts.
    pub const HAS_SIGMA_SIZE: u8 = 4;
    /// Bit of `has`: `sigma_area_m2` counts.
    pub const HAS_SIGMA_AREA: u8 = 8;
}

/// What an estimator proposes for one region.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Proposal {
    /// Bytes of this struct.
    pub size: u32,
    /// [`Proposal::PLACE`], [`Proposal::REMOVE`] or [`Proposal::REJECT`].
    pub kind: u32,
    /// Index of the region it comes from.
    pub region: u32,
    /// Reject: size of the region, pixels.
    pub pixels: u32,
    /// Place: the descriptor.
    pub descriptor: *const Descriptor,
    /// Remove: where it stood.
    pub near: [f64; 3],
    /// Remove: 1σ of `near`, metres.
    pub sigma_m: f64,
    /// Reject: what was measured.
    pub measured: f64,
    /// Reject: what it was measured against.
    pub limit: f64,
    /// Reject: short stable name of the requirement.
    pub requirement: Text,
    /// Reject: unit of `measured` and `limit`.
    pub unit: Text,
    /// Remove: class in the view.
    pub class: u8,
    /// Reject: class in the view.
    pub class_before: u8,
    /// Reject: class in the photo.
    pub class_after: u8,
    /// Zero.
    pub reserved: [u8; 5],
}

impl Proposal {
    /// Put a descriptor on the map.
    pub const PLACE: u32 = 1;
    /// Take one off.
    pub const REMOVE: u32 = 2;
    /// Leave the map alone.
    pub const REJECT: u32 = 3;
}
