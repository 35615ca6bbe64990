//! Where things are: grid positions, WGS84 positions and camera poses.

use serde::{Deserialize, Serialize};

/// A point of the map frame: HK1980 Grid easting and northing and height above HKPD, metres (EPSG:2326 + 5738; or the
/// map's own projected system). In files an array `[E, N, H]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
#[repr(C)]
pub struct GridPoint {
    /// Easting, metres.
    pub easting_m: f64,
    /// Northing, metres.
    pub northing_m: f64,
    /// Height above the vertical datum, metres.
    pub height_m: f64,
}

impl GridPoint {
    /// The point at easting, northing, height, metres.
    pub const fn new(easting_m: f64, northing_m: f64, height_m: f64) -> Self {
        Self { easting_m, northing_m, height_m }
    }

    /// Whether all three coordinates are finite.
    pub fn is_finite(&self) -> bool {
        self.easting_m.is_finite() && self.northing_m.is_finite() && self.height_m.is_finite()
    }

    /// Distance in plan to `other`, metres.
    pub fn plan_distance_m(&self, other: &Self) -> f64 {
        (self.easting_m - other.easting_m).hypot(self.northing_m - other.northing_m)
    }
}

impl From<[f64; 3]> for GridPoint {
    fn from([easting_m, northing_m, height_m]: [f64; 3]) -> Self {
        Self { easting_m, northing_m, height_m }
    }
}

impl From<GridPoint> for [f64; 3] {
    fn from(point: GridPoint) -> Self {
        [point.easting_m, point.northing_m, point.height_m]
    }
}

/// A WGS84 position (EPSG:4979).
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Wgs84 {
    /// Latitude, degrees, north positive.
    pub latitude_deg: f64,
    /// Longitude, degrees, east positive.
    pub longitude_deg: f64,
    /// Height above the ellipsoid, metres.
    pub ellipsoidal_height_m: f64,
}

/// Position and attitude of a camera. Yaw is clockwise from grid north, pitch is up, roll is right side down; radians
/// here, degrees in files.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "PoseFile", into = "PoseFile")]
#[repr(C)]
pub struct Pose {
    /// Centre of projection.
    pub position: GridPoint,
    /// Heading of the optical axis, radians clockwise from grid north.
    pub yaw_rad: f64,
    /// Elevation of the optical axis, radians, up positive.
    pub pitch_rad: f64,
    /// Rotation about the optical axis, radians, right side down positive.
    pub roll_rad: f64,
}

/// A pose as `localize --json` prints it and `--pose` reads it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseFile {
    /// Easting, metres.
    pub easting: f64,
    /// Northing, metres.
    pub northing: f64,
    /// Height above the vertical datum, metres.
    pub height: f64,
    /// Heading, degrees clockwise from grid north, 0–360.
    pub yaw_deg: f64,
    /// Pitch, degrees, up positive.
    pub pitch_deg: f64,
    /// Roll, degrees, right side down positive.
    pub roll_deg: f64,
}

impl From<PoseFile> for Pose {
    fn from(file: PoseFile) -> Self {
        Self {
            position: GridPoint::new(file.easting, file.northing, file.height),
            yaw_rad: file.yaw_deg.to_radians(),
            pitch_rad: file.pitch_deg.to_radians(),
            roll_rad: file.roll_deg.to_radians(),
        }
    }
}

impl From<Pose> for PoseFile {
    fn from(pose: Pose) -> Self {
        Self {
            easting: pose.position.easting_m,
            northing: pose.position.northing_m,
            height: pose.position.height_m,
            yaw_deg: pose.yaw_rad.to_degrees().rem_euclid(360.0),
            pitch_deg: pose.pitch_rad.to_degrees(),
            roll_deg: pose.roll_rad.to_degrees(),
        }
    }
}
