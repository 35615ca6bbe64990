//! The map file as a [`History`].

use super::commit::{commit, request_of, version_with};
use super::commit_error::CommitError;
use super::differences::{changes, changes_in};
use super::error::StoreError;
use super::forgotten::{check_state, is_kept};
use super::index;
use super::interface::{History, Made};
use super::logs::{all_records, record, records_in};
use super::map_file::MapFile;
use super::observed::features_observed;
use super::revisions::{tag, tags, untag, version_at};
use super::rows::{classes_at, head};
use super::states::{all_features, feature_at, geometry, lives};
use crate::version::{BoxMm, Delta, Digest, Feature, Fid, UpdateTransaction, VersionId, VersionRecord};
use jiff::Timestamp;
use resurvey_schema::ClassTable;

impl History for MapFile {
    fn head(&self) -> Result<VersionId, StoreError> {
        self.read(head).map(|record| record.version)
    }

    fn version(&self, version: VersionId) -> Result<VersionRecord, StoreError> {
        self.read(|connection| record(connection, version))
    }

    fn log(&self, region: Option<&BoxMm>) -> Result<Vec<VersionRecord>, StoreError> {
        self.read(|connection| match region {
            Some(region) => records_in(connection, region),
            None => all_records(connection),
        })
    }

    fn version_at(&self, time: Timestamp) -> Result<VersionId, StoreError> {
        self.read(|connection| version_at(connection, time))
    }

    fn made_with(&self, key: &str) -> Result<Option<VersionId>, StoreError> {
        self.read(|connection| version_with(connection, key))
    }

    fn request_of(&self, version: VersionId) -> Result<Option<Digest>, StoreError> {
        self.read(|connection| request_of(connection, version))
    }

    fn classes(&self, version: VersionId) -> Result<ClassTable, StoreError> {
        self.read(|connection| {
            check_state(connection, version)?;
            classes_at(connection, version)
        })
    }

    fn features(&self, version: VersionId, region: Option<&BoxMm>) -> Result<Vec<Feature>, StoreError> {
        self.read(|connection| {
            check_state(connection, version)?;
            match region {
                Some(region) => index::state(connection, version, region),
                None => all_features(connection, version),
            }
        })
    }

    fn features_observed(
        &self,
        version: VersionId,
        time: Timestamp,
        region: Option<&BoxMm>,
    ) -> Result<Vec<Feature>, StoreError> {
        self.read(|connection| features_observed(connection, version, time, region))
    }

    fn is_kept(&self, version: VersionId) -> Result<bool, StoreError> {
        self.read(|connection| is_kept(connection, version))
    }

    fn feature(&self, version: VersionId, fid: Fid) -> Result<Feature, StoreError> {
        let found = self.read(|connection| {
            check_state(connection, version)?;
            feature_at(connection, fid, version)
        })?;
        found.ok_or(StoreError::NoSuchFeature { fid, version })
    }

    fn lives(&self, fid: Fid) -> Result<Vec<Feature>, StoreError> {
        self.read(|connection| lives(connection, fid))
    }

    fn bounds(&self, version: VersionId) -> Result<Option<BoxMm>, StoreError> {
        self.read(|connection| {
            check_state(connection, version)?;
            index::bounds_of(connection, version)
        })
    }

    fn geometry(&self, digest: Digest) -> Result<Vec<u8>, StoreError> {
        self.read(|connection| geometry(connection, digest))
    }

    fn changes(&self, from: VersionId, to: VersionId, region: Option<&BoxMm>) -> Result<Vec<Delta>, StoreError> {
        self.read(|connection| match region {
            Some(region) => changes_in(connection, from, to, region),
            None => changes(connection, from, to),
        })
    }

    fn commit_once(&self, transaction: &UpdateTransaction, now: Timestamp) -> Result<Made, CommitError> {
        commit(self, transaction, now)
    }

    fn tag(&self, name: &str, version: VersionId, now: Timestamp) -> Result<(), StoreError> {
        self.write(|connection| tag(connection, name, version, now))
    }

    fn untag(&self, name: &str) -> Result<VersionId, StoreError> {
        self.write(|connection| untag(connection, name))
    }

    fn tags(&self) -> Result<Vec<(String, VersionId)>, StoreError> {
        self.read(tags)
    }
}
