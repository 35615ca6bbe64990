//! Where the phone stood: the host-driven search, the reliability gate and the heat map.

pub mod compare;
pub mod sweep;
