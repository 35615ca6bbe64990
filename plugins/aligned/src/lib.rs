//! Change detector that aligns every surface before it compares.
//!
//! Walls stand elsewhere than on the map, each by its own decimetres, and no pose makes up for that. `class-difference`
//! tolerates whatever lies within that reach of an edge, and so sees no change there. This detector cuts the view into
//! surfaces ([`surface`]), finds for each the move at which its contours agree with the photo's ([`fit`], on the samples
//! of [`template`]), renders the view anew with every surface moved ([`compose`]), and then makes the regions of
//! `class-difference` with a small tolerance. Where a surface does not fit, the whole tolerance stays.
#![forbid(unsafe_code)]

pub mod behind;
pub mod compose;
pub mod detector;
pub mod fit;
pub mod sample;
pub mod settings;
pub mod surface;
pub mod template;
pub mod thick;

pub use detector::Aligned;
pub use settings::Settings;

resurvey_plugin::export_detector!(Aligned);
