//! The map as seen from a pose: a scene of triangles in local coordinates, a rasteriser for images and rays for single
//! queries.

mod band;
mod clip;
mod code;
mod edges;
mod hierarchy;
pub mod lidar;
mod occlusion;
mod painter;
pub mod panorama;
mod plate;
mod projection;
mod raster;
mod rays;
mod scene;
mod setup;
mod shade;
mod shown;
mod solid;
mod texels;
mod texture;
mod view;

#[cfg(test)]
mod tests;

pub use hierarchy::{Bounds, Hierarchy};
pub use raster::Renderer;
pub use rays::{Hit, Nearest, RayCaster};
pub use scene::{Cluster, Scene, SceneObject};
pub use solid::{SolidMask, horizontal_cut, inside_solid};
pub use texture::texel_class;
pub use view::{View, view};
