//! The map as seen from a pose: a scene of triangles in local coordinates, a rasteriser for images and rays for single
//! queries.

mod frame;
pub mod panorama;
mod plate;
mod projection;
mod raster;
mod scene;
mod setup;
mod texture;
mod view;

pub use raster::Renderer;
pub use scene::{Cluster, Scene, SceneObject};
pub use texture::texel_class;
pub use view::{View, view};
