//! Where the phone stood: the services that matchers use, the host-driven search, the reliability gate and the heat map.

mod arguments;
mod candidates;
mod compare;
mod exhaustive;
mod fused;
mod gate;
mod heatmap;
mod locate;
mod mixture;
mod panel;
mod search;
mod services;
mod stride;
mod sweep;
mod world;

pub use crate::plugin::Listener;
pub use compare::{Comparer, ViewPhoto};
pub use exhaustive::{Exhaustive, ExhaustiveRequest, Score, exhaustive};
pub use fused::{FUSED, Fused, FusedError, Matching, Member, named_members};
pub use gate::{GATE_KEYS, GateLimits};
pub use heatmap::{HeatMap, HeatMapError, heat_map};
pub use locate::{Located, inside_building, localize};
pub use search::SearchLimits;
pub use services::{SceneServices, Silent};
pub use world::World;
