//! What an export is made of: plain values of one version and region.

use crate::crs::CrsError;
use crate::image::ImageError;
use crate::mesh::Object;
use resurvey_schema::{ClassTable, Descriptor};
use std::collections::BTreeMap;

/// Objects and descriptors of one version and region, with what is needed to read their numbers.
#[derive(Clone, Debug)]
pub struct ExportScene<'a> {
    /// Version of the map.
    pub version: u64,
    /// Projected system of the coordinates, `EPSG:2326`.
    pub crs: &'a str,
    /// What heights are above, `hkpd`.
    pub vertical_datum: &'a str,
    /// The map's classes.
    pub classes: &'a ClassTable,
    /// Feature ids and objects, in the order of the export.
    pub objects: Vec<(u64, &'a Object)>,
    /// Feature ids and descriptors, in the order of the export.
    pub descriptors: Vec<(u64, &'a Descriptor)>,
    /// Features that are drawn in the material of what became of them instead of their classes'.
    pub marks: BTreeMap<u64, Mark>,
}

/// What became of a feature between two versions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// It came.
    Added,
    /// It went.
    Removed,
    /// It is another.
    Changed,
}

impl Mark {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Added, Self::Removed, Self::Changed];

    /// Name of its material.
    pub fn name(self) -> &'static str {
        match self {
            Self::Added => "added",
            Self::Removed => "removed",
            Self::Changed => "changed",
        }
    }

    /// Colour of its material, sRGB: green, red and yellow of Okabe & Ito's palette, which colour-blind people tell apart.
    pub fn colour(self) -> [u8; 3] {
        match self {
            Self::Added => [0, 158, 115],
            Self::Removed => [213, 94, 0],
            Self::Changed => [240, 228, 66],
        }
    }
}

/// Why a scene cannot be exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// A position is not finite or an object is too large for `f32`.
    #[error("feature {fid}: {source}")]
    Position {
        /// Feature id.
        fid: u64,
        /// Which position, and how far.
        source: CrsError,
    },
    /// A mesh contradicts itself.
    #[error("object {name:?} (feature {fid}): expected {expected}, found {found}")]
    Mesh {
        /// Feature id.
        fid: u64,
        /// Name of the object.
        name: String,
        /// What a mesh must have.
        expected: String,
        /// What this one has.
        found: String,
    },
    /// A surface or descriptor has a class that the table lacks.
    #[error("feature {fid}: class {class} is not in the class table")]
    UnknownClass {
        /// Feature id.
        fid: u64,
        /// Class index.
        class: u8,
    },
    /// A label texture cannot be written as PNG.
    #[error("label texture {name:?}: {source}")]
    Texture {
        /// Name of the texture.
        name: String,
        /// What is wrong with it.
        source: ImageError,
    },
    /// More than the format holds.
    #[error("expected at most {limit} {unit} in one file, found {found}: export a smaller region")]
    TooLarge {
        /// What was counted.
        unit: &'static str,
        /// Number found.
        found: u64,
        /// Largest number.
        limit: u64,
    },
    /// JSON could not be written.
    #[error("glTF JSON could not be written: {0}")]
    Json(#[from] serde_json::Error),
    /// The binary container could not be written.
    #[error("GLB could not be written: {0}")]
    Container(String),
}
