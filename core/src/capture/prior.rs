//! The phone's rough pose, checked and brought into the map frame.
//!
//! Position, height and heading may each come from `capture.json` or from a [`Fix`] of another file. What the fix says
//! wins; what it does not say is taken from `capture.json`; pitch and roll are always those of `capture.json`.

use super::declination::declination_deg;
use super::fix::{Fix, North, SensedDatum};
use super::{CaptureError, PriorOrigin, PriorReport};
use crate::crs::{Crs, CrsError};
use jiff::Timestamp;
use resurvey_schema::service::Prior;
use resurvey_schema::{GridPoint, Pose, PriorFile, Wgs84};
use std::f64::consts::PI;
use std::path::Path;

/// 1σ of a phone's position in a street, metres, where the capture does not say: the paper's phone was off by 13 m in
/// the mean.
const POSITION_SIGMA_M: f64 = 15.0;
/// 1σ of a phone's compass between buildings, degrees: the paper's was off by up to 34°.
const YAW_SIGMA_DEG: f64 = 20.0;
/// 1σ of the heading where nobody says one: any direction is as likely.
const ANY_YAW_SIGMA_RAD: f64 = PI;
/// 1σ of a height that was taken from the ground below, metres.
pub(super) const HEIGHT_SIGMA_M: f64 = 0.5;
/// 1σ of a phone's pitch and roll from gravity, degrees.
const TILT_SIGMA_DEG: f64 = 1.0;
/// 1σ above which the ground of the map says more about a height than GNSS does, metres.
const GNSS_HEIGHT_LIMIT_M: f64 = 2.0;

/// A prior whose height may still have to come from the ground of the map.
#[derive(Clone, Debug)]
pub(super) struct RoughPrior {
    pub prior: Prior,
    pub height: RoughHeight,
    pub report: PriorReport,
}

/// What is known of the height of a prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RoughHeight {
    /// Enough: it is in the prior.
    Known,
    /// It is in the prior, but the ground is a better guess.
    Loose {
        /// Whether it is above sea level by an unknown geoid.
        is_sea_level: bool,
    },
    /// Nothing: that of the prior is 0.
    Unknown,
}

/// What a prior is made from.
pub(super) struct PriorInput<'a> {
    pub file: &'a PriorFile,
    /// The fix of another file, and which kind of file that is.
    pub fix: Option<(&'a Fix, PriorOrigin)>,
    pub crs: Crs,
    pub taken_at: Option<Timestamp>,
    /// `capture.json`, named in errors.
    pub path: &'a Path,
}

/// The prior of `input` in the frame of its map.
pub(super) fn rough_prior(input: &PriorInput<'_>) -> Result<RoughPrior, CaptureError> {
    let file = input.file;
    let check = Check { path: input.path };
    let place = place(input, &check)?;
    let (yaw_rad, heading_from) = heading(input, place.position, &check)?;
    let pose = Pose {
        position: place.position,
        yaw_rad,
        pitch_rad: check.within("prior.pitch_deg", file.pitch_deg, 90.0, "-90 to 90 degrees")?.to_radians(),
        roll_rad: check.within("prior.roll_deg", file.roll_deg, 180.0, "-180 to 180 degrees")?.to_radians(),
    };
    let yaw_sigma_rad = check.sigma("prior.yaw_sigma_deg", file.yaw_sigma_deg, YAW_SIGMA_DEG)?.to_radians();
    let position_sigma_m = check.sigma("prior.position_sigma_m", file.position_sigma_m, POSITION_SIGMA_M)?;
    let stated_m = input.fix.and_then(|(fix, _)| fix.position_sigma_m);
    let prior = Prior {
        pose,
        position_sigma_m: stated_m.unwrap_or(position_sigma_m),
        height_sigma_m: place.height_sigma_m,
        yaw_sigma_rad: heading_from.map_or(ANY_YAW_SIGMA_RAD, |_| yaw_sigma_rad),
        tilt_sigma_rad: check.sigma("prior.tilt_sigma_deg", file.tilt_sigma_deg, TILT_SIGMA_DEG)?.to_radians(),
    };
    let mut report = PriorReport::new(input.fix.map_or(PriorOrigin::Capture, |(_, origin)| origin));
    (report.height_from, report.heading_from) = (place.height_from, heading_from);
    if heading_from.is_none() {
        report.notes.push("nobody says the heading: every direction is looked at".to_owned());
    }
    Ok(RoughPrior { prior, height: place.height, report })
}

/// A position and what is known of its height.
struct Place {
    position: GridPoint,
    height: RoughHeight,
    height_sigma_m: f64,
    height_from: PriorOrigin,
}

fn place(input: &PriorInput<'_>, check: &Check<'_>) -> Result<Place, CaptureError> {
    let file_sigma_m = check.sigma("prior.height_sigma_m", input.file.height_sigma_m, HEIGHT_SIGMA_M)?;
    let sensed = input.fix.and_then(|(fix, origin)| Some((fix.height?, origin)));
    let (metres, height, height_sigma_m, height_from) = match sensed {
        Some((sensed, origin)) => {
            let is_tight = sensed.sigma_m <= GNSS_HEIGHT_LIMIT_M;
            let is_sea_level = sensed.datum == SensedDatum::SeaLevel;
            let known = if is_tight { RoughHeight::Known } else { RoughHeight::Loose { is_sea_level } };
            let metres = match sensed.datum {
                SensedDatum::Ellipsoid => Metres::Ellipsoidal(sensed.height_m),
                SensedDatum::SeaLevel => Metres::OfTheMap(sensed.height_m),
            };
            (metres, known, sensed.sigma_m, origin)
        }
        None => match file_height(input.file, check)? {
            Some(metres) => (metres, RoughHeight::Known, file_sigma_m, PriorOrigin::Capture),
            None => (Metres::OfTheMap(0.0), RoughHeight::Unknown, file_sigma_m, PriorOrigin::Ground),
        },
    };
    let position = position(input, metres, check)?;
    Ok(Place { position, height, height_sigma_m, height_from })
}

/// A height above one of the two datums, metres.
#[derive(Clone, Copy)]
enum Metres {
    OfTheMap(f64),
    Ellipsoidal(f64),
}

fn file_height(file: &PriorFile, check: &Check<'_>) -> Result<Option<Metres>, CaptureError> {
    let Some(height) = file.height else { return Ok(None) };
    let height_m = || check.within("prior.height", height, 10_000.0, "-10000 to 10000 m");
    match file.height_datum.as_deref() {
        Some("hkpd") => Ok(Some(Metres::OfTheMap(height_m()?))),
        Some("ellipsoidal") => Ok(Some(Metres::Ellipsoidal(height_m()?))),
        other => {
            let found = other.map_or_else(|| "missing".to_owned(), |datum| format!("{datum:?}"));
            Err(check.value("prior.height_datum", found, "\"hkpd\" or \"ellipsoidal\"; it is never guessed"))
        }
    }
}

fn position(input: &PriorInput<'_>, metres: Metres, check: &Check<'_>) -> Result<GridPoint, CaptureError> {
    let crs = input.crs;
    let geographic = |latitude_deg, longitude_deg| match metres {
        Metres::Ellipsoidal(ellipsoidal_height_m) => {
            crs.grid_from_wgs84(Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m })
        }
        Metres::OfTheMap(height_m) => crs.grid_from_latitude_longitude(latitude_deg, longitude_deg, height_m),
    };
    let file = input.file;
    let position = match (input.fix, file.latitude, file.longitude, file.easting, file.northing) {
        (Some((fix, _)), ..) => geographic(fix.latitude_deg, fix.longitude_deg),
        (None, Some(latitude), Some(longitude), None, None) => {
            let latitude_deg = check.within("prior.latitude", latitude, 90.0, "-90 to 90 degrees")?;
            let longitude_deg = check.within("prior.longitude", longitude, 180.0, "-180 to 180 degrees")?;
            geographic(latitude_deg, longitude_deg)
        }
        (None, None, None, Some(easting), Some(northing)) => {
            let easting_m = check.within("prior.easting", easting, 1e8, "a finite number of metres")?;
            let northing_m = check.within("prior.northing", northing, 1e8, "a finite number of metres")?;
            on_the_grid([easting_m, northing_m], metres, crs)
        }
        (None, None, None, None, None) => {
            let expected = "either latitude and longitude or easting and northing; or give --nmea with a log, or \
                            --photo with a photo whose EXIF has the position";
            return Err(check.value("prior", "without a position".to_owned(), expected));
        }
        _ => {
            let found = "not one complete pair".to_owned();
            return Err(check.value("prior", found, "either latitude and longitude or easting and northing"));
        }
    };
    position.map_err(|source| CaptureError::Position { path: check.path.to_owned(), source })
}

/// The grid point whose height is either above the map's datum already or above the ellipsoid.
fn on_the_grid([easting_m, northing_m]: [f64; 2], metres: Metres, crs: Crs) -> Result<GridPoint, CrsError> {
    let (Metres::OfTheMap(height_m) | Metres::Ellipsoidal(height_m)) = metres;
    let point = GridPoint::new(easting_m, northing_m, height_m);
    let separation_m = crs.wgs84_from_grid(point)?.ellipsoidal_height_m - point.height_m;
    let is_ellipsoidal = matches!(metres, Metres::Ellipsoidal(_));
    Ok(if is_ellipsoidal { GridPoint { height_m: height_m - separation_m, ..point } } else { point })
}

/// Heading from grid north, and who says it; 0 where nobody does.
fn heading(
    input: &PriorInput<'_>,
    position: GridPoint,
    check: &Check<'_>,
) -> Result<(f64, Option<PriorOrigin>), CaptureError> {
    let on_the_map = |source| CaptureError::Position { path: check.path.to_owned(), source };
    let convergence = || input.crs.convergence_rad(position).map_err(on_the_map);
    if let Some((heading, origin)) = input.fix.and_then(|(fix, origin)| Some((fix.heading?, origin))) {
        let declination_deg = match heading.north {
            North::True => 0.0,
            North::Magnetic => declination(input, position, check)?,
        };
        let yaw_rad = (heading.heading_deg + declination_deg).to_radians() - convergence()?;
        return Ok((yaw_rad, Some(origin)));
    }
    let Some(yaw_deg) = input.file.yaw_deg else { return Ok((0.0, None)) };
    let yaw_rad = check.within("prior.yaw_deg", yaw_deg, 720.0, "-720 to 720 degrees")?.to_radians();
    let north = input.file.north.as_deref().unwrap_or("grid");
    let yaw_rad = match (north, input.file.declination_deg) {
        ("grid" | "true", Some(declination)) if input.fix.is_none() => {
            let expected = "no value, because prior.north is not \"magnetic\"";
            return Err(check.value("prior.declination_deg", declination.to_string(), expected));
        }
        ("grid", _) => yaw_rad,
        ("true", _) => yaw_rad - convergence()?,
        ("magnetic", Some(declination)) => {
            yaw_rad + stated_declination(declination, check)?.to_radians() - convergence()?
        }
        ("magnetic", None) => {
            let expected = "the magnetic declination in degrees east, because prior.north is \"magnetic\"";
            return Err(check.value("prior.declination_deg", "missing".to_owned(), expected));
        }
        (other, _) => {
            return Err(check.value("prior.north", format!("{other:?}"), "\"grid\", \"true\" or \"magnetic\""));
        }
    };
    Ok((yaw_rad, Some(PriorOrigin::Capture)))
}

fn stated_declination(declination: f64, check: &Check<'_>) -> Result<f64, CaptureError> {
    check.within("prior.declination_deg", declination, 180.0, "-180 to 180 degrees")
}

/// Declination of a heading that was sensed: the stated one, else that of the World Magnetic Model on the day.
fn declination(input: &PriorInput<'_>, position: GridPoint, check: &Check<'_>) -> Result<f64, CaptureError> {
    if let Some(declination) = input.file.declination_deg {
        return stated_declination(declination, check);
    }
    let missing = |reason: String| {
        let expected = "the magnetic declination in degrees east, because the heading is magnetic and the World \
                        Magnetic Model cannot be asked";
        check.value("prior.declination_deg", format!("missing ({reason})"), expected)
    };
    let taken_at = input.taken_at.ok_or_else(|| missing("no date".to_owned()))?;
    let at = input.crs.wgs84_from_grid(position);
    let at = at.map_err(|source| CaptureError::Position { path: check.path.to_owned(), source })?;
    declination_deg(at, taken_at).map_err(missing)
}

struct Check<'a> {
    path: &'a Path,
}

impl Check<'_> {
    fn value(&self, key: &'static str, found: String, expected: &'static str) -> CaptureError {
        CaptureError::Value { path: self.path.to_owned(), key, found, expected }
    }

    /// `value` if it is finite and at most `limit` from zero.
    fn within(&self, key: &'static str, value: f64, limit: f64, expected: &'static str) -> Result<f64, CaptureError> {
        if value.is_finite() && value.abs() <= limit {
            Ok(value)
        } else {
            Err(self.value(key, value.to_string(), expected))
        }
    }

    fn sigma(&self, key: &'static str, value: Option<f64>, default: f64) -> Result<f64, CaptureError> {
        let value = value.unwrap_or(default);
        if value.is_finite() && (0.0..=1000.0).contains(&value) {
            Ok(value)
        } else {
            Err(self.value(key, value.to_string(), "0 to 1000"))
        }
    }
}
