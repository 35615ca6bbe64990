//! A model as its file describes it, the same for every format: what import checks and turns into objects.

use super::{ImportError, Up, Wrap};
use resurvey_schema::GridPoint;

/// Most vertices, and most triangles, of one import: about a hundred square kilometres of city at 200 000 triangles
/// each.
pub(super) const MAX_ELEMENTS: usize = 20_000_000;

/// What a reader of a format found. Indices into `materials` and `images` are valid; nothing else is checked.
#[derive(Debug)]
pub(super) struct Model {
    /// Name of the format.
    pub format: &'static str,
    /// The format's own up axis.
    pub up: Up,
    /// Where the file itself says that its zero lies.
    pub grid_origin: Option<GridPoint>,
    pub parts: Vec<Part>,
    pub materials: Vec<Material>,
    pub images: Vec<Image>,
    /// Points and lines, which have no surface.
    pub skipped_primitives: usize,
    pub warnings: Vec<String>,
}

/// One object of the file.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub name: String,
    /// In the file's axes, metres.
    pub vertices: Vec<[f64; 3]>,
    /// One per vertex; v = 0 is the top row.
    pub uvs: Vec<Option<[f32; 2]>>,
    pub triangles: Vec<[u32; 3]>,
    /// One per triangle.
    pub triangle_materials: Vec<usize>,
}

/// What faces are said to be made of.
#[derive(Debug)]
pub(super) struct Material {
    pub name: String,
    pub texture: Option<Texture>,
}

/// An image laid on faces.
#[derive(Debug)]
pub(super) struct Texture {
    /// Index into the model's images, or why the texture cannot be used.
    pub image: Result<usize, String>,
    pub wrap_u: Wrap,
    pub wrap_v: Wrap,
}

/// Where the bytes of an image are.
#[derive(Debug)]
pub(super) struct Image {
    /// File name, or a name made up for an embedded image.
    pub name: String,
    /// The file content when it is embedded; else it is the file `name` beside the model.
    pub bytes: Option<Vec<u8>>,
}

/// Fails when `count` vertices or triangles are too many.
pub(super) fn check_count(what: &'static str, count: usize) -> Result<(), ImportError> {
    if count > MAX_ELEMENTS { Err(ImportError::TooMany { what, limit: MAX_ELEMENTS }) } else { Ok(()) }
}

/// A warning when `values`, which the file keeps as 32-bit floats, are too far from zero for that.
pub(super) fn coarse_coordinates(values: impl Iterator<Item = f64>) -> Option<String> {
    // From here on a step is 7.8 mm or more.
    const COARSE_M: f64 = 65_536.0;
    let largest = values.map(f64::abs).fold(0.0, f64::max);
    (COARSE_M..f64::INFINITY).contains(&largest).then(|| {
        let step_mm = 1000.0 * (largest.log2().floor() - 23.0).exp2();
        format!(
            "coordinates reach {largest:.0} m, where the file keeps only steps of {step_mm:.1} mm; \
             write the model around a local zero and give --origin"
        )
    })
}
