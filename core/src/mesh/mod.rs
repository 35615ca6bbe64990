//! Triangle meshes with a class per face or a label texture per texel, and their import from 3DS and glTF.

mod surface;

pub use surface::{LabelTexture, Mesh, Object, Surface, Wrap};
