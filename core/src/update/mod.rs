//! One capture becomes one update transaction: localize, detect, estimate, resolve, commit (Lee & Hsu, §3.9).

mod compare;
mod confirm;
mod doubles;
mod error;
mod overlap;
mod resolve;
mod surroundings;
mod transaction;

pub use compare::{Comparison, pose_estimate};
pub use confirm::{Confirmation, Testimony, confirm, testimonies};
pub use doubles::refuse_doubles;
pub use error::UpdateError;
pub use resolve::{Change, Resolution, in_the_way, resolve};
pub use surroundings::{REACH_M, world_around};
pub use transaction::add_changes;
