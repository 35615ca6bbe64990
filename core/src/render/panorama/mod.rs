//! Class panoramas: every column is an azimuth, every row a tangent of elevation, so that a heading is a column shift.
//!
//! A triangle seen from the eye is a cone between three planes through the eye. Along one column, each plane cuts at one
//! tangent, and the inverse of the horizontal distance is linear in the tangent: no projection, no clipping.
//!
//! A cell shows the triangle with the largest inverse distance in f32, among equals the one with the lowest index: order
//! and culling cannot change it. So what showed at the last position is drawn first, then whatever of the scene that
//! does not hide.

mod cone;
mod grid;
mod painter;
mod reach;

#[cfg(test)]
mod tests;

pub use grid::{PanoramaGrid, ROWS_PER_WORD};
pub use painter::Panorama;
