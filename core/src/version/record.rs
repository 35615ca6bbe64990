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

/// What a version did to a feature, as far as the map knows.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// The version.
    pub version: VersionId,
    /// The feature before it.
    pub before: Side,
    /// The feature after it.
    pub after: Side,
}

/// One side of a step.
#[derive(Clone, Debug, PartialEq)]
pub enum Side {
    /// Not in the map.
    Absent,
    /// In the map.
    State(FeatureState),
    /// Nobody knows any more: the version is forgotten, and with it a state if there was one.
    Forgotten,
}

impl Step {
    /// What it counts; `None` where a side is forgotten.
    pub fn counts(&self) -> Option<Counts> {
        let mut counts = Counts::default();
        counts.count(self.before.is_there()?, self.after.is_there()?);
        Some(counts)
    }

    /// `add`, `modify` or `remove`; `None` where a side is forgotten.
    pub fn name(&self) -> Option<&'static str> {
        Some(match (self.before.is_there()?, self.after.is_there()?) {
            (false, _) => "add",
            (true, true) => "modify",
            (true, false) => "remove",
        })
    }
}

impl Side {
    /// The state, where there was one and it is known.
    pub fn state(&self) -> Option<&FeatureState> {
        match self {
            Self::State(state) => Some(state),
            Self::Absent | Self::Forgotten => None,
        }
    }

    fn is_there(&self) -> Option<bool> {
        match self {
            Self::Absent => Some(false),
            Self::State(_) => Some(true),
            Self::Forgotten => None,
        }
    }
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
    /// How many features it changed; in the log of a region or feature, of just that, and `None` where that is forgotten.
    pub counts: Option<Counts>,
    /// Box around everything it changed.
    pub envelope: Option<BoxMm>,
    /// Key under which the writer may retry.
    pub idempotency_key: Option<String>,
    /// Digest of its evidence.
    pub evidence: Option<Digest>,
    /// Hash over the version before, the operations and the evidence.
    pub hash: Digest,
}
