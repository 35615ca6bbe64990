//! What the EXIF of a photo says.

use super::photos::{byte, fractions, jpeg, of_a_phone, of_a_phone_but, text, tiff};
use crate::capture::{ExifError, Fix, Heading, North, SensedDatum, read_exif};
use exif::{Field, Tag};
use proptest::prelude::*;

fn read(fields: &[Field]) -> Result<Fix, ExifError> {
    read_exif(&jpeg(fields))
}

fn message(fields: &[Field]) -> String {
    read(fields).unwrap_err().to_string()
}

#[test]
fn a_phones_photo_says_where_when_and_which_way() {
    for bytes in [jpeg(&of_a_phone()), tiff(&of_a_phone(), true), tiff(&of_a_phone(), false)] {
        let fix = read_exif(&bytes).unwrap();
        // 22 + 18/60 + 7.29/3600 and 114 + 10/60 + 17.26/3600.
        assert!((fix.latitude_deg - 22.302_025).abs() < 1e-9, "{fix:?}");
        assert!((fix.longitude_deg - 114.171_461_111).abs() < 1e-9, "{fix:?}");
        assert_eq!(fix.position_sigma_m, Some(4.7));
        assert_eq!(fix.heading, Some(Heading { heading_deg: 311.25, north: North::True }));
        assert_eq!(fix.taken_at.unwrap().to_string(), "2026-06-01T02:28:00Z");
        let height = fix.height.unwrap();
        assert_eq!((height.height_m, height.datum), (31.4, SensedDatum::SeaLevel));
        assert!(height.sigma_m > 10.0, "phones are off by 13 to 33 m: {}", height.sigma_m);
    }
}

#[test]
fn south_and_west_are_negative() {
    let with = vec![text(Tag::GPSLatitudeRef, "S"), text(Tag::GPSLongitudeRef, "W")];
    let fix = read(&of_a_phone_but(&[], with)).unwrap();
    assert!(fix.latitude_deg < -22.0 && fix.longitude_deg < -114.0);
}

#[test]
fn the_four_altitude_references_are_told_apart() {
    for (reference, sign, datum) in [
        (0, 1.0, SensedDatum::SeaLevel),
        (1, -1.0, SensedDatum::SeaLevel),
        (2, 1.0, SensedDatum::Ellipsoid),
        (3, -1.0, SensedDatum::Ellipsoid),
    ] {
        let height = read(&of_a_phone_but(&[], vec![byte(Tag::GPSAltitudeRef, reference)])).unwrap().height.unwrap();
        assert_eq!((height.height_m, height.datum), (sign * 31.4, datum));
    }
    assert!(message(&of_a_phone_but(&[], vec![byte(Tag::GPSAltitudeRef, 9)])).contains("GPSAltitudeRef is 9"));
}

#[test]
fn a_heading_is_magnetic_true_or_missing() {
    let magnetic = read(&of_a_phone_but(&[], vec![text(Tag::GPSImgDirectionRef, "M")])).unwrap();
    assert_eq!(magnetic.heading.unwrap().north, North::Magnetic);
    // The standard's default.
    assert_eq!(read(&of_a_phone_but(&[Tag::GPSImgDirectionRef], vec![])).unwrap().heading.unwrap().north, North::True);
    for blank in
        [vec![], vec![fractions(Tag::GPSImgDirection, &[(0, 0)])], vec![fractions(Tag::GPSImgDirection, &[(500, 1)])]]
    {
        assert_eq!(read(&of_a_phone_but(&[Tag::GPSImgDirection], blank)).unwrap().heading, None);
    }
    assert!(message(&of_a_phone_but(&[], vec![text(Tag::GPSImgDirectionRef, "X")])).contains("GPSImgDirectionRef"));
}

#[test]
fn a_missing_altitude_sigma_and_time_are_missing() {
    let without = [Tag::GPSAltitude, Tag::GPSHPositioningError, Tag::OffsetTimeOriginal];
    let fix = read(&of_a_phone_but(&without, vec![])).unwrap();
    assert_eq!((fix.height, fix.position_sigma_m, fix.taken_at), (None, None, None));
    let clock =
        vec![text(Tag::GPSDateStamp, "2026:06:01"), fractions(Tag::GPSTimeStamp, &[(2, 1), (27, 1), (595, 10)])];
    let fix = read(&of_a_phone_but(&without, clock)).unwrap();
    assert_eq!(fix.taken_at.unwrap().to_string(), "2026-06-01T02:27:59.5Z");
}

#[test]
fn a_photo_without_a_position_is_refused_by_tag() {
    for tag in [Tag::GPSLatitude, Tag::GPSLongitude, Tag::GPSLatitudeRef, Tag::GPSLongitudeRef] {
        let message = message(&of_a_phone_but(&[tag], vec![]));
        assert!(message.contains("expected a position in the EXIF, found no GPSL"), "{message}");
    }
    // 0/0 is how "unknown" is written.
    let unknown = fractions(Tag::GPSLatitude, &[(0, 0), (0, 0), (0, 0)]);
    assert!(message(&of_a_phone_but(&[], vec![unknown])).contains("no GPSLatitude"));
    let beyond = fractions(Tag::GPSLatitude, &[(91, 1), (0, 1), (0, 1)]);
    assert!(message(&of_a_phone_but(&[], vec![beyond])).contains("up to 90 degrees"));
    let minutes = fractions(Tag::GPSLongitude, &[(114, 1), (60, 1), (0, 1)]);
    assert!(message(&of_a_phone_but(&[], vec![minutes])).contains("GPSLongitude is"));
    assert!(message(&of_a_phone_but(&[], vec![text(Tag::GPSLatitudeRef, "north")])).contains("\"N\" or \"S\""));
    assert!(
        message(&of_a_phone_but(&[], vec![text(Tag::GPSMapDatum, "TOKYO")])).contains("\"TOKYO\"; expected WGS-84")
    );
    assert!(read(&of_a_phone_but(&[], vec![text(Tag::GPSMapDatum, "WGS-84")])).is_ok());
}

#[test]
fn a_file_without_exif_is_refused() {
    for bytes in [&b""[..], b"\xff\xd8\xff\xd9", b"GIF89a", b"MM\0*\0\0\0\x08", &[0; 5000]] {
        let message = read_exif(bytes).unwrap_err().to_string();
        assert!(message.starts_with("expected a"), "{message}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_photo_is_too_strange(
        noise in prop::collection::vec(any::<u8>(), 0..200),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8),
        cut in any::<prop::sample::Index>(),
        is_jpeg in any::<bool>(),
    ) {
        let _ = read_exif(&noise);
        let mut photo = if is_jpeg { jpeg(&of_a_phone()) } else { tiff(&of_a_phone(), true) };
        let _ = read_exif(&photo[..cut.index(photo.len())]);
        for (at, value) in changes {
            let at = at.index(photo.len());
            photo[at] = value;
        }
        if let Ok(fix) = read_exif(&photo) {
            prop_assert!(fix.latitude_deg.abs() <= 90.0 && fix.longitude_deg.abs() <= 180.0);
            prop_assert!(fix.height.is_none_or(|height| height.height_m.is_finite()));
        }
    }
}
