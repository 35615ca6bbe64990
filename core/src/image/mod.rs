//! Rasters: label images, their PNG form, connected components.

mod decode;
mod error;
mod label;
mod mask;
mod picture;
mod raster;
mod read;
mod write;

pub use error::ImageError;
pub use label::{LabelImage, RgbImage};
pub(crate) use mask::mask;
pub use picture::{averaged, read_picture, upright};
pub use raster::Raster;
pub use read::{LabelReading, read_label_file, read_labels};
pub use write::{colours_of_labels, write_grey16_png, write_label_png, write_rgb_png};

#[cfg(test)]
mod tests;
