//! One noise raised step by step, and what `resurvey eval` says at each.

pub mod charts;
pub mod level;
pub mod table;

pub use level::{Level, Noise, Sweep};
