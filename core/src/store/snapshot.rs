//! The map at one version, for reading.

use super::error::StoreError;
use super::interface::History;
use crate::version::{BoxMm, Digest, Feature, Fid, VersionId};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use std::fmt;

/// The map as it was at one version, whatever is committed meanwhile. It cannot write.
#[derive(Clone)]
pub struct Snapshot<'h> {
    history: &'h dyn History,
    version: VersionId,
    classes: ClassTable,
}

impl<'h> Snapshot<'h> {
    /// The map at `version`.
    pub fn of(history: &'h dyn History, version: VersionId) -> Result<Self, StoreError> {
        Ok(Self { history, version, classes: history.classes(version)? })
    }

    /// The version.
    pub fn version(&self) -> VersionId {
        self.version
    }

    /// The map's classes at this version.
    pub fn classes(&self) -> &ClassTable {
        &self.classes
    }

    /// Every feature, by rising number; with a region those whose box shares a point with it.
    pub fn features(&self, region: Option<&BoxMm>) -> Result<Vec<Feature>, StoreError> {
        self.history.features(self.version, region)
    }

    /// What this version knows to have been there at `time`; with a region what shares a point with it.
    pub fn features_observed(&self, time: Timestamp, region: Option<&BoxMm>) -> Result<Vec<Feature>, StoreError> {
        self.history.features_observed(self.version, time, region)
    }

    /// The feature `fid`.
    pub fn feature(&self, fid: Fid) -> Result<Feature, StoreError> {
        self.history.feature(self.version, fid)
    }

    /// The bytes of the geometry that `digest` names.
    pub fn geometry(&self, digest: Digest) -> Result<Vec<u8>, StoreError> {
        self.history.geometry(digest)
    }

    /// The smallest box around all features; `None` for an empty map.
    pub fn bounds(&self) -> Result<Option<BoxMm>, StoreError> {
        self.history.bounds(self.version)
    }
}

impl fmt::Debug for Snapshot<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Snapshot").field("version", &self.version).finish_non_exhaustive()
    }
}
