//! Frozen records. Beside these, [`ClassCounts`](crate::service::ClassCounts), [`ViewFeature`](crate::service::ViewFeature),
//! [`GridPoint`], [`Pose`](crate::Pose) and [`Wgs84`](crate::Wgs84) cross as they are.

use crate::position::{GridPoint, Pose};

/// Borrowed UTF-8 without a terminator; `data` may be null when `length` is 0.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Text {
    /// First byte.
    pub data: *const u8,
    /// Bytes.
    pub length: usize,
}

impl Text {
    /// `text`, for as long as it lives.
    pub const fn of(text: &str) -> Self {
        Self { data: text.as_ptr(), length: text.len() }
    }
}

/// Borrowed row-major image, top-left first; the type of its values is given where it stands.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Image {
    /// First value of the first row, aligned for its type.
    pub data: *const core::ffi::c_void,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next, at least `width` values and a whole number of them.
    pub row_bytes: usize,
}

/// A place of the host for one class per pixel, top-left first; only the pixels are written.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Labels {
    /// First value of the first row.
    pub data: *mut u8,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes from one row to the next, at least `width`.
    pub row_bytes: usize,
}

/// A class of the map's table.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct ClassRecord {
    /// Lower-case name.
    pub name: Text,
    /// Along, across, up, metres; zero when the class is not dynamic.
    pub size_m: [f64; 3],
    /// Value in label images.
    pub index: u8,
    /// 0 material, 1 dynamic, 2 ignored.
    pub kind: u8,
    /// sRGB.
    pub colour: [u8; 3],
    /// Zero.
    pub reserved: [u8; 3],
}

/// What a ray hits first.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct RayHit {
    /// The point.
    pub point: GridPoint,
    /// Distance along the ray, metres.
    pub range_m: f64,
    /// Unit normal, turned towards the origin of the ray.
    pub normal: [f64; 3],
    /// Feature id, where `has_fid`.
    pub fid: u64,
    /// 1 when something was hit; otherwise the rest is zero.
    pub hit: u8,
    /// 1 when a descriptor was hit, 0 for the base map.
    pub has_fid: u8,
    /// Class there.
    pub class: u8,
    /// Zero.
    pub reserved: [u8; 5],
}

impl RayHit {
    /// Nothing was hit.
    pub const MISS: Self = Self {
        point: GridPoint::new(0.0, 0.0, 0.0),
        range_m: 0.0,
        normal: [0.0; 3],
        fid: 0,
        hit: 0,
        has_fid: 0,
        class: 0,
        reserved: [0; 5],
    };
}

impl From<Pose> for [f64; 6] {
    fn from(Pose { position, yaw_rad, pitch_rad, roll_rad }: Pose) -> Self {
        [position.easting_m, position.northing_m, position.height_m, yaw_rad, pitch_rad, roll_rad]
    }
}

impl From<[f64; 6]> for Pose {
    fn from([easting_m, northing_m, height_m, yaw_rad, pitch_rad, roll_rad]: [f64; 6]) -> Self {
        Self { position: GridPoint { easting_m, northing_m, height_m }, yaw_rad, pitch_rad, roll_rad }
    }
}
