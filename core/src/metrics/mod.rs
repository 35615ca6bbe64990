//! How alike two label images are: per-class overlap and boundary counts, and the scores made of them
//! (Lee & Hsu, §3.4, Eq. 5).

mod bits;
mod boundary;
mod overlap;
mod score;

pub use boundary::BoundaryPhoto;
pub use overlap::{class_count, overlap_counts};
pub use score::{boundary_f1, dice, jaccard};
