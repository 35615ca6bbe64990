//! One capture becomes one update transaction: localize, detect, estimate, resolve, commit (Lee & Hsu, §3.9).

mod compare;
mod error;
mod overlap;
mod resolve;
mod surroundings;
mod transaction;

pub use compare::{Comparison, pose_estimate};
pub use error::UpdateError;
pub use resolve::{Change, Resolution, resolve};
pub use surroundings::{REACH_M, world_around};
pub use transaction::add_changes;
