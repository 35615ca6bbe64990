//! Reading label images: classes out of indexed, grey and colour images.

use super::decode::{Decoded, Pixels, decode};
use super::{ImageError, LabelImage, Raster};
use resurvey_schema::{ClassId, ClassTable};
use std::path::Path;

/// What a label image may leave open.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LabelReading {
    /// The index that the writer used for "unlabelled", beside 255. Concerns indexed and grey images only.
    pub void_index: Option<u8>,
    /// Largest distance in RGB (0–441.7) from a pixel to the class colour it is taken for. `None` demands exact
    /// colours, and refuses JPG.
    pub nearest_colour: Option<f64>,
}

/// The class per pixel of a PNG or JPG file in memory.
///
/// The value of an indexed image is the class, whatever colours its palette has, at 1, 2, 4 and 8 bits; the value of a
/// grey image likewise, not scaled to 0–255. RGB and RGBA must have exactly the colours of `classes`; a fully
/// transparent pixel is void. A value that is no class is an error that names the first such pixel.
pub fn read_labels(bytes: &[u8], classes: &ClassTable, reading: &LabelReading) -> Result<LabelImage, ImageError> {
    let Decoded { width, height, pixels } = decode(bytes)?;
    let labels = match pixels {
        Pixels::Index(values) => labels_of_indices(values, width, classes, reading)?,
        Pixels::Colour { values, channels } => labels_of_colours(&values, channels, width, classes, reading)?,
        Pixels::Lossy(_) if reading.nearest_colour.is_none() => return Err(ImageError::Lossy),
        Pixels::Lossy(values) => labels_of_colours(&values, 3, width, classes, reading)?,
    };
    let found = labels.len();
    Raster::from_values(width, height, labels).ok_or_else(|| ImageError::Damaged {
        format: "PNG",
        reason: format!("expected {width}×{height} pixels, found {found}"),
    })
}

/// The class per pixel of a PNG or JPG file.
pub fn read_label_file(path: &Path, classes: &ClassTable, reading: &LabelReading) -> Result<LabelImage, ImageError> {
    let bytes = std::fs::read(path).map_err(|source| ImageError::Io { path: path.to_owned(), source })?;
    read_labels(&bytes, classes, reading)
        .map_err(|source| ImageError::InFile { path: path.to_owned(), source: Box::new(source) })
}

fn labels_of_indices(
    mut values: Vec<u8>,
    width: u32,
    classes: &ClassTable,
    reading: &LabelReading,
) -> Result<Vec<u8>, ImageError> {
    let mut label_of_index = [None; 256];
    for class in classes.iter() {
        label_of_index[usize::from(class.index.0)] = Some(class.index.0);
    }
    for void in reading.void_index.into_iter().chain([ClassId::VOID.0]) {
        label_of_index[usize::from(void)] = Some(ClassId::VOID.0);
    }
    for (position, value) in values.iter_mut().enumerate() {
        *value = label_of_index[usize::from(*value)].ok_or_else(|| {
            let (x, y) = pixel(position, width);
            ImageError::UnknownIndex { x, y, index: *value, known: known_indices(classes) }
        })?;
    }
    Ok(values)
}

fn known_indices(classes: &ClassTable) -> String {
    classes.iter().map(|class| format!("{} {}", class.index.0, class.name)).collect::<Vec<_>>().join(", ")
}

fn labels_of_colours(
    values: &[u8],
    channels: usize,
    width: u32,
    classes: &ClassTable,
    reading: &LabelReading,
) -> Result<Vec<u8>, ImageError> {
    let count = classes.iter().count();
    if let Some(distance) = reading.nearest_colour
        && (distance.is_nan() || distance < 0.0 || count == 0)
    {
        return Err(ImageError::BadTolerance { distance, classes: count });
    }
    // Neighbours mostly repeat: the last answer saves the search.
    let mut last = None;
    let mut labels = Vec::with_capacity(values.len() / channels);
    for (position, value) in values.chunks_exact(channels).enumerate() {
        let colour = [value[0], value[1], value[2]];
        let label = match (value.get(3), last) {
            (Some(0), _) => ClassId::VOID.0,
            (Some(&alpha @ 1..=254), _) if reading.nearest_colour.is_none() => {
                let (x, y) = pixel(position, width);
                return Err(ImageError::PartlyTransparent { x, y, alpha });
            }
            (_, Some((known, label))) if known == colour => label,
            _ => label_of_colour(colour, pixel(position, width), classes, reading)?,
        };
        if label != ClassId::VOID.0 {
            last = Some((colour, label));
        }
        labels.push(label);
    }
    Ok(labels)
}

fn label_of_colour(
    colour: [u8; 3],
    (x, y): (u32, u32),
    classes: &ClassTable,
    reading: &LabelReading,
) -> Result<u8, ImageError> {
    if let Some(class) = classes.by_colour(colour) {
        return Ok(class.index.0);
    }
    let unknown = ImageError::UnknownColour { x, y, colour };
    let Some(limit) = reading.nearest_colour else { return Err(unknown) };
    let squared =
        |other: [u8; 3]| -> i32 { colour.iter().zip(other).map(|(&a, b)| (i32::from(a) - i32::from(b)).pow(2)).sum() };
    // `min_by_key` keeps the first of equals: the lower index.
    let Some(nearest) = classes.iter().min_by_key(|class| squared(class.colour)) else { return Err(unknown) };
    let distance = f64::from(squared(nearest.colour)).sqrt();
    if distance > limit {
        return Err(ImageError::FarColour { x, y, colour, nearest: nearest.name.clone(), distance, limit });
    }
    Ok(nearest.index.0)
}

fn pixel(position: usize, width: u32) -> (u32, u32) {
    let width = width as usize;
    ((position % width) as u32, (position / width) as u32)
}
