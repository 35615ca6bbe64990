//! The stored map of format 1 must open for ever.

use super::fsck::eventful;
use super::*;
use crate::version::Digest;
use std::path::PathBuf;

fn fixture() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/fixtures/map-format-1.rsv"))
}

/// Never for a released format: `cargo test -p resurvey-core --lib -- --ignored make_the_map_of_format_1`.
#[test]
#[ignore = "writes tests/fixtures/map-format-1.rsv"]
fn make_the_map_of_format_1() {
    let Scratch { directory, map } = eventful();
    let path = map.path().to_owned();
    drop(map);
    std::fs::copy(path, fixture()).unwrap();
    drop(directory);
}

#[test]
fn the_map_of_format_1_opens_and_takes_another_version() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("map.rsv");
    std::fs::copy(fixture(), &path).unwrap();
    let map = MapFile::open(&path).unwrap();
    assert_eq!(map.fsck(), Ok(Vec::new()));
    let snapshot = map.snapshot(VersionId(4)).unwrap();
    let states: Vec<_> =
        snapshot.features().unwrap().into_iter().map(|feature| (feature.fid.0, feature.state)).collect();
    assert_eq!(states[0], (1, banner(0.5)));
    let FeatureState::Object { name, geometry, .. } = &states[1].1 else { panic!() };
    assert_eq!((name.as_str(), snapshot.geometry(*geometry)), ("tower", Ok(b"a mesh".to_vec())));
    assert_eq!((states.len(), snapshot.classes().name(ClassId(8))), (3, "ground"));
    assert_eq!(map.snapshot(VersionId(1)).unwrap().feature(Fid(2)).unwrap().state, chair(100.0));
    let mut update = transaction(4);
    update.additions = vec![chair(9.0)];
    assert_eq!(map.commit(&update, at(9)), Ok(VersionId(5)));
    assert_eq!(map.fsck(), Ok(Vec::new()));
}

#[test]
fn the_hashes_of_the_stored_map_are_those_that_another_program_computes() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("map.rsv");
    std::fs::copy(fixture(), &path).unwrap();
    let map = MapFile::open_read_only(&path).unwrap();
    // python3 docs/verify_chain.py tests/fixtures/map-format-1.rsv
    for (version, hash) in HASHES.iter().enumerate() {
        assert_eq!(map.version(VersionId(version as u64)).unwrap().hash, hash.parse::<Digest>().unwrap());
    }
}

const HASHES: [&str; 5] = [
    "d062265623135a19299eea46576acea16d2913c5c1dcf825e3de8bfa100ee1b4",
    "7fb89ef352c7cb1e1ca5182174689ba3107d6157cf4b37606430c14a326386dc",
    "1be2960c33b6f296bbd28de62ba68ca82954311fac957d576a0aca5a23d53795",
    "51f011825f0d6a1ba0ecb65dfc1c48d74567e691b84f9ec7d153af70de754341",
    "0e2b047282a3c74637894b7059cbac62f80c12d5a87cf66634cd372a244e7034",
];
