//! The update transaction: the only thing that changes a map.

use super::{BoxMm, Delta, Digest, FeatureState, Observation};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// Number of a version: 0 is the empty map, each commit adds one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct VersionId(pub u64);

/// Number of a feature, from 1; never used again for another feature.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Fid(pub u64);

impl Fid {
    /// The largest: every JSON reader keeps integers up to 2⁵³ − 1 exact.
    pub const MAX: Self = Self((1 << 53) - 1);
}

impl fmt::Display for VersionId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

impl fmt::Display for Fid {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

/// What made a version.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum VersionKind {
    /// The creation of the map; only version 0.
    Init,
    /// Objects from a model.
    Import,
    /// A capture.
    Update,
    /// The undoing of another version.
    Revert,
    /// A change set.
    Apply,
    /// Another map.
    Merge,
}

impl VersionKind {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Init, Self::Import, Self::Update, Self::Revert, Self::Apply, Self::Merge];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Init => "init",
            Self::Import => "import",
            Self::Update => "update",
            Self::Revert => "revert",
            Self::Apply => "apply",
            Self::Merge => "merge",
        }
    }
}

/// Everything one version changes, with where it comes from. `MapFile::commit` takes all of it or nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct UpdateTransaction {
    /// The version the changes were worked out against.
    pub base: VersionId,
    /// What makes the version; not [`VersionKind::Init`].
    pub kind: VersionKind,
    /// Who.
    pub author: String,
    /// Why.
    pub message: String,
    /// When the world was so; `None` when nobody said.
    pub observed_at: Option<Timestamp>,
    /// The version this one undoes.
    pub reverts: Option<VersionId>,
    /// The same key a second time gives the version of the first time and changes nothing (a phone may retry).
    pub idempotency_key: Option<String>,
    /// Digest of what was asked for: the same key with another one is refused.
    pub request: Option<Digest>,
    /// New features, to which the map gives the next free numbers in this order.
    pub additions: Vec<FeatureState>,
    /// Changes of numbered features, at most one each.
    pub deltas: Vec<Delta>,
    /// Geometry that the new objects need and the map may not have yet, under the digest of its bytes.
    pub geometries: BTreeMap<Digest, Vec<u8>>,
    /// A new class table; it keeps every class of the old one, perhaps renamed or in another colour.
    pub classes: Option<ClassTable>,
    /// Nothing in here may have changed since `base`.
    pub viewed_region: Option<BoxMm>,
    /// What was seen.
    pub evidence: Option<Observation>,
}

impl UpdateTransaction {
    /// A transaction that changes nothing yet.
    pub fn new(base: VersionId, kind: VersionKind, author: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            base,
            kind,
            author: author.into(),
            message: message.into(),
            observed_at: None,
            reverts: None,
            idempotency_key: None,
            request: None,
            additions: Vec::new(),
            deltas: Vec::new(),
            geometries: BTreeMap::new(),
            classes: None,
            viewed_region: None,
            evidence: None,
        }
    }

    /// Adds geometry and returns the digest that names it.
    pub fn add_geometry(&mut self, bytes: Vec<u8>) -> Digest {
        let digest = Digest::of(&bytes);
        self.geometries.insert(digest, bytes);
        digest
    }

    /// Whether it changes nothing.
    pub fn is_empty(&self) -> bool {
        self.additions.is_empty() && self.deltas.is_empty() && self.classes.is_none()
    }
}
