//! What a phone's photo or a receiver's log says about where it was: each part only where it was said.

use jiff::Timestamp;

/// 1σ of a GNSS height between tall buildings, metres: phones in Tsim Sha Tsui were off by 13 to 33 m.
pub(super) const GNSS_HEIGHT_SIGMA_M: f64 = 20.0;

/// 1σ below which no GNSS position between buildings is believed, metres.
const POSITION_SIGMA_FLOOR_M: f64 = 3.0;
/// Largest 1σ of a position, metres.
const POSITION_SIGMA_LIMIT_M: f64 = 1000.0;

/// A position that a photo or a log says, with what came with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// WGS84 latitude, degrees.
    pub latitude_deg: f64,
    /// WGS84 longitude, degrees.
    pub longitude_deg: f64,
    /// 1σ of the position in plan, metres.
    pub position_sigma_m: Option<f64>,
    /// Height of the receiver.
    pub height: Option<SensedHeight>,
    /// Heading of the camera.
    pub heading: Option<Heading>,
    /// When the photo was taken, or the time that was asked for.
    pub taken_at: Option<Timestamp>,
}

/// A height as GNSS gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensedHeight {
    /// Metres above `datum`.
    pub height_m: f64,
    /// What it is above.
    pub datum: SensedDatum,
    /// 1σ, metres.
    pub sigma_m: f64,
}

/// What a GNSS height is above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensedDatum {
    /// The WGS84 ellipsoid.
    Ellipsoid,
    /// Mean sea level by some geoid; taken for the map's vertical datum.
    SeaLevel,
}

/// A heading, degrees clockwise, 0 to 360.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heading {
    /// Degrees clockwise from `north`.
    pub heading_deg: f64,
    /// What it is counted from.
    pub north: North,
}

/// What a sensed heading is counted from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum North {
    /// The meridian.
    True,
    /// The compass.
    Magnetic,
}

/// A 1σ in plan as far as it is believed, metres.
pub(super) fn believed_sigma_m(stated_m: f64) -> f64 {
    stated_m.clamp(POSITION_SIGMA_FLOOR_M, POSITION_SIGMA_LIMIT_M)
}
