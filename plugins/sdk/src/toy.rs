//! A toy host for plugin authors' tests: a world of painted rectangles, boxes and a flat ground, ray cast exactly, one
//! ray per pixel in `f64`, for a pinhole camera. Slow and simple on purpose: it is the oracle, not the renderer.

mod camera;
mod compare;
mod host;
pub mod noise;
mod scene;
pub mod trial;

pub use camera::ToyCamera;
pub use host::{ToyCapture, ToyHost};
pub use scene::{Paint, Rectangle, ToyScene};
pub use trial::create;

#[cfg(test)]
mod tests;
