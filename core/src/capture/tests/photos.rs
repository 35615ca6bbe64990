//! Small photos: a TIFF or JPEG file with these EXIF tags and no picture.

use exif::experimental::Writer;
use exif::{Field, In, Rational, Tag, Value};
use std::io::Cursor;

/// A tag with a text.
pub fn text(tag: Tag, text: &str) -> Field {
    Field { tag, ifd_num: In::PRIMARY, value: Value::Ascii(vec![text.as_bytes().to_vec()]) }
}

/// A tag with fractions.
pub fn fractions(tag: Tag, fractions: &[(u32, u32)]) -> Field {
    let values = fractions.iter().map(|(num, denom)| Rational { num: *num, denom: *denom }).collect();
    Field { tag, ifd_num: In::PRIMARY, value: Value::Rational(values) }
}

/// A tag with a byte.
pub fn byte(tag: Tag, byte: u8) -> Field {
    Field { tag, ifd_num: In::PRIMARY, value: Value::Byte(vec![byte]) }
}

/// What an iPhone writes at 22° 18′ 7.29″ N, 114° 10′ 17.26″ E: true heading 311.25°, 31.4 m, ±4.7 m.
pub fn of_a_phone() -> Vec<Field> {
    vec![
        text(Tag::Make, "Apple"),
        text(Tag::DateTimeOriginal, "2026:06:01 10:28:00"),
        text(Tag::OffsetTimeOriginal, "+08:00"),
        text(Tag::GPSLatitudeRef, "N"),
        fractions(Tag::GPSLatitude, &[(22, 1), (18, 1), (729, 100)]),
        text(Tag::GPSLongitudeRef, "E"),
        fractions(Tag::GPSLongitude, &[(114, 1), (10, 1), (1726, 100)]),
        byte(Tag::GPSAltitudeRef, 0),
        fractions(Tag::GPSAltitude, &[(314, 10)]),
        text(Tag::GPSImgDirectionRef, "T"),
        fractions(Tag::GPSImgDirection, &[(31125, 100)]),
        fractions(Tag::GPSHPositioningError, &[(47, 10)]),
    ]
}

/// The phone's tags without some of them, and with others.
pub fn of_a_phone_but(without: &[Tag], with: Vec<Field>) -> Vec<Field> {
    let mut fields = of_a_phone();
    fields.retain(|field| !without.contains(&field.tag) && !with.iter().any(|other| other.tag == field.tag));
    fields.extend(with);
    fields
}

/// A TIFF file.
pub fn tiff(fields: &[Field], is_little_endian: bool) -> Vec<u8> {
    let mut writer = Writer::new();
    for field in fields {
        writer.push_field(field);
    }
    let mut bytes = Cursor::new(Vec::new());
    writer.write(&mut bytes, is_little_endian).unwrap();
    bytes.into_inner()
}

/// A JPEG file: start of image, APP1 with the EXIF, end of image.
pub fn jpeg(fields: &[Field]) -> Vec<u8> {
    let tiff = tiff(fields, false);
    let length = u16::try_from(tiff.len() + 8).unwrap().to_be_bytes();
    [&[0xff, 0xd8, 0xff, 0xe1], &length[..], b"Exif\0\0", &tiff, &[0xff, 0xd9]].concat()
}
