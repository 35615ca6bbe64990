//! How alike two label images are: per-class overlap and boundary counts, of which a matcher makes its score
//! (Lee & Hsu, §3.4, Eq. 5).

mod bits;
mod compared;
mod overlap;

pub use compared::{ComparedPhoto, ViewPlanes};
pub use overlap::{class_count, overlap_counts};
