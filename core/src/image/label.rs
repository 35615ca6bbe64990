//! The images of a photo: a class index per pixel, or a colour.

use super::Raster;

/// Class index per pixel; 255 is void.
pub type LabelImage = Raster<u8>;

/// Red, green and blue per pixel, sRGB.
pub type RgbImage = Raster<[u8; 3]>;
