//! The versioned 3D map, rendering, positioning, change and export of resurvey: plugins compute, core decides, only a
//! transaction writes.
#![deny(unsafe_code)]

pub mod camera;
pub mod crs;
pub mod image;
pub mod mesh;
pub mod metrics;
pub mod render;
