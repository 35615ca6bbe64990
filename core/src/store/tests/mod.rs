//! Tests of the store through its public door, and the maps they start from.

mod caught;
mod commit;
mod exchange;
mod fixture;
mod forget;
mod fsck;
mod history;
mod index;
mod observed;
mod open;
mod repair;
mod review;
mod seal;
mod undo;

use super::conformance::{Subject, at, banner, chair, content, moves, new_map, play, transaction};
use super::{CommitError, History, MapFile, NewMap};
use crate::version::{FeatureState, Fid, VersionId};
use resurvey_schema::{ClassId, ClassTable, Descriptor, DynamicDescriptor, GridPoint};
use tempfile::TempDir;

/// A map in a directory of its own.
struct Scratch {
    directory: TempDir,
    map: MapFile,
}

impl Scratch {
    fn new() -> Self {
        let directory = TempDir::new().unwrap();
        let map = MapFile::create(&directory.path().join("map.rsv"), &new_map(), at(0)).unwrap();
        Self { directory, map }
    }

    /// Version 1: a banner (feature 1) and a chair (feature 2), 100 m apart.
    fn with_two_features() -> Self {
        let scratch = Self::new();
        assert_eq!(scratch.add(0, &[banner(0.0), chair(100.0)]), Ok(VersionId(1)));
        scratch
    }

    fn add(&self, base: u64, states: &[FeatureState]) -> Result<VersionId, CommitError> {
        let mut transaction = transaction(base);
        transaction.additions = states.to_vec();
        self.map.commit(&transaction, at(base as i64 + 1))
    }

    fn live(&self, fid: u64) -> FeatureState {
        let snapshot = self.map.snapshot(self.map.head().unwrap()).unwrap();
        snapshot.feature(Fid(fid)).unwrap().state
    }
}

/// Damage is found by `fsck` here.
impl Subject for Scratch {
    fn history(&self) -> &dyn History {
        &self.map
    }

    fn inspect(&self) -> Result<(), String> {
        let problems = self.map.fsck().map_err(|error| error.to_string())?;
        if problems.is_empty() { Ok(()) } else { Err(format!("{problems:?}")) }
    }
}

mod map_file {
    crate::conformance_tests!(|new: &super::NewMap, now| {
        let directory = super::TempDir::new().unwrap();
        let map = super::MapFile::create(&directory.path().join("map.rsv"), new, now).unwrap();
        Box::new(super::Scratch { directory, map })
    });
}

mod memory {
    crate::conformance_tests!(|new: &super::NewMap, now| Box::new(crate::store::MemoryMap::new(new, now).unwrap()));
}
