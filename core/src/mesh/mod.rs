//! Triangle meshes with a class per face or a label texture per texel, and their import from 3DS and glTF.

mod assemble;
mod axes;
mod bounds;
mod chunks;
mod class_map;
mod classify;
mod encoding;
mod gltf_buffers;
mod gltf_scene;
mod gltf_schema;
mod import;
mod import_3ds;
mod import_error;
mod import_gltf;
mod model;
mod neighbours;
mod surface;

pub use axes::{GLTF_FROM_GRID, Up};
pub use class_map::{ClassMap, ClassMapError, class_named};
pub use encoding::{EncodingError, decode_mesh, encode_mesh};
pub use import::{ImportOptions, ImportReport, Imported, import_model};
pub use import_error::ImportError;
pub use surface::{LabelTexture, Mesh, Object, Surface, Wrap};

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "the numbers in the files built here are exact in binary")]
mod tests;
