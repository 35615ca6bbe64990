//! What the map answers about its history.

use super::{BoxMm, Counts, Digest, FeatureState, Fid, VersionId, VersionKind};
use jiff::Timestamp;

/// A feature over one life span.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Its number.
    pub fid: Fid,
    /// First version with this state.
    pub from: VersionId,
    /// First version without it; `None` while nothing replaced it.
    pub to: Option<VersionId>,
    /// The state.
    pub state: FeatureState,
}

/// One version as history has it.
#[derive(Clone, Debug, PartialEq)]
pub struct VersionRecord {
    /// Its number.
    pub version: VersionId,
    /// What made it.
    pub kind: VersionKind,
    /// When it came into the map; never earlier than the version before.
    pub committed_at: Timestamp,
    /// When the world was so, where known.
    pub observed_at: Option<Timestamp>,
    /// Who.
    pub author: String,
    /// Why.
    pub message: String,
    /// The version its changes were worked out against; `None` for version 0.
    pub base: Option<VersionId>,
    /// The version it undoes.
    pub reverts: Option<VersionId>,
    /// How many features it changed; in the log of a region, of those in the region.
    pub counts: Counts,
    /// Box around everything it changed.
    pub envelope: Option<BoxMm>,
    /// Key under which the writer may retry.
    pub idempotency_key: Option<String>,
    /// Digest of its evidence.
    pub evidence: Option<Digest>,
    /// Hash over the version before, the operations and the evidence.
    pub hash: Digest,
}
