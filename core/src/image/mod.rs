//! Rasters: label images, their PNG form, connected components.

mod label;
mod raster;

pub use label::LabelImage;
pub use raster::Raster;
