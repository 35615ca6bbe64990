//! `capture.json` (`resurvey.capture/1`): the labels of a photo and what the phone knew. Plain file form; `core` checks
//! the values and hands on types that cannot be invalid.

use serde::{Deserialize, Serialize};

/// Value of `format`.
pub const FORMAT: &str = "resurvey.capture/1";

/// A capture as the file has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaptureFile {
    /// Always [`FORMAT`].
    pub format: String,
    /// Path of the label image, relative to the file; left out where a segmenter makes the labels from a photo.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labels: Option<String>,
    /// RFC 3339 time of the photo.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub taken_at: Option<String>,
    /// The camera of the label image.
    pub camera: CameraFile,
    /// The phone's rough pose.
    pub prior: PriorFile,
}

/// Camera model and intrinsics. Either `fx`, `fy`, `cx`, `cy` or `diagonal_fov_deg`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// `pinhole`, `brown` or `fisheye`.
    pub model: String,
    /// Columns, pixels.
    pub width: u32,
    /// Rows, pixels.
    pub height: u32,
    /// Focal length along u, pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fx: Option<f64>,
    /// Focal length along v, pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fy: Option<f64>,
    /// Principal point, pixels; the centre of the first pixel is 0.5.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cx: Option<f64>,
    /// Principal point, pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cy: Option<f64>,
    /// k1 k2 p1 p2 k3 for `brown`, k1…k4 for `fisheye` (OpenCV order).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Vec<f64>>,
    /// Field of view over the diagonal, degrees; gives a centred camera with square pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub diagonal_fov_deg: Option<f64>,
}

/// The phone's rough pose. Either `latitude`, `longitude` or `easting`, `northing`; neither where an NMEA log or a
/// photo's EXIF says the position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PriorFile {
    /// WGS84 latitude, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latitude: Option<f64>,
    /// WGS84 longitude, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longitude: Option<f64>,
    /// Grid easting, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub easting: Option<f64>,
    /// Grid northing, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub northing: Option<f64>,
    /// Height of the camera, metres above `height_datum`; unknown when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
    /// `hkpd` or `ellipsoidal`; required with `height`, never guessed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_datum: Option<String>,
    /// 1σ of the height, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_sigma_m: Option<f64>,
    /// Heading, degrees clockwise from `north`; unknown when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw_deg: Option<f64>,
    /// Pitch, degrees, up positive.
    pub pitch_deg: f64,
    /// Roll, degrees, right side down positive.
    pub roll_deg: f64,
    /// 1σ of pitch and roll, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tilt_sigma_deg: Option<f64>,
    /// `grid`, `true` or `magnetic`; grid when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub north: Option<String>,
    /// Magnetic declination, degrees east; required with `magnetic`. Beside an NMEA log or a photo's EXIF it is that of
    /// their magnetic headings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub declination_deg: Option<f64>,
    /// 1σ of the position in plan, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_sigma_m: Option<f64>,
    /// 1σ of the heading, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw_sigma_deg: Option<f64>,
}
