//! Label images: a class index per pixel.

use super::Raster;

/// Class index per pixel; 255 is void.
pub type LabelImage = Raster<u8>;
