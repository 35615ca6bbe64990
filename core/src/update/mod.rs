//! One capture becomes one update transaction: localize, detect, estimate, commit.

mod overlap;
mod resolve;

pub use resolve::{Change, Resolution, resolve};
