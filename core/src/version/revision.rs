//! What names a version on the command line: a number, a tag, `head`, or a date.

use super::VersionId;
use jiff::Timestamp;
use jiff::civil::Date;
use jiff::tz::TimeZone;

/// A way to name a version.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Revision {
    /// `12` or `v12`.
    Number(VersionId),
    /// `head`, the newest.
    Head,
    /// `@2026-03-01T10:00:00+08:00`: the last version at or before this time. A date alone is the end of that day, UTC.
    At(Timestamp),
    /// Any other name.
    Tag(String),
}

/// A text that names no version.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidRevision {
    /// Not a date or time.
    #[error("{0:?} is not a time; expected @2026-03-01 or @2026-03-01T10:00:00+08:00 (with Z or an offset)")]
    Time(String),
    /// Not a name a tag can have.
    #[error("{0:?} is not a revision; expected a version number, a tag, head, or @DATE")]
    Name(String),
    /// Not two revisions.
    #[error("{0:?} is not a range; expected REV..REV, for example 3..head")]
    Range(String),
}

impl Revision {
    /// Reads a revision.
    pub fn parse(text: &str) -> Result<Self, InvalidRevision> {
        if let Some(time) = text.strip_prefix('@') {
            return parse_time(time).map(Self::At).ok_or_else(|| InvalidRevision::Time(text.to_owned()));
        }
        if text == "head" {
            return Ok(Self::Head);
        }
        if let Some(number) = parse_number(text) {
            return number.map(|number| Self::Number(VersionId(number))).ok_or(InvalidRevision::Name(text.to_owned()));
        }
        if is_tag_name(text) { Ok(Self::Tag(text.to_owned())) } else { Err(InvalidRevision::Name(text.to_owned())) }
    }

    /// Reads `REV..REV`.
    pub fn parse_range(text: &str) -> Result<(Self, Self), InvalidRevision> {
        let (from, to) = text.split_once("..").ok_or_else(|| InvalidRevision::Range(text.to_owned()))?;
        if from.is_empty() || to.is_empty() {
            return Err(InvalidRevision::Range(text.to_owned()));
        }
        Ok((Self::parse(from)?, Self::parse(to)?))
    }
}

/// Reads a date (the end of that day, UTC) or a time with its zone, with or without the `@` of a revision.
pub fn parse_moment(text: &str) -> Result<Timestamp, InvalidRevision> {
    parse_time(text.strip_prefix('@').unwrap_or(text)).ok_or_else(|| InvalidRevision::Time(text.to_owned()))
}

/// The number in `12` or `v12`; `Some(None)` when it has too many digits.
fn parse_number(text: &str) -> Option<Option<u64>> {
    let digits = text.strip_prefix('v').unwrap_or(text);
    (!digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit())).then(|| digits.parse().ok())
}

/// Whether a tag may have this name: letters, digits, `.`, `_`, `-`, `/`, no two dots together, and nothing that means
/// another revision.
pub(crate) fn is_tag_name(text: &str) -> bool {
    let plain = |character: char| character.is_alphanumeric() || "._-/".contains(character);
    !text.is_empty()
        && text.chars().all(plain)
        && !text.starts_with(['-', '.'])
        && !text.ends_with('.')
        && !text.contains("..")
        && !text.eq_ignore_ascii_case("head")
        && parse_number(text).is_none()
}

fn parse_time(text: &str) -> Option<Timestamp> {
    if let Ok(timestamp) = text.parse::<Timestamp>() {
        return Some(timestamp);
    }
    let is_date = text.len() == 10 && text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-');
    let date: Date = if is_date { text.parse().ok()? } else { return None };
    let end = date.to_datetime(jiff::civil::Time::constant(23, 59, 59, 999_999_999));
    end.to_zoned(TimeZone::UTC).ok().map(|zoned| zoned.timestamp())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_the_command_line_is_read() {
        assert_eq!(Revision::parse("12"), Ok(Revision::Number(VersionId(12))));
        assert_eq!(Revision::parse("v12"), Ok(Revision::Number(VersionId(12))));
        assert_eq!(Revision::parse("head"), Ok(Revision::Head));
        assert_eq!(Revision::parse("survey-2026/03"), Ok(Revision::Tag("survey-2026/03".to_owned())));
        let (from, to) = Revision::parse_range("3..head").unwrap();
        assert_eq!((from, to), (Revision::Number(VersionId(3)), Revision::Head));
    }

    #[test]
    fn a_time_with_an_offset_is_that_instant_and_a_date_is_the_end_of_its_day() {
        // 10:00 at +08:00 is 02:00 UTC; 1 772 330 400 s is 2026-03-01T02:00:00Z (date -u -d @1772330400).
        let Ok(Revision::At(time)) = Revision::parse("@2026-03-01T10:00:00+08:00") else { panic!() };
        assert_eq!(time.as_second(), 1_772_330_400);
        let Ok(Revision::At(end)) = Revision::parse("@2026-03-01") else { panic!() };
        assert_eq!(end.as_second(), 1_772_330_400 - 2 * 3600 + 86_399);
    }

    #[test]
    fn what_names_no_version_is_refused() {
        for text in
            ["", "@", "@yesterday", "@2026-03-01T10:00:00", "@2026-13-01", "a b", "-x", "a..b", "99999999999999999999"]
        {
            assert!(Revision::parse(text).is_err(), "{text}");
        }
        for text in ["3", "3..", "..3", ""] {
            assert_eq!(Revision::parse_range(text), Err(InvalidRevision::Range(text.to_owned())));
        }
    }
}
