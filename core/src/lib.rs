//! The versioned 3D map, rendering, positioning, change and export of resurvey: plugins compute, core decides, only a
//! transaction writes.
#![deny(unsafe_code)]

pub mod camera;
pub mod capture;
pub mod crs;
pub mod evaluate;
pub mod export;
pub mod image;
pub mod localize;
pub mod mesh;
pub mod metrics;
pub mod plugin;
pub mod render;
pub mod store;
pub mod update;
pub mod version;
