//! Rasters without padding, so that pixels have one index.

use resurvey_plugin::{Comparison, Error, ImageRef};

/// Photo and view, row-major without padding.
pub struct Rasters {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Class per pixel of the photo.
    pub photo: Vec<u8>,
    /// Class per pixel of the view.
    pub view: Vec<u8>,
    /// Range per pixel of the view, metres; infinite where the ray hits nothing.
    pub range_m: Vec<f32>,
    /// Feature per pixel of the view, 0 for the base map.
    pub features: Vec<u32>,
}

impl Rasters {
    /// Copies of the rasters of `comparison`; an error when their sizes differ.
    pub fn new(comparison: &Comparison<'_>) -> Result<Self, Error> {
        let view = &comparison.view;
        let size = [comparison.photo.width(), comparison.photo.height()];
        let others = [
            [view.labels.width(), view.labels.height()],
            [view.range_m.width(), view.range_m.height()],
            [view.features.width(), view.features.height()],
        ];
        if let Some([width, height]) = others.into_iter().find(|other| *other != size) {
            let [expected_width, expected_height] = size;
            return Err(Error(format!(
                "expected a view of {expected_width}×{expected_height} pixels as the photo has, found {width}×{height}"
            )));
        }
        Ok(Self {
            width: size[0] as usize,
            height: size[1] as usize,
            photo: packed(comparison.photo),
            view: packed(view.labels),
            range_m: packed(view.range_m),
            features: packed(view.features),
        })
    }

    /// Whether the ray of pixel `index` hits nothing.
    pub fn is_sky(&self, index: usize) -> bool {
        !self.range_m[index].is_finite()
    }
}

fn packed<T: Copy>(image: ImageRef<'_, T>) -> Vec<T> {
    (0..image.height()).flat_map(|row| image.row(row)).copied().collect()
}
