//! Camera models (pinhole, brown, fisheye) and poses as transforms.
//!
//! Camera axes are x right, y down, z forward; the centre of pixel (i, j) is (i + 0.5, j + 0.5).

mod brown;
mod fisheye;
mod model;
pub mod pose;

#[cfg(test)]
mod tests;

pub use model::{Camera, CameraError, MAX_PIXELS, MAX_SIDE_PX, Pinhole};
pub use pose::{camera_from_world, world_from_camera};
