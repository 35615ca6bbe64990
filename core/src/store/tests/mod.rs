//! Tests of the store through its public door, and the maps they start from.

mod commit;
mod exchange;
mod fixture;
mod forget;
mod fsck;
mod history;
mod measure;
mod observed;
mod open;
mod repair;
mod review;
mod undo;

use super::{CommitError, History, MapFile, NewMap};
use crate::version::{FeatureState, Fid, Frame, UpdateTransaction, VersionId, VersionKind};
use jiff::Timestamp;
use resurvey_schema::{ClassId, ClassTable, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Uncertainty};
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

fn new_map() -> NewMap {
    NewMap {
        map_id: "test".to_owned(),
        frame: Frame { crs: "EPSG:2326".to_owned(), vertical_datum: "hkpd".to_owned() },
        classes: ClassTable::default(),
        author: "survey".to_owned(),
        message: "an empty map".to_owned(),
    }
}

/// `minutes` after 2026-03-01T00:00:00Z.
fn at(minutes: i64) -> Timestamp {
    Timestamp::from_second(1_772_323_200 + 60 * minutes).unwrap()
}

fn transaction(base: u64) -> UpdateTransaction {
    UpdateTransaction::new(VersionId(base), VersionKind::Update, "phone 7", "a test")
}

/// A banner of 9.6 × 6.9 m, `offset` m north of the one of the case street-banner-removed.
fn banner(offset: f64) -> FeatureState {
    let corner = |n: f64, h| GridPoint::new(835_567.743_1, n + offset, h);
    FeatureState::Descriptor(Descriptor::Material(MaterialDescriptor {
        class: ClassId(3),
        corners: [
            corner(817_816.210_8, 8.129_6),
            corner(817_825.842, 8.129_6),
            corner(817_825.842, 15.014_8),
            corner(817_816.210_8, 15.014_8),
        ],
        normal: [1.0, 0.0, 0.0],
        sigma: Some(Uncertainty { position_m: 0.1, size_m: Some(0.05), area_m2: None }),
    }))
}

/// A chair, `offset` m north of the banner's bottom-left corner.
fn chair(offset: f64) -> FeatureState {
    FeatureState::Descriptor(Descriptor::Dynamic(DynamicDescriptor {
        class: ClassId(5),
        position: GridPoint::new(835_567.743_1, 817_816.210_8 + offset, 7.2),
        size_m: [0.5, 0.5, 0.9],
        yaw_rad: None,
        sigma: None,
    }))
}
