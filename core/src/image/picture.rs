//! Photos as segmenters see them: red, green and blue out of PNG and JPG files, upright, averaged down.

use super::decode::{Pixels, decode, decode_png_colours, is_png};
use super::{ImageError, Raster, RgbImage};

/// The colours of a PNG or JPG file in memory, as they lie in the file. Grey and palette images become colours, 16 bits
/// become 8, and transparency is left out.
pub fn read_picture(bytes: &[u8]) -> Result<RgbImage, ImageError> {
    let (width, height, values) = if is_png(bytes) {
        decode_png_colours(bytes)?
    } else {
        let decoded = decode(bytes)?;
        match decoded.pixels {
            Pixels::Lossy(values) => (decoded.width, decoded.height, values),
            Pixels::Index(_) | Pixels::Colour { .. } => return Err(damaged("expected colours of a JPG")),
        }
    };
    let (colours, rest) = values.as_chunks::<3>();
    let raster = Raster::from_values(width, height, colours.to_vec()).filter(|_| rest.is_empty());
    raster.ok_or_else(|| damaged("the number of values is not that of the pixels"))
}

fn damaged(reason: &str) -> ImageError {
    ImageError::Damaged { format: "image", reason: reason.to_owned() }
}

/// `picture` turned as EXIF `orientation` (1–8, TIFF 6.0) says; `None` for another number.
pub fn upright(picture: RgbImage, orientation: u32) -> Option<RgbImage> {
    let (last_u, last_v) = (picture.width().saturating_sub(1), picture.height().saturating_sub(1));
    // Where a pixel of the upright picture lies in the file.
    let source: fn(u32, u32, u32, u32) -> (u32, u32) = match orientation {
        1 => return Some(picture),
        2 => |u, v, last_u, _| (last_u - u, v),
        3 => |u, v, last_u, last_v| (last_u - u, last_v - v),
        4 => |u, v, _, last_v| (u, last_v - v),
        5 => |u, v, _, _| (v, u),
        6 => |u, v, _, last_v| (v, last_v - u),
        7 => |u, v, last_u, last_v| (last_u - v, last_v - u),
        8 => |u, v, last_u, _| (last_u - v, u),
        _ => return None,
    };
    let is_turned = orientation >= 5;
    let (width, height) =
        if is_turned { (picture.height(), picture.width()) } else { (picture.width(), picture.height()) };
    let pixels = (0..height).flat_map(|v| (0..width).map(move |u| (u, v)));
    let colour = |(u, v)| {
        let (from_u, from_v) = source(u, v, last_u, last_v);
        picture.at(from_u, from_v)
    };
    Raster::from_values(width, height, pixels.map(colour).collect())
}

/// `picture` at `width` × `height`, at most its own size: each pixel is the average of the sRGB values over the area that
/// it covers, parts of pixels by their share.
pub fn averaged(picture: &RgbImage, (width, height): (u32, u32)) -> RgbImage {
    if (picture.width(), picture.height()) == (width, height) {
        return picture.clone();
    }
    let columns = shares(picture.width(), width);
    let mut averaged = Raster::filled(width, height, [0; 3]);
    for (v, rows) in shares(picture.height(), height).iter().enumerate() {
        for (u, of_column) in columns.iter().enumerate() {
            let (mut sum, mut total) = ([0.0; 3], 0.0);
            for &(row, share) in rows {
                let values = picture.row(row);
                for &(column, of_row) in of_column {
                    let weight = share * of_row;
                    total += weight;
                    let colour = values[column as usize];
                    (0..3).for_each(|channel| sum[channel] += weight * f64::from(colour[channel]));
                }
            }
            averaged.set(u as u32, v as u32, sum.map(|value| (value / total).round() as u8));
        }
    }
    averaged
}

/// For each of `to` cells over `from` pixels, the pixels that it covers, with the share of each.
fn shares(from: u32, to: u32) -> Vec<Vec<(u32, f64)>> {
    let step = f64::from(from) / f64::from(to);
    let cell = |index: u32| {
        let (start, end) = (f64::from(index) * step, f64::from(index + 1) * step);
        let pixels = start as u32..(end.ceil() as u32).min(from);
        let share = |pixel: u32| end.min(f64::from(pixel) + 1.0) - start.max(f64::from(pixel));
        pixels.map(|pixel| (pixel, share(pixel))).filter(|(_, share)| *share > 0.0).collect()
    };
    (0..to).map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of `width` columns whose red counts its pixels.
    fn counted(width: u32, height: u32) -> RgbImage {
        let values = (0..width * height).map(|index| [index as u8, 0, 0]).collect();
        Raster::from_values(width, height, values).unwrap()
    }

    fn reds(picture: &RgbImage) -> Vec<u8> {
        picture.values().iter().map(|colour| colour[0]).collect()
    }

    /// Where row 0 and column 0 of the file are shown, by the table of TIFF 6.0, tag 274.
    #[test]
    fn every_orientation_is_turned_as_tiff_says() {
        let expected = [
            (1, (3, 2), [0, 1, 2, 3, 4, 5]), // top, left
            (2, (3, 2), [2, 1, 0, 5, 4, 3]), // top, right
            (3, (3, 2), [5, 4, 3, 2, 1, 0]), // bottom, right
            (4, (3, 2), [3, 4, 5, 0, 1, 2]), // bottom, left
            (5, (2, 3), [0, 3, 1, 4, 2, 5]), // left, top
            (6, (2, 3), [3, 0, 4, 1, 5, 2]), // right, top
            (7, (2, 3), [5, 2, 4, 1, 3, 0]), // right, bottom
            (8, (2, 3), [2, 5, 1, 4, 0, 3]), // left, bottom
        ];
        for (orientation, size, values) in expected {
            let turned = upright(counted(3, 2), orientation).unwrap();
            assert_eq!(((turned.width(), turned.height()), reds(&turned)), (size, values.to_vec()), "{orientation}");
        }
        assert!(upright(counted(3, 2), 0).is_none() && upright(counted(3, 2), 9).is_none());
    }

    #[test]
    fn an_average_counts_parts_of_pixels_by_their_area() {
        // Three columns to two: the middle one goes half to each side.
        let picture = Raster::from_values(3, 1, vec![[30, 0, 0], [60, 0, 0], [90, 0, 0]]).unwrap();
        assert_eq!(reds(&averaged(&picture, (2, 1))), [40, 80]);
        let blocks = Raster::from_values(2, 2, vec![[0; 3], [10; 3], [20; 3], [30; 3]]).unwrap();
        assert_eq!(averaged(&blocks, (1, 1)).values(), [[15; 3]]);
        assert_eq!(averaged(&picture, (3, 1)), picture);
    }
}
