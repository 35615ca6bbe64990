//! Why a capture could not be worked on.

use crate::mesh::EncodingError;
use crate::plugin::PluginError;
use crate::store::StoreError;
use crate::version::InvalidBox;

/// Why a capture could not be worked on. What the photo shows is never an error: a change that cannot be made is a
/// rejection.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UpdateError {
    /// The map.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A plugin.
    #[error(transparent)]
    Plugin(#[from] PluginError),
    /// A place beyond any map.
    #[error(transparent)]
    Box(#[from] InvalidBox),
    /// Geometry in the map that cannot be read.
    #[error("geometry of object {fid}: {source}")]
    Geometry {
        /// The object.
        fid: u64,
        /// Why.
        source: EncodingError,
    },
    /// Nothing in the map near the prior.
    #[error(
        "the map has nothing within {reach_m} m of the prior at {easting_m:.1}, {northing_m:.1}; \
         check the prior's position and the map's origin"
    )]
    NothingThere {
        /// How far was looked, metres.
        reach_m: f64,
        /// Of the prior.
        easting_m: f64,
        /// Of the prior.
        northing_m: f64,
    },
}
