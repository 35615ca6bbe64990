//! Writing PNG: label images with the palette of the class table, depth as 16-bit grey, pictures.

use super::{ImageError, LabelImage, Raster};
use resurvey_schema::{ClassId, ClassTable};

/// Colour of void and of indices without a class, in palettes and pictures only: no class of the default table has it.
const VOID_COLOUR: [u8; 3] = [128, 128, 128];

/// An 8-bit indexed PNG whose index is the class and whose palette has the class colours. Same labels, same bytes.
pub fn write_label_png(labels: &LabelImage, classes: &ClassTable) -> Result<Vec<u8>, ImageError> {
    let palette: Vec<u8> =
        (0..=255).flat_map(|index| classes.get(ClassId(index)).map_or(VOID_COLOUR, |class| class.colour)).collect();
    let form = Form { colour: png::ColorType::Indexed, depth: png::BitDepth::Eight, palette: Some(palette) };
    encode(labels.width(), labels.height(), form, labels.values())
}

/// A 16-bit grey PNG. For depth the caller chooses the unit and the value for "nothing hit".
pub fn write_grey16_png(values: &Raster<u16>) -> Result<Vec<u8>, ImageError> {
    let bytes: Vec<u8> = values.values().iter().flat_map(|value| value.to_be_bytes()).collect();
    let form = Form { colour: png::ColorType::Grayscale, depth: png::BitDepth::Sixteen, palette: None };
    encode(values.width(), values.height(), form, &bytes)
}

/// An 8-bit RGB PNG.
pub fn write_rgb_png(colours: &Raster<[u8; 3]>) -> Result<Vec<u8>, ImageError> {
    let form = Form { colour: png::ColorType::Rgb, depth: png::BitDepth::Eight, palette: None };
    encode(colours.width(), colours.height(), form, colours.values().as_flattened())
}

/// The colour per pixel that shows `labels`; void is mid-grey.
pub fn colours_of_labels(labels: &LabelImage, classes: &ClassTable) -> Raster<[u8; 3]> {
    let mut colours = Raster::filled(labels.width(), labels.height(), VOID_COLOUR);
    for (colour, &label) in colours.values_mut().iter_mut().zip(labels.values()) {
        *colour = classes.get(ClassId(label)).map_or(VOID_COLOUR, |class| class.colour);
    }
    colours
}

struct Form {
    colour: png::ColorType,
    depth: png::BitDepth,
    palette: Option<Vec<u8>>,
}

fn encode(width: u32, height: u32, form: Form, values: &[u8]) -> Result<Vec<u8>, ImageError> {
    if width == 0 || height == 0 {
        return Err(ImageError::Empty { width, height });
    }
    let refused = |error: png::EncodingError| ImageError::Write(error.to_string());
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(form.colour);
    encoder.set_depth(form.depth);
    if let Some(palette) = form.palette {
        encoder.set_palette(palette);
    }
    let mut writer = encoder.write_header().map_err(refused)?;
    writer.write_image_data(values).map_err(refused)?;
    writer.finish().map_err(refused)?;
    Ok(bytes)
}
