//! Pixels out of PNG and JPG files, without any conversion of PNG values.

use super::ImageError;
use std::io::Cursor;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// Most pixels that are read. A phone photo has 12–50 million; a few hundred bytes of PNG can claim 10¹⁸.
pub(super) const MAX_PIXELS: u64 = 100_000_000;

/// Widest or highest JPG, the format's own limit.
const MAX_JPG_SIDE_PX: usize = 65_535;

/// An image as its file holds it.
pub(super) struct Decoded {
    pub width: u32,
    pub height: u32,
    pub pixels: Pixels,
}

/// Pixel values, row by row, top-left first.
pub(super) enum Pixels {
    /// Palette indices or grey values, one byte a pixel, not scaled.
    Index(Vec<u8>),
    /// Exact colours of `channels` (3 or 4) bytes.
    Colour { values: Vec<u8>, channels: usize },
    /// Red, green, blue after a lossy compression.
    Lossy(Vec<u8>),
}

/// The pixels of a PNG or JPG file.
pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, ImageError> {
    match bytes {
        [0x89, b'P', b'N', b'G', ..] => decode_png(bytes),
        [0xFF, 0xD8, 0xFF, ..] => decode_jpg(bytes),
        [] => Err(ImageError::NotAnImage { found: "an empty file".to_owned() }),
        _ => {
            let start: Vec<String> = bytes.iter().take(4).map(|byte| format!("{byte:02x}")).collect();
            Err(ImageError::NotAnImage { found: format!("content that begins with bytes {}", start.join(" ")) })
        }
    }
}

/// Whether a file begins as a PNG does.
pub(super) fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x89, b'P', b'N', b'G'])
}

/// Width, height, and red, green and blue of each pixel of a PNG, whatever its form.
pub(super) fn decode_png_colours(bytes: &[u8]) -> Result<(u32, u32, Vec<u8>), ImageError> {
    let damaged = |error: png::DecodingError| ImageError::Damaged { format: "PNG", reason: error.to_string() };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: 1 << 29 });
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::STRIP_16);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let header = decoder.read_header_info().map_err(damaged)?;
    let (width, height) = (header.width, header.height);
    check_size(width, height)?;
    let mut reader = decoder.read_info().map_err(damaged)?;
    let oversize = || ImageError::TooLarge { width, height, limit_px: MAX_PIXELS };
    let mut values = vec![0; reader.output_buffer_size().ok_or_else(oversize)?];
    let frame = reader.next_frame(&mut values).map_err(damaged)?;
    reader.finish().map_err(damaged)?;
    let colours = match frame.color_type {
        png::ColorType::Rgb => values,
        png::ColorType::Rgba => values.chunks_exact(4).flat_map(|colour| [colour[0], colour[1], colour[2]]).collect(),
        png::ColorType::Grayscale => values.iter().flat_map(|grey| [*grey; 3]).collect(),
        png::ColorType::GrayscaleAlpha => values.chunks_exact(2).flat_map(|grey| [grey[0]; 3]).collect(),
        png::ColorType::Indexed => return Err(ImageError::PixelForm { found: "indices without a palette".to_owned() }),
    };
    Ok((width, height, colours))
}

fn decode_png(bytes: &[u8]) -> Result<Decoded, ImageError> {
    let damaged = |error: png::DecodingError| ImageError::Damaged { format: "PNG", reason: error.to_string() };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: 1 << 29 });
    decoder.set_transformations(png::Transformations::IDENTITY);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let header = decoder.read_header_info().map_err(damaged)?;
    let (width, height) = (header.width, header.height);
    check_size(width, height)?;
    let (colour, depth) = (header.color_type, header.bit_depth as usize);
    let channels = match (colour, depth) {
        (png::ColorType::Indexed | png::ColorType::Grayscale, 1..=8) => 1,
        (png::ColorType::Rgb, 8) => 3,
        (png::ColorType::Rgba, 8) => 4,
        _ => return Err(ImageError::PixelForm { found: format!("{colour:?} with {depth} bits a channel") }),
    };
    let mut reader = decoder.read_info().map_err(damaged)?;
    let oversize = || ImageError::TooLarge { width, height, limit_px: MAX_PIXELS };
    let mut values = vec![0; reader.output_buffer_size().ok_or_else(oversize)?];
    reader.next_frame(&mut values).map_err(damaged)?;
    reader.finish().map_err(damaged)?;
    let pixels = match channels {
        1 if depth == 8 => Pixels::Index(values),
        1 => Pixels::Index(unpack(&values, width as usize, depth)),
        _ => Pixels::Colour { values, channels },
    };
    Ok(Decoded { width, height, pixels })
}

/// One byte a sample from rows of `depth` (1, 2 or 4) bits a sample, each row padded to a byte.
fn unpack(packed: &[u8], width: usize, depth: usize) -> Vec<u8> {
    let mask = (1 << depth) - 1;
    let row_bytes = (width * depth).div_ceil(8);
    let sample = |row: &[u8], column: usize| {
        let bit = column * depth;
        (row[bit / 8] >> (8 - depth - bit % 8)) & mask
    };
    packed.chunks_exact(row_bytes).flat_map(|row| (0..width).map(move |column| sample(row, column))).collect()
}

fn decode_jpg(bytes: &[u8]) -> Result<Decoded, ImageError> {
    let damaged = |reason: String| ImageError::Damaged { format: "JPG", reason };
    // The decoder fills what is missing with grey; a file that ends before its end marker was cut off.
    if !bytes.windows(2).rev().any(|pair| pair == [0xFF, 0xD9]) {
        return Err(damaged("the end marker is missing".to_owned()));
    }
    let options = DecoderOptions::new_safe()
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_max_width(MAX_JPG_SIDE_PX)
        .set_max_height(MAX_JPG_SIDE_PX)
        .set_strict_mode(true);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|error| damaged(error.to_string()))?;
    let info = decoder.info().ok_or_else(|| damaged("there is no frame header".to_owned()))?;
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    check_size(width, height)?;
    let values = decoder.decode().map_err(|error| damaged(error.to_string()))?;
    if values.len() as u64 != u64::from(width) * u64::from(height) * 3 {
        return Err(damaged(format!("expected {width}×{height} pixels, found {} values", values.len())));
    }
    Ok(Decoded { width, height, pixels: Pixels::Lossy(values) })
}

fn check_size(width: u32, height: u32) -> Result<(), ImageError> {
    match u64::from(width) * u64::from(height) {
        1..=MAX_PIXELS => Ok(()),
        _ => Err(ImageError::TooLarge { width, height, limit_px: MAX_PIXELS }),
    }
}
