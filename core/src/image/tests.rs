//! Label images through the public door: every form, every kind of damage, foreign tools' files.

use super::*;
use proptest::prelude::*;
use resurvey_schema::ClassTable;
use std::path::PathBuf;

/// The folder of shared test files, or `None` with a note when it is missing.
fn shared(name: &str) -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared"));
    let root = std::env::var_os("RESURVEY_SHARED").map_or(beside, PathBuf::from);
    let path = root.join(name);
    if !path.exists() {
        eprintln!("SKIPPED: {} is missing (set RESURVEY_SHARED)", path.display());
        return None;
    }
    Some(path)
}

fn png_of(width: u32, height: u32, colour: png::ColorType, depth: png::BitDepth, values: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    if colour == png::ColorType::Indexed {
        encoder.set_palette(
            (0..=255).flat_map(|grey| [grey, 7, 255 - grey]).take(3 << depth as usize).collect::<Vec<_>>(),
        );
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(values).unwrap();
    drop(writer);
    bytes
}

fn read(bytes: &[u8]) -> Result<LabelImage, ImageError> {
    read_labels(bytes, &ClassTable::default(), &LabelReading::default())
}

fn crc(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for &byte in bytes {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xEDB8_8320 } else { crc >> 1 };
        }
    }
    !crc
}

#[test]
fn the_index_is_the_class_at_every_bit_depth_whatever_the_palette_says() {
    use png::{BitDepth, ColorType::Indexed};
    // Width 5 leaves padding bits at the end of each row.
    let one = png_of(5, 2, Indexed, BitDepth::One, &[0b0101_1000, 0b1000_0000]);
    assert_eq!(read(&one).unwrap().values(), [0, 1, 0, 1, 1, 1, 0, 0, 0, 0]);
    let two = png_of(5, 1, Indexed, BitDepth::Two, &[0b0001_1011, 0b0100_0000]);
    assert_eq!(read(&two).unwrap().values(), [0, 1, 2, 3, 1]);
    let four = png_of(3, 2, Indexed, BitDepth::Four, &[0x01, 0x80, 0x76, 0x50]);
    assert_eq!(read(&four).unwrap().values(), [0, 1, 8, 7, 6, 5]);
    let eight = png_of(3, 1, Indexed, BitDepth::Eight, &[8, 255, 3]);
    assert_eq!(read(&eight).unwrap().values(), [8, 255, 3]);
    let grey = png_of(3, 1, png::ColorType::Grayscale, BitDepth::Eight, &[8, 255, 3]);
    assert_eq!(read(&grey).unwrap().values(), [8, 255, 3]);
}

#[test]
fn exact_colours_are_classes_and_transparent_pixels_are_void() {
    use png::BitDepth::Eight;
    // Colours from the table in conventions.md: metal, sky.
    let rgb = png_of(2, 1, png::ColorType::Rgb, Eight, &[255, 165, 0, 0, 0, 0]);
    assert_eq!(read(&rgb).unwrap().values(), [2, 6]);
    let rgba = png_of(3, 1, png::ColorType::Rgba, Eight, &[0, 255, 0, 255, 0, 0, 0, 0, 0, 255, 0, 255]);
    assert_eq!(read(&rgba).unwrap().values(), [1, 255, 1]);
}

#[test]
fn an_unknown_colour_names_its_pixel() {
    let rgb = png_of(2, 2, png::ColorType::Rgb, png::BitDepth::Eight, &[0, 0, 255, 0, 0, 255, 0, 0, 255, 0, 0, 254]);
    let error = read(&rgb).unwrap_err().to_string();
    assert!(error.contains("pixel (1, 1)") && error.contains("0,0,254"), "{error}");
}

#[test]
fn a_partly_transparent_pixel_is_refused() {
    let rgba = png_of(1, 1, png::ColorType::Rgba, png::BitDepth::Eight, &[0, 255, 0, 128]);
    assert!(matches!(read(&rgba), Err(ImageError::PartlyTransparent { x: 0, y: 0, alpha: 128 })));
}

#[test]
fn an_index_outside_the_table_names_its_pixel() {
    let indexed = png_of(2, 1, png::ColorType::Indexed, png::BitDepth::Eight, &[0, 9]);
    let error = read(&indexed).unwrap_err().to_string();
    assert!(error.contains("pixel (1, 0) has index 9") && error.contains("8 others"), "{error}");
}

#[test]
fn the_void_index_of_the_writer_becomes_void() {
    let indexed = png_of(3, 1, png::ColorType::Indexed, png::BitDepth::Eight, &[0, 1, 255]);
    let reading = LabelReading { void_index: Some(0), ..LabelReading::default() };
    let labels = read_labels(&indexed, &ClassTable::default(), &reading).unwrap();
    assert_eq!(labels.values(), [255, 1, 255]);
}

#[test]
fn a_near_colour_is_taken_only_within_the_distance_asked_for() {
    let rgb = png_of(1, 1, png::ColorType::Rgb, png::BitDepth::Eight, &[3, 251, 0]);
    let with = |distance| {
        let reading = LabelReading { nearest_colour: Some(distance), ..LabelReading::default() };
        read_labels(&rgb, &ClassTable::default(), &reading)
    };
    // |(3, 251, 0) − (0, 255, 0)| = 5.
    assert_eq!(with(5.0).unwrap().values(), [1]);
    assert!(matches!(with(4.9), Err(ImageError::FarColour { x: 0, y: 0, .. })));
    assert!(matches!(with(f64::NAN), Err(ImageError::BadTolerance { .. })));
}

#[test]
fn sixteen_bit_grey_is_refused_by_name() {
    let grey = png_of(1, 1, png::ColorType::Grayscale, png::BitDepth::Sixteen, &[0, 1]);
    assert!(read(&grey).unwrap_err().to_string().contains("Grayscale with 16 bits"));
}

#[test]
fn an_image_that_claims_an_absurd_size_is_refused_without_reading_it() {
    let mut bytes = png_of(1, 1, png::ColorType::Grayscale, png::BitDepth::Eight, &[0]);
    for (width, height) in [(1_000_000u32, 1_000_000u32), (u32::MAX >> 1, u32::MAX >> 1)] {
        bytes[16..20].copy_from_slice(&width.to_be_bytes());
        bytes[20..24].copy_from_slice(&height.to_be_bytes());
        let check = crc(&bytes[12..29]).to_be_bytes();
        bytes[29..33].copy_from_slice(&check);
        assert!(matches!(read(&bytes), Err(ImageError::TooLarge { .. })));
    }
}

#[test]
fn a_png_cut_off_anywhere_is_an_error() {
    let labels = Raster::from_values(7, 5, (0..35).map(|value| value % 9).collect()).unwrap();
    let bytes = write_label_png(&labels, &ClassTable::default()).unwrap();
    for length in 0..bytes.len() {
        assert!(read(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
    }
}

#[test]
fn written_images_are_what_another_decoder_sees() {
    let labels = Raster::from_values(3, 1, vec![1, 8, 255]).unwrap();
    let mut decoder =
        png::Decoder::new(std::io::Cursor::new(write_label_png(&labels, &ClassTable::default()).unwrap()));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut colours = [0; 9];
    reader.next_frame(&mut colours).unwrap();
    assert_eq!(colours, [0, 255, 0, 173, 216, 230, 128, 128, 128]);
    assert_eq!(colours_of_labels(&labels, &ClassTable::default()).values().as_flattened(), colours);

    let depth = write_grey16_png(&Raster::from_values(2, 1, vec![1, 0xABCD]).unwrap()).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(depth)).read_info().unwrap();
    let mut values = [0; 4];
    reader.next_frame(&mut values).unwrap();
    assert_eq!(values, [0, 1, 0xAB, 0xCD]);
}

#[test]
fn an_image_without_pixels_cannot_be_written() {
    let nothing = Raster::filled(0, 3, 0);
    assert!(matches!(write_label_png(&nothing, &ClassTable::default()), Err(ImageError::Empty { .. })));
}

#[test]
fn every_capture_of_the_cases_reads() {
    let Some(cases) = shared("cases") else { return };
    let mut read_images = 0;
    for case in std::fs::read_dir(cases).unwrap() {
        let path = case.unwrap().path().join("labels.png");
        if path.exists() {
            let labels = read_label_file(&path, &ClassTable::default(), &LabelReading::default()).unwrap();
            assert_eq!((labels.width(), labels.height()), (960, 720), "{}", path.display());
            read_images += 1;
        }
    }
    assert!(read_images >= 10);
}

#[test]
fn every_foreign_image_reads_or_gives_a_clear_error() {
    let Some(root) = shared("data/labels") else { return };
    let (mut folders, mut images) = (vec![root], 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let lossy = LabelReading { nearest_colour: Some(442.0), ..LabelReading::default() };
            let is_deep = path.to_string_lossy().contains("instanceIds");
            let is_image = path.extension().is_some_and(|suffix| suffix == "png" || suffix == "jpg");
            images += usize::from(is_image);
            match read_label_file(&path, &ClassTable::default(), &lossy) {
                Ok(labels) => assert!(is_image && !is_deep && labels.width() > 0, "{}", path.display()),
                Err(error) if is_image => {
                    let text = error.to_string();
                    assert!(text.contains("pixel (") || text.contains("16 bits"), "{text}");
                }
                Err(error) => assert!(error.to_string().contains("expected a PNG or JPG"), "{error}"),
            }
        }
    }
    assert!(images > 20);
}

#[test]
fn a_photo_reads_only_with_a_colour_distance_and_not_when_cut_off() {
    // Sizes as `file` prints them; two have a thumbnail with an end marker of its own.
    for (name, size) in [("IMAGE1.jpg", (400, 300)), ("IMAGE2.jpg", (800, 608)), ("CWALL02.jpg", (800, 446))] {
        let Some(path) = shared("data/3ds").map(|folder| folder.join(name)) else { return };
        let bytes = std::fs::read(path).unwrap();
        assert!(matches!(read(&bytes), Err(ImageError::Lossy)));
        let lossy = LabelReading { nearest_colour: Some(442.0), ..LabelReading::default() };
        let labels = read_labels(&bytes, &ClassTable::default(), &lossy).unwrap();
        assert_eq!((labels.width(), labels.height()), size);
        for length in (0..bytes.len()).step_by(997) {
            assert!(read_labels(&bytes[..length], &ClassTable::default(), &lossy).is_err(), "{name}: {length} bytes");
        }
    }
}

#[test]
fn flipped_bytes_of_a_photo_never_panic() {
    let Some(path) = shared("data/3ds/IMAGE1.jpg") else { return };
    let bytes = std::fs::read(path).unwrap();
    let lossy = LabelReading { nearest_colour: Some(442.0), ..LabelReading::default() };
    let mut seed = 1u64;
    for _ in 0..100 {
        let mut damaged = bytes.clone();
        for _ in 0..4 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // Headers break decoders more than pixels do: every other flip goes into the first 700 bytes.
            let span = if seed & 1 << 20 == 0 { 700 } else { damaged.len() };
            let position = (seed >> 33) as usize % span;
            damaged[position] ^= (seed >> 25) as u8;
        }
        let _ = read_labels(&damaged, &ClassTable::default(), &lossy);
    }
}

proptest! {
    #[test]
    fn labels_survive_writing_and_reading(width in 1u32..40, values in prop::collection::vec((0u8..10).prop_map(|value| if value == 9 { 255 } else { value }), 1..400)) {
        let height = (values.len() as u32).div_ceil(width);
        let mut values = values;
        values.resize((width * height) as usize, 0);
        let labels = Raster::from_values(width, height, values).unwrap();
        let bytes = write_label_png(&labels, &ClassTable::default()).unwrap();
        prop_assert_eq!(&bytes, &write_label_png(&labels, &ClassTable::default()).unwrap());
        prop_assert_eq!(read(&bytes).unwrap(), labels.clone());
        let picture = write_rgb_png(&colours_of_labels(&labels, &ClassTable::default())).unwrap();
        if !labels.values().contains(&255) {
            prop_assert_eq!(read(&picture).unwrap(), labels);
        }
    }

    #[test]
    fn flipped_bytes_never_panic(position in 0usize..10_000, value: u8, second in 0usize..10_000) {
        let labels = Raster::from_values(16, 16, (0..=255).map(|value| value % 9).collect()).unwrap();
        let mut bytes = write_label_png(&labels, &ClassTable::default()).unwrap();
        let length = bytes.len();
        bytes[position % length] = value;
        bytes[second % length] ^= value;
        let _ = read(&bytes);
    }

    #[test]
    fn random_bytes_are_no_image(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        prop_assert!(read(&bytes).is_err());
    }
}
