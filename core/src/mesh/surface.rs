//! The geometry of the map: objects, meshes, and what gives a surface its class.

use crate::image::LabelImage;
use resurvey_schema::{ClassId, GridPoint};

/// A named thing of the imported model.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Name in the source file; not unique.
    pub name: String,
    /// Its geometry.
    pub mesh: Mesh,
}

/// Triangles around an origin. Surfaces are two-sided: winding in real models is not to be trusted.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Where the offsets start.
    pub origin: GridPoint,
    /// Offsets from `origin`: E, N, H, metres; each at most 2048 m, finite.
    pub vertices: Vec<[f32; 3]>,
    /// Texture coordinates, one per vertex; empty when no surface has a label texture.
    pub uvs: Vec<[f32; 2]>,
    /// Vertex indices, checked against `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `surfaces`, one per triangle.
    pub triangle_surfaces: Vec<u16>,
    /// What the faces are made of.
    pub surfaces: Vec<Surface>,
}

/// What gives a face its class.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// One class all over.
    Class(ClassId),
    /// A class per texel.
    Texture(LabelTexture),
}

/// Classes over a texture: nearest texel, never blended. v = 0 is the **top** row here whatever the source format says
/// (3DS and OBJ are flipped on import).
#[derive(Clone, Debug, PartialEq)]
pub struct LabelTexture {
    /// File name in the source, for the export.
    pub name: String,
    /// Class per texel, top row first.
    pub labels: LabelImage,
    /// Outside 0…1 along u.
    pub wrap_u: Wrap,
    /// Outside 0…1 along v.
    pub wrap_v: Wrap,
}

/// What a texture shows outside 0…1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The fraction of the coordinate.
    Repeat,
    /// The nearest edge texel.
    Clamp,
    /// Every other repetition reversed.
    Mirror,
}
