//! One line of an NMEA 0183 log: GGA, RMC, GST, HDT or HDM of any talker, with its checksum.

use super::fix::{Heading, North};
use jiff::civil::Date;

/// What a line is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Line {
    /// A sentence that says something about where the receiver was.
    Sentence(Sentence),
    /// Nothing, or a sound sentence of another kind.
    Other,
    /// A line that is passed over.
    Skipped(Skip),
}

/// Why a line is passed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Skip {
    /// Its checksum is wrong.
    Checksum,
    /// Cut, not ASCII, or with a value that cannot be.
    Malformed,
    /// Sound, but without a fix or value.
    Empty,
}

/// A sentence that was read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sentence {
    Gga { time_of_day_s: f64, gga: Gga },
    Rmc { time_of_day_s: f64, position: Position, date: Option<Date> },
    Gst { time_of_day_s: f64, gst: Gst },
    Heading(Heading),
}

/// Latitude and longitude, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Position {
    pub latitude_deg: f64,
    pub longitude_deg: f64,
}

/// A fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gga {
    pub position: Position,
    /// Whether carrier phases were used: quality 4 or 5.
    pub is_rtk: bool,
    pub hdop: Option<f64>,
    /// Above the receiver's geoid, metres.
    pub altitude_m: Option<f64>,
    /// Of the geoid above the ellipsoid, metres.
    pub separation_m: Option<f64>,
}

/// 1σ, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gst {
    /// The larger one of latitude and longitude.
    pub plan_m: f64,
    pub height_m: Option<f64>,
}

/// Reads a line. What stands before `$` and after the checksum, as loggers write it, is not looked at.
pub(super) fn read_line(line: &[u8]) -> Line {
    let line = line.trim_ascii();
    if line.is_empty() || line.starts_with(b"!") {
        return Line::Other;
    }
    match body(line).and_then(sentence) {
        Ok(Some(sentence)) => Line::Sentence(sentence),
        Ok(None) => Line::Other,
        Err(skip) => Line::Skipped(skip),
    }
}

/// What stands between `$` and `*`, once the checksum is right.
fn body(line: &[u8]) -> Result<&str, Skip> {
    let start = line.iter().position(|byte| *byte == b'$').ok_or(Skip::Malformed)?;
    let rest = &line[start + 1..];
    let end = rest.iter().position(|byte| *byte == b'*').ok_or(Skip::Malformed)?;
    let (body, after) = (&rest[..end], &rest[end + 1..]);
    let (digits, after) = after.split_at_checked(2).ok_or(Skip::Malformed)?;
    if after.first().is_some_and(|byte| *byte != b',' && !byte.is_ascii_whitespace()) {
        return Err(Skip::Malformed);
    }
    if !digits.iter().all(u8::is_ascii_hexdigit) {
        return Err(Skip::Malformed);
    }
    let digits = std::str::from_utf8(digits).map_err(|_| Skip::Malformed)?;
    let expected = u8::from_str_radix(digits, 16).map_err(|_| Skip::Malformed)?;
    if body.iter().fold(0, |sum, byte| sum ^ byte) != expected {
        return Err(Skip::Checksum);
    }
    std::str::from_utf8(body).ok().filter(|body| body.is_ascii()).ok_or(Skip::Malformed)
}

fn sentence(body: &str) -> Result<Option<Sentence>, Skip> {
    let fields: Vec<&str> = body.split(',').collect();
    // Two letters of the talker (GP, GN, GL, GA, GB, BD, HE …) and three of the kind; P begins a maker's own.
    let kind = match fields[0] {
        address if address.len() == 5 && !address.starts_with('P') => &address[2..],
        _ => return Ok(None),
    };
    let at_least = |count: usize| if fields.len() < count { Err(Skip::Malformed) } else { Ok(()) };
    match kind {
        "GGA" => at_least(12).and_then(|()| gga(&fields)),
        "RMC" => at_least(10).and_then(|()| rmc(&fields)),
        "GST" => at_least(8).and_then(|()| gst(&fields)),
        "HDT" => at_least(2).and_then(|()| heading(&fields, North::True)),
        "HDM" => at_least(2).and_then(|()| heading(&fields, North::Magnetic)),
        _ => return Ok(None),
    }
    .map(Some)
}

fn gga(fields: &[&str]) -> Result<Sentence, Skip> {
    let is_rtk = match fields[6] {
        // No fix, typed in, and simulated: nothing was measured.
        "" | "0" | "7" | "8" => return Err(Skip::Empty),
        "4" | "5" => true,
        "1" | "2" | "3" | "6" => false,
        _ => return Err(Skip::Malformed),
    };
    let time_of_day_s = time_of_day_s(fields[1])?;
    let position = position(&fields[2..6])?;
    let metres = |value: &str, unit: &str| match number(value)? {
        Some(_) if unit != "M" => Err(Skip::Malformed),
        Some(value) if value.abs() > 20_000.0 => Err(Skip::Malformed),
        value => Ok(value),
    };
    let hdop = number(fields[8])?.filter(|hdop| *hdop > 0.0);
    let (altitude_m, separation_m) = (metres(fields[9], fields[10])?, metres(fields[11], unit_of(fields, 12))?);
    Ok(Sentence::Gga { time_of_day_s, gga: Gga { position, is_rtk, hdop, altitude_m, separation_m } })
}

/// The unit in a field that short sentences leave out.
fn unit_of<'a>(fields: &[&'a str], index: usize) -> &'a str {
    fields.get(index).copied().unwrap_or("M")
}

fn rmc(fields: &[&str]) -> Result<Sentence, Skip> {
    if fields[2] != "A" {
        return Err(if ["V", ""].contains(&fields[2]) { Skip::Empty } else { Skip::Malformed });
    }
    let time_of_day_s = time_of_day_s(fields[1])?;
    let position = position(&fields[3..7])?;
    let date = if fields[9].is_empty() { None } else { Some(date(fields[9])?) };
    Ok(Sentence::Rmc { time_of_day_s, position, date })
}

fn gst(fields: &[&str]) -> Result<Sentence, Skip> {
    let time_of_day_s = time_of_day_s(fields[1])?;
    let sigma = |value: &str| match number(value)? {
        Some(sigma) if sigma < 0.0 => Err(Skip::Malformed),
        sigma => Ok(sigma),
    };
    let (Some(latitude_m), Some(longitude_m)) = (sigma(fields[6])?, sigma(fields[7])?) else {
        return Err(Skip::Empty);
    };
    let height_m = fields.get(8).map_or(Ok(None), |value| sigma(value))?;
    Ok(Sentence::Gst { time_of_day_s, gst: Gst { plan_m: latitude_m.max(longitude_m), height_m } })
}

fn heading(fields: &[&str], north: North) -> Result<Sentence, Skip> {
    let heading_deg = number(fields[1])?.ok_or(Skip::Empty)?;
    if !(0.0..=360.0).contains(&heading_deg) {
        return Err(Skip::Malformed);
    }
    Ok(Sentence::Heading(Heading { heading_deg, north }))
}

/// Seconds since midnight UTC of `hhmmss.ss`.
fn time_of_day_s(text: &str) -> Result<f64, Skip> {
    if text.is_empty() {
        return Err(Skip::Empty);
    }
    let (whole, _) = text.split_once('.').unwrap_or((text, ""));
    let digits = text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    if whole.len() != 6 || !digits {
        return Err(Skip::Malformed);
    }
    let part = |text: &str| text.parse::<f64>().map_err(|_| Skip::Malformed);
    let (hours, minutes, seconds) = (part(&text[..2])?, part(&text[2..4])?, part(&text[4..])?);
    // A leap second is 60.
    if hours < 24.0 && minutes < 60.0 && seconds < 61.0 {
        Ok(hours * 3600.0 + minutes * 60.0 + seconds)
    } else {
        Err(Skip::Malformed)
    }
}

/// The day of `ddmmyy`; years from 80 on are of the last century.
fn date(text: &str) -> Result<Date, Skip> {
    if text.len() != 6 || !text.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err(Skip::Malformed);
    }
    let part = |text: &str| text.parse::<i8>().map_err(|_| Skip::Malformed);
    let (day, month, year) = (part(&text[..2])?, part(&text[2..4])?, i16::from(part(&text[4..])?));
    Date::new(if year < 80 { 2000 + year } else { 1900 + year }, month, day).map_err(|_| Skip::Malformed)
}

/// The position of four fields: `ddmm.mmm`, N or S, `dddmm.mmm`, E or W.
fn position(fields: &[&str]) -> Result<Position, Skip> {
    let degrees = |value: &str, hemispheres: [&str; 2], sign: &str, limit: f64| {
        let value = number(value)?.ok_or(Skip::Empty)?;
        let (degrees, minutes) = ((value / 100.0).floor(), value.rem_euclid(100.0));
        let degrees = degrees + minutes / 60.0;
        if value < 0.0 || minutes >= 60.0 || degrees > limit || !hemispheres.contains(&sign) {
            return Err(Skip::Malformed);
        }
        Ok(if sign == hemispheres[0] { degrees } else { -degrees })
    };
    Ok(Position {
        latitude_deg: degrees(fields[0], ["N", "S"], fields[1], 90.0)?,
        longitude_deg: degrees(fields[2], ["E", "W"], fields[3], 180.0)?,
    })
}

/// A decimal number, or `None` of an empty field.
fn number(text: &str) -> Result<Option<f64>, Skip> {
    if text.is_empty() {
        return Ok(None);
    }
    if !text.bytes().all(|byte| byte.is_ascii_digit() || b"+-.".contains(&byte)) {
        return Err(Skip::Malformed);
    }
    text.parse::<f64>().ok().filter(|value| value.is_finite()).map(Some).ok_or(Skip::Malformed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn skipped(line: &str) -> Skip {
        match read_line(line.as_bytes()) {
            Line::Skipped(skip) => skip,
            other => panic!("{line}: {other:?}"),
        }
    }

    /// The line with its checksum.
    fn signed(body: &str) -> String {
        format!("${body}*{:02X}", body.bytes().fold(0, |sum, byte| sum ^ byte))
    }

    /// A line of a u-blox F9K, as its maker's checksum signs it.
    const GGA: &str = "$GNGGA,021417.00,3725.58362,N,12205.61915,W,5,12,0.76,4.4,M,-30.0,M,0.0,2000*52";

    #[test]
    fn a_receivers_fix_is_read() {
        let Line::Sentence(Sentence::Gga { time_of_day_s, gga }) = read_line(GGA.as_bytes()) else { panic!() };
        assert!((time_of_day_s - 8057.0).abs() < 1e-9);
        // 37° 25.58362′ and 122° 5.61915′.
        assert!((gga.position.latitude_deg - 37.426_393_667).abs() < 1e-9);
        assert!((gga.position.longitude_deg + 122.093_652_5).abs() < 1e-9);
        assert_eq!((gga.altitude_m, gga.separation_m, gga.hdop), (Some(4.4), Some(-30.0), Some(0.76)));
        assert!(gga.is_rtk);
    }

    #[test]
    fn the_same_fix_in_a_loggers_line_is_read() {
        for line in [format!("NMEA,{GGA},1581041657000"), format!("  {GGA}\r"), GGA.replace("*52", "*52 ")] {
            assert_eq!(read_line(line.as_bytes()), read_line(GGA.as_bytes()), "{line}");
        }
    }

    #[test]
    fn a_date_time_and_heading_are_read() {
        let rmc = "$GNRMC,021417.00,A,3725.58362,N,12205.61915,W,0.028,65.13,070220,13.06,E,F,V*4A";
        let Line::Sentence(Sentence::Rmc { date, .. }) = read_line(rmc.as_bytes()) else { panic!() };
        assert_eq!(date, Some(Date::new(2020, 2, 7).unwrap()));
        let expected = Heading { heading_deg: 274.07, north: North::True };
        // The example of the NMEA revealed page.
        assert_eq!(read_line(b"$GPHDT,274.07,T*03"), Line::Sentence(Sentence::Heading(expected)));
        let gst = signed("GPGST,024603.00,3.2,6.6,4.7,47.3,5.8,5.6,22.0");
        let Line::Sentence(Sentence::Gst { gst, .. }) = read_line(gst.as_bytes()) else { panic!() };
        assert_eq!(gst, Gst { plan_m: 5.8, height_m: Some(22.0) });
    }

    #[test]
    fn damage_is_told_from_silence() {
        assert_eq!(skipped(&GGA.replace("3725", "3726")), Skip::Checksum);
        for cut in [&GGA[..40], &GGA[..GGA.len() - 1], "GNGGA,0214", "$", "$*", "$GNGGA*5é"] {
            assert_eq!(skipped(cut), Skip::Malformed, "{cut}");
        }
        for (body, expected) in [
            ("GPGGA,021417,,,,,0,00,99.9,,,,,,", Skip::Empty),
            ("GPGGA,021417,,,,,1,00,99.9,,,,,,", Skip::Empty),
            ("GPGGA,021417,3725.5,N,12205.6,W,8,12,0.7,4.4,M,-30.0,M,,", Skip::Empty),
            ("GPRMC,021417,V,,,,,,,070220,,", Skip::Empty),
            ("GPHDT,,T", Skip::Empty),
            ("GPGST,021417,,,,,,,", Skip::Empty),
            ("GPHDT,361,T", Skip::Malformed),
            ("GPHDT,NaN,T", Skip::Malformed),
            ("GPGGA,241417,3725.5,N,12205.6,W,1,12,0.7,4.4,M,-30.0,M,,", Skip::Malformed),
            ("GPGGA,021417,3765.5,N,12205.6,W,1,12,0.7,4.4,M,-30.0,M,,", Skip::Malformed),
            ("GPGGA,021417,9125.5,N,12205.6,W,1,12,0.7,4.4,M,-30.0,M,,", Skip::Malformed),
            ("GPGGA,021417,3725.5,X,12205.6,W,1,12,0.7,4.4,M,-30.0,M,,", Skip::Malformed),
            ("GPGGA,021417,3725.5,N", Skip::Malformed),
            ("GPRMC,021417,A,3725.5,N,12205.6,W,0,0,310220,,", Skip::Malformed),
        ] {
            assert_eq!(skipped(&signed(body)), expected, "{body}");
        }
        for other in ["", "\r", "!AIVDM,1,1,,A,1,0*00", &signed("GPGSV,1,1,00"), &signed("PUBX,00")] {
            assert_eq!(read_line(other.as_bytes()), Line::Other, "{other}");
        }
    }

    proptest! {
        #[test]
        fn no_line_is_too_strange(
            bytes in prop::collection::vec(any::<u8>(), 0..120),
            fields in prop::collection::vec("[0-9.,NSEWAVM+-]{0,12}", 0..16),
            kind in prop::sample::select(vec!["GGA", "RMC", "GST", "HDT", "HDM"]),
        ) {
            read_line(&bytes);
            read_line(signed(&format!("GN{kind},{}", fields.join(","))).as_bytes());
        }
    }
}
