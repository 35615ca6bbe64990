//! Label images as indexed PNG: the index is the class, the palette its colour.

use anyhow::Context;
use resurvey_schema::ClassTable;

/// The bytes of a PNG of `labels`, top row first.
pub fn encode(labels: &[u8], width: usize) -> anyhow::Result<Vec<u8>> {
    let palette: Vec<u8> = ClassTable::default().iter().flat_map(|class| class.colour).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, (labels.len() / width) as u32);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette);
    encoder.write_header().and_then(|mut writer| writer.write_image_data(labels)).context("writing a label image")?;
    Ok(bytes)
}
