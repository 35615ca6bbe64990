//! Where and when a photo was taken, from its EXIF (CIPA DC-008, GPS tags of section 4.6.6).

use super::fix::{Fix, GNSS_HEIGHT_SIGMA_M, Heading, North, SensedDatum, SensedHeight, believed_sigma_m};
use exif::{DateTime, Exif, Field, In, Reader, Tag, Value};
use jiff::civil;
use jiff::tz::{Offset, TimeZone};
use jiff::{SignedDuration, Timestamp};
use std::io::Cursor;

/// Heights that no phone is at, metres from the datum.
const HEIGHT_LIMIT_M: f64 = 10_000.0;

/// Why a photo says nothing about where it was taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExifError {
    /// Not an image with EXIF.
    #[error("expected a JPEG, HEIF, PNG, WebP or TIFF file with EXIF, found: {reason}")]
    Unreadable {
        /// What the reader says.
        reason: String,
    },
    /// No position.
    #[error("expected a position in the EXIF, found no {tag}: was the camera allowed to know where it is?")]
    NoPosition {
        /// The first tag that is missing or blank.
        tag: &'static str,
    },
    /// A value that cannot be.
    #[error("EXIF {tag} is {found}; expected {expected}")]
    Value {
        /// The tag.
        tag: &'static str,
        /// What it is.
        found: String,
        /// What it may be.
        expected: &'static str,
    },
}

/// Reads what the EXIF of the image file `bytes` says. Damaged tags count as missing.
pub fn read_exif(bytes: &[u8]) -> Result<Fix, ExifError> {
    let exif = Reader::new()
        .continue_on_error(true)
        .read_from_container(&mut Cursor::new(bytes))
        .or_else(|error| error.distill_partial_result(|_| ()))
        .map_err(|error| ExifError::Unreadable { reason: error.to_string() })?;
    check_datum(&exif)?;
    let latitude_deg = degrees(&exif, &LATITUDE)?;
    let longitude_deg = degrees(&exif, &LONGITUDE)?;
    Ok(Fix {
        latitude_deg,
        longitude_deg,
        position_sigma_m: number(&exif, Tag::GPSHPositioningError).filter(|sigma| *sigma > 0.0).map(believed_sigma_m),
        height: height(&exif)?,
        heading: heading(&exif)?,
        taken_at: shutter_time(&exif).or_else(|| gps_time(&exif)),
    })
}

/// How the pixels of the image file `bytes` lie (TIFF 6.0, tag 274): 1, upright, where nothing says it.
pub(super) fn orientation(bytes: &[u8]) -> u32 {
    let exif = Reader::new()
        .continue_on_error(true)
        .read_from_container(&mut Cursor::new(bytes))
        .or_else(|error| error.distill_partial_result(|_| ()));
    let field = exif.as_ref().ok().and_then(|exif| exif.get_field(Tag::Orientation, In::PRIMARY));
    field.and_then(|field| field.value.get_uint(0)).unwrap_or(1)
}

/// Tokyo and the Chinese map datum are off by half a kilometre.
fn check_datum(exif: &Exif) -> Result<(), ExifError> {
    let datum = text(exif, Tag::GPSMapDatum).unwrap_or_default();
    let letters: String = datum.chars().filter(char::is_ascii_alphanumeric).collect();
    if letters.is_empty() || ["WGS84", "WORLDGEODETICSYSTEM1984"].contains(&letters.to_ascii_uppercase().as_str()) {
        return Ok(());
    }
    Err(ExifError::Value { tag: "GPSMapDatum", found: format!("{datum:?}"), expected: "WGS-84" })
}

/// One of the two angles of a position.
struct Angle {
    tag: Tag,
    name: &'static str,
    sign: Tag,
    sign_name: &'static str,
    /// Positive and negative.
    hemispheres: [&'static str; 2],
    hemispheres_text: &'static str,
    limit_deg: f64,
    limit_text: &'static str,
}

const LATITUDE: Angle = Angle {
    tag: Tag::GPSLatitude,
    name: "GPSLatitude",
    sign: Tag::GPSLatitudeRef,
    sign_name: "GPSLatitudeRef",
    hemispheres: ["N", "S"],
    hemispheres_text: "\"N\" or \"S\"",
    limit_deg: 90.0,
    limit_text: "degrees, minutes and seconds up to 90 degrees",
};

const LONGITUDE: Angle = Angle {
    tag: Tag::GPSLongitude,
    name: "GPSLongitude",
    sign: Tag::GPSLongitudeRef,
    sign_name: "GPSLongitudeRef",
    hemispheres: ["E", "W"],
    hemispheres_text: "\"E\" or \"W\"",
    limit_deg: 180.0,
    limit_text: "degrees, minutes and seconds up to 180 degrees",
};

fn degrees(exif: &Exif, angle: &Angle) -> Result<f64, ExifError> {
    let parts = numbers(exif, angle.tag);
    // 0/0 stands for unknown.
    if parts.is_empty() || parts.iter().any(|part| !part.is_finite()) {
        return Err(ExifError::NoPosition { tag: angle.name });
    }
    let part = |index: usize| parts.get(index).copied().unwrap_or_default();
    let degrees = part(0) + part(1) / 60.0 + part(2) / 3600.0;
    let is_sound = parts.len() <= 3 && parts.iter().all(|part| *part >= 0.0) && part(1) < 60.0 && part(2) <= 60.0;
    if !is_sound || degrees > angle.limit_deg {
        return Err(ExifError::Value { tag: angle.name, found: format!("{parts:?}"), expected: angle.limit_text });
    }
    let sign = text(exif, angle.sign).unwrap_or_default();
    match angle.hemispheres.iter().position(|hemisphere| *hemisphere == sign) {
        Some(0) => Ok(degrees),
        Some(_) => Ok(-degrees),
        None if sign.is_empty() => Err(ExifError::NoPosition { tag: angle.sign_name }),
        None => {
            let (tag, found) = (angle.sign_name, format!("{sign:?}"));
            Err(ExifError::Value { tag, found, expected: angle.hemispheres_text })
        }
    }
}

fn height(exif: &Exif) -> Result<Option<SensedHeight>, ExifError> {
    let Some(height_m) = number(exif, Tag::GPSAltitude).filter(|height_m| height_m.abs() <= HEIGHT_LIMIT_M) else {
        return Ok(None);
    };
    let reference = field(exif, Tag::GPSAltitudeRef).and_then(|field| match &field.value {
        Value::Byte(bytes) => bytes.first().map(|byte| u32::from(*byte)),
        other => other.get_uint(0),
    });
    let (sign, datum) = match reference.unwrap_or(0) {
        0 => (1.0, SensedDatum::SeaLevel),
        1 => (-1.0, SensedDatum::SeaLevel),
        2 => (1.0, SensedDatum::Ellipsoid),
        3 => (-1.0, SensedDatum::Ellipsoid),
        other => {
            let expected = "0 or 1 (above or below sea level), 2 or 3 (above or below the ellipsoid)";
            return Err(ExifError::Value { tag: "GPSAltitudeRef", found: other.to_string(), expected });
        }
    };
    Ok(Some(SensedHeight { height_m: sign * height_m, datum, sigma_m: GNSS_HEIGHT_SIGMA_M }))
}

fn heading(exif: &Exif) -> Result<Option<Heading>, ExifError> {
    let direction = number(exif, Tag::GPSImgDirection).filter(|direction| (0.0..=360.0).contains(direction));
    let Some(heading_deg) = direction else { return Ok(None) };
    // The standard's default is true north.
    let north = match text(exif, Tag::GPSImgDirectionRef).as_deref() {
        None | Some("" | "T") => North::True,
        Some("M") => North::Magnetic,
        Some(other) => {
            let (found, expected) = (format!("{other:?}"), "\"T\" (true north) or \"M\" (magnetic north)");
            return Err(ExifError::Value { tag: "GPSImgDirectionRef", found, expected });
        }
    };
    Ok(Some(Heading { heading_deg, north }))
}

/// When the shutter opened, where the zone of the camera's clock is known.
fn shutter_time(exif: &Exif) -> Option<Timestamp> {
    let mut time = DateTime::from_ascii(text(exif, Tag::DateTimeOriginal)?.as_bytes()).ok()?;
    let offset = text(exif, Tag::OffsetTimeOriginal).or_else(|| text(exif, Tag::OffsetTime))?;
    time.parse_offset(offset.as_bytes()).ok()?;
    if let Some(fraction) = text(exif, Tag::SubSecTimeOriginal) {
        // A blank fraction leaves the time as it is.
        let _ = time.parse_subsec(fraction.as_bytes());
    }
    let part = |value: u8| i8::try_from(value).ok();
    let nanosecond = i32::try_from(time.nanosecond.unwrap_or(0)).ok()?;
    let year = i16::try_from(time.year).ok()?;
    let [month, day] = [part(time.month)?, part(time.day)?];
    let [hour, minute, second] = [part(time.hour)?, part(time.minute)?, part(time.second)?];
    let local = civil::DateTime::new(year, month, day, hour, minute, second, nanosecond).ok()?;
    let offset = Offset::from_seconds(i32::from(time.offset?) * 60).ok()?;
    offset.to_timestamp(local).ok()
}

/// The time of the fix, which may be older than the photo.
fn gps_time(exif: &Exif) -> Option<Timestamp> {
    let stamp = text(exif, Tag::GPSDateStamp)?;
    let mut parts = stamp.split(':');
    let (year, month, day) = (parts.next()?, parts.next()?, parts.next()?);
    let date = civil::Date::new(year.parse().ok()?, month.parse().ok()?, day.parse().ok()?).ok()?;
    let [hours, minutes, seconds]: [f64; 3] = numbers(exif, Tag::GPSTimeStamp).try_into().ok()?;
    let of_day_s = hours * 3600.0 + minutes * 60.0 + seconds;
    if !(0.0..=86_400.0).contains(&of_day_s) {
        return None;
    }
    let midnight = date.to_zoned(TimeZone::UTC).ok()?.timestamp();
    midnight.checked_add(SignedDuration::from_millis((of_day_s * 1e3) as i64)).ok()
}

fn field(exif: &Exif, tag: Tag) -> Option<&Field> {
    exif.get_field(tag, In::PRIMARY)
}

/// The numbers of a tag; not finite where the denominator is 0.
fn numbers(exif: &Exif, tag: Tag) -> Vec<f64> {
    match field(exif, tag).map(|field| &field.value) {
        Some(Value::Rational(values)) => values.iter().map(exif::Rational::to_f64).collect(),
        Some(Value::SRational(values)) => values.iter().map(exif::SRational::to_f64).collect(),
        _ => Vec::new(),
    }
}

/// The only number of a tag, when it is one.
fn number(exif: &Exif, tag: Tag) -> Option<f64> {
    numbers(exif, tag).first().copied().filter(|value| value.is_finite())
}

/// The text of a tag without blanks around it.
fn text(exif: &Exif, tag: Tag) -> Option<String> {
    match &field(exif, tag)?.value {
        Value::Ascii(lines) => {
            let line = String::from_utf8_lossy(lines.first()?);
            Some(line.trim_matches(|letter: char| letter == '\0' || letter.is_whitespace()).to_owned())
        }
        _ => None,
    }
}
