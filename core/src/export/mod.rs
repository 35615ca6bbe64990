//! The map in other formats.

mod gltf;
mod scene;

pub use gltf::{GltfFiles, glb, gltf};
pub use scene::{ExportError, ExportScene, Mark};
