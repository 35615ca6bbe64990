//! glTF 2.0: one node per object and descriptor under a root that turns the map's axes to glTF's; class and feature id
//! as `EXT_mesh_features` and `EXT_structural_metadata`. `docs/export-gltf.md` says what is where.

mod asset;
mod document;
mod feature;
mod frame;
mod material;
mod shape;

pub use document::{GltfFiles, glb, gltf};

#[cfg(test)]
mod tests;
