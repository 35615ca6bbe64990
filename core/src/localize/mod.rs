//! Where the phone stood: the services that matchers use, the host-driven search, the reliability gate and the heat map.

mod compare;
mod exhaustive;
mod gate;
mod heatmap;
mod locate;
mod search;
mod services;
mod sweep;
mod world;

pub use compare::{Comparer, ViewPhoto};
pub use exhaustive::{Exhaustive, ExhaustiveRequest, Score, exhaustive};
pub use gate::{GATE_KEYS, GateLimits};
pub use heatmap::{HeatMap, HeatMapError, heat_map};
pub use locate::{Located, localize};
pub use search::SearchLimits;
pub use services::{Listener, SceneServices, Silent};
pub use world::World;
