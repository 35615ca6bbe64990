//! Rasters and views lent to a plugin for the length of one call.

use resurvey_schema::service::{PoseEstimate, ViewFeature};
use resurvey_schema::{GridPoint, Intrinsics};

/// A borrowed row-major image, top-left first. Rows may be padded: always go through [`row`](Self::row).
#[derive(Clone, Copy, Debug)]
pub struct ImageRef<'a, T> {
    data: &'a [T],
    width: u32,
    height: u32,
    stride: usize,
}

impl<'a, T: Copy> ImageRef<'a, T> {
    /// An image over `data` with `stride` values from one row to the next; `None` when `data` is too short.
    pub fn new(data: &'a [T], width: u32, height: u32, stride: usize) -> Option<Self> {
        let needed = if height == 0 { 0 } else { stride * (height as usize - 1) + width as usize };
        (stride >= width as usize && data.len() >= needed).then_some(Self { data, width, height, stride })
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Row `v`, left to right, without padding; panics outside.
    pub fn row(&self, v: u32) -> &'a [T] {
        let start = v as usize * self.stride;
        &self.data[start..start + self.width as usize]
    }

    /// The rows from the top, as [`row`](Self::row) gives each.
    pub fn rows(&self) -> impl Iterator<Item = &'a [T]> + use<'a, T> {
        let image = *self;
        (0..image.height).map(move |v| image.row(v))
    }

    /// The value at column `u`, row `v`; panics outside.
    pub fn at(&self, u: u32, v: u32) -> T {
        self.row(v)[u as usize]
    }
}

/// The map as seen from a pose: what one ray per pixel hits first (Lee & Hsu, Eq. 6–14).
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Where the offsets in `points` start.
    pub origin: GridPoint,
    /// Class per pixel; sky where the ray hits nothing.
    pub labels: ImageRef<'a, u8>,
    /// Distance along the ray, metres; infinite where the ray hits nothing.
    pub range_m: ImageRef<'a, f32>,
    /// Point hit, offset from `origin`, E, N, H, metres; NaN where the ray hits nothing.
    pub points: ImageRef<'a, [f32; 3]>,
    /// 0 for the base map and sky, otherwise 1 + index into `feature_table`.
    pub features: ImageRef<'a, u32>,
    /// The descriptors of the scene.
    pub feature_table: &'a [ViewFeature],
}

/// A view rendered for the plugin at a pose of its own choice; see [`View`] for the meaning of each raster.
#[derive(Clone, Debug)]
pub struct ViewImages {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Where the offsets in `points` start.
    pub origin: GridPoint,
    /// Class per pixel, no padding.
    pub labels: Vec<u8>,
    /// Range per pixel, metres.
    pub range_m: Vec<f32>,
    /// Point per pixel.
    pub points: Vec<[f32; 3]>,
    /// Feature per pixel.
    pub features: Vec<u32>,
    /// The descriptors of the scene, which `features` points into.
    pub feature_table: Vec<ViewFeature>,
}

impl ViewImages {
    /// The same as the host lends it to a matcher; panics when a raster has not `width` × `height` values.
    pub fn view(&self) -> View<'_> {
        View {
            origin: self.origin,
            labels: self.raster(&self.labels),
            range_m: self.raster(&self.range_m),
            points: self.raster(&self.points),
            features: self.raster(&self.features),
            feature_table: &self.feature_table,
        }
    }

    fn raster<'a, T: Copy>(&self, values: &'a [T]) -> ImageRef<'a, T> {
        let image = ImageRef::new(values, self.width, self.height, self.width as usize);
        image.expect("invariant: every raster has width × height values")
    }
}

/// Photo and view of the same pose, side by side.
#[derive(Clone, Copy, Debug)]
pub struct Comparison<'a> {
    /// Class per pixel of the photo; 255 is void.
    pub photo: ImageRef<'a, u8>,
    /// The map as seen from `estimate.pose`.
    pub view: View<'a>,
    /// The camera of both.
    pub camera: Intrinsics,
    /// Where both were taken.
    pub estimate: PoseEstimate,
}
