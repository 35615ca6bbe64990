//! render.

pub mod panorama;
