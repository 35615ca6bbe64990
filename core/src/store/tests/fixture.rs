//! The stored maps of every format must open for ever.

use super::fsck::eventful;
use super::*;
use crate::store::{ProposalStatus, StoreError};
use crate::version::{BoxMm, Decision, Delta, Digest, UpdateTransaction, VersionKind};
use std::path::PathBuf;

/// The format that maps have after something is written to them.
const NEWEST: i32 = 4;

pub(super) fn fixture(format: u32) -> PathBuf {
    PathBuf::from(format!("{}/../tests/fixtures/map-format-{format}.rsv", env!("CARGO_MANIFEST_DIR")))
}

/// A copy of the stored map of this format.
fn copy(format: u32) -> (TempDir, PathBuf) {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("map.rsv");
    std::fs::copy(fixture(format), &path).unwrap();
    (directory, path)
}

/// Never for a released format: `cargo test -p resurvey-core --lib -- --ignored make_the_map_of_format_4`. Versions 0, 1
/// and 5, which have a tag, and 8, the newest, are kept.
#[test]
#[ignore = "writes tests/fixtures/map-format-4.rsv"]
fn make_the_map_of_format_4() {
    let Scratch { directory, map } = eventful();
    let commit = |update: &UpdateTransaction, minute| map.commit(update, at(minute)).unwrap();
    let mut looking = transaction(4);
    looking.viewed_region = Some(BoxMm::of_plan(835_550.0, 817_800.0, 835_590.0, 817_840.0).unwrap());
    looking.additions = vec![chair(31.0)];
    (looking.idempotency_key, looking.request) = (Some(KEY.to_owned()), Some(Digest::of(b"photo 12")));
    commit(&looking, 7);
    map.tag("second", VersionId(5), at(8)).unwrap();
    let mut attempt = history::observation(Decision::Unreliable);
    attempt.labels = Some(b"blurred".to_vec());
    map.record_observation(VersionId(5), &attempt, at(8)).unwrap();
    for (offset, minute) in [(40.0, 9), (41.0, 10)] {
        let mut proposal = transaction(5);
        proposal.additions = vec![chair(offset)];
        proposal.evidence = Some(history::observation(Decision::Proposed));
        map.propose(&proposal, at(minute)).unwrap();
    }
    map.accept(2, "ada", "seen on site", at(11)).unwrap();
    map.reject(3, "ada", "a shadow", at(12)).unwrap();
    for version in 6..8 {
        let mut update = transaction(version);
        let [before, after] = [version, version + 1].map(|version| banner(0.5 * (version as f64 - 5.0)));
        update.deltas = vec![Delta::modify(Fid(1), before, after)];
        commit(&update, version as i64 + 7);
    }
    map.gc(Some(VersionId(8)), at(20)).unwrap();
    map.compact().unwrap();
    let path = map.path().to_owned();
    drop(map);
    std::fs::copy(path, fixture(4)).unwrap();
    drop(directory);
}

/// The key of version 5.
const KEY: &str = "phone 7, photo 12";

#[test]
fn the_map_of_format_4_opens_with_seals_states_and_all_that_was_decided() {
    let (_directory, path) = copy(4);
    let map = MapFile::open(&path).unwrap();
    assert_eq!((map.fsck(), map.info().unwrap().format), (Ok(Vec::new()), 4));
    let kept = [0, 1, 5, 8];
    for version in 0..=8 {
        assert_eq!(map.snapshot(VersionId(version)).is_ok(), kept.contains(&version), "version {version}");
    }
    let snapshot = map.snapshot(VersionId(8)).unwrap();
    assert_eq!(snapshot.feature(Fid(1)).unwrap().state, banner(1.5));
    assert_eq!((snapshot.features(None).unwrap().len(), snapshot.classes().name(ClassId(8))), (5, "ground"));
    let tags = [("second", 5), ("surveyed", 1)].map(|(name, version)| (name.to_owned(), VersionId(version)));
    assert_eq!(map.tags(), Ok(tags.to_vec()));
    let statuses: Vec<_> = map.proposals().unwrap().into_iter().map(|proposal| proposal.status).collect();
    assert_eq!(statuses, [ProposalStatus::Rejected, ProposalStatus::Accepted(VersionId(6)), ProposalStatus::Open]);
    let decisions: Vec<_> = map.observations().unwrap().iter().map(|seen| seen.observation.decision).collect();
    assert!(decisions.contains(&Decision::Unreliable) && decisions.contains(&Decision::Committed), "{decisions:?}");
    assert_eq!(map.label_image(Digest::of(b"blurred")), Ok(Some(b"blurred".to_vec())));
    let asked = (VersionKind::Update, Some(Digest::of(b"photo 12")));
    assert_eq!(map.repeated(Some(KEY), asked), Ok(Some(VersionId(5))));
    let other = map.repeated(Some(KEY), (VersionKind::Update, Some(Digest::of(b"photo 13"))));
    assert!(matches!(other, Err(CommitError::OtherRequest { .. })), "{other:?}");
    let mut stale = transaction(4);
    stale.additions = vec![chair(10.0)];
    let CommitError::Conflict { looked_at, .. } = map.commit(&stale, at(30)).unwrap_err() else { panic!() };
    assert_eq!(looked_at, [VersionId(5)]);
    stale.base = VersionId(8);
    assert_eq!((map.commit(&stale, at(30)), map.fsck()), (Ok(VersionId(9)), Ok(Vec::new())));
}

#[test]
fn the_states_of_the_stored_map_have_the_digests_that_another_program_computes() {
    let (_directory, path) = copy(4);
    let map = MapFile::open_read_only(&path).unwrap();
    let sql = "SELECT version, state FROM forgotten WHERE has_state = 1 ORDER BY version";
    let states = map.read(|connection| {
        let mut statement = connection.prepare(sql)?;
        let states = statement.query_map([], |row| Ok((row.get::<_, u64>(0)?, Digest(row.get(1)?).to_string())))?;
        Ok(states.collect::<Result<Vec<_>, _>>()?)
    });
    // python3 docs/verify_chain.py tests/fixtures/map-format-4.rsv
    assert_eq!(states, Ok(STATES.map(|(version, digest)| (version, digest.to_owned())).to_vec()));
}

const STATES: [(u64, &str); 2] = [
    (5, "7e4c8165d3c301a5ed2579d516b75e2ae48d7459f1e443290dbcff17a398dcc9"),
    (8, "6ac38d7b444499104ec3ee171e5318707e967af16697746812f361ace042ebb3"),
];

/// Versions after the sixth of the map of format 3, each of which moves twelve banners.
const TURNS: u64 = 6;

#[test]
fn the_map_of_format_3_opens_with_the_blocks_of_its_index() {
    let (_directory, path) = copy(3);
    let map = MapFile::open(&path).unwrap();
    assert_eq!((map.fsck(), map.info().unwrap().format), (Ok(Vec::new()), 3));
    let blocks = "SELECT max(count) FROM (SELECT count(*) AS count FROM feature_index GROUP BY cell) ORDER BY 1";
    let most: i64 = map.read(|connection| Ok(connection.query_row(blocks, [], |row| row.get(0))?)).unwrap();
    assert!(most > 1, "no cell has a second block");
    for version in 0..=5 + TURNS {
        let snapshot = map.snapshot(VersionId(version)).unwrap();
        let everywhere = BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap();
        assert_eq!(snapshot.features(Some(&everywhere)), snapshot.features(None));
    }
}

#[test]
fn the_map_of_format_2_opens_with_what_it_forgot_and_what_it_looked_at() {
    let (_directory, path) = copy(2);
    let map = MapFile::open(&path).unwrap();
    assert_eq!((map.fsck(), map.info().unwrap().format), (Ok(Vec::new()), 2));
    let gone = StoreError::Forgotten { version: VersionId(3), next: VersionId(4) };
    assert_eq!(map.snapshot(VersionId(3)).err(), Some(gone));
    let chair_then = map.snapshot(VersionId(1)).unwrap().feature(Fid(2)).unwrap().state;
    assert_eq!(chair_then, chair(100.0));
    let snapshot = map.snapshot(VersionId(5)).unwrap();
    assert_eq!(snapshot.feature(Fid(1)).unwrap().state, banner(0.5));
    assert_eq!(snapshot.features_observed(at(6), None).unwrap().len(), 4);
    let mut stale = transaction(4);
    stale.additions = vec![chair(31.0)];
    let CommitError::Conflict { looked_at, .. } = map.commit(&stale, at(9)).unwrap_err() else { panic!() };
    assert_eq!((looked_at, map.info().unwrap().format), (vec![VersionId(5)], 2));
    stale.base = VersionId(5);
    assert_eq!(map.commit(&stale, at(9)), Ok(VersionId(6)));
    assert_eq!((map.fsck(), map.info().unwrap().format), (Ok(Vec::new()), NEWEST));
    assert_eq!(map.snapshot(VersionId(6)).unwrap().features_observed(at(6), None).unwrap().len(), 4);
}

#[test]
fn a_map_of_format_1_is_read_as_it_is_and_migrated_when_something_is_written() {
    let (_directory, path) = copy(1);
    let before = std::fs::read(&path).unwrap();
    let reader = MapFile::open_read_only(&path).unwrap();
    assert_eq!((reader.info().unwrap().format, reader.fsck()), (1, Ok(Vec::new())));
    let snapshot = reader.snapshot(VersionId(2)).unwrap();
    assert_eq!(snapshot.features(None).unwrap().len(), 4);
    let everywhere = BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap();
    assert_eq!(snapshot.features(Some(&everywhere)), snapshot.features(None));
    assert_eq!(reader.gc_plan(Some(VersionId(4))).unwrap().versions, [VersionId(2), VersionId(3)]);
    drop(reader);
    assert_eq!(std::fs::read(&path).unwrap(), before);
    let map = MapFile::open(&path).unwrap();
    let snapshot = map.snapshot(VersionId(2)).unwrap();
    assert_eq!(snapshot.features(Some(&everywhere)), snapshot.features(None));
    let taken = map.tag("surveyed", VersionId(2), at(9)).unwrap_err();
    assert!(matches!(taken, StoreError::TagTaken { .. }), "{taken}");
    assert_eq!(map.made_with("a key"), Ok(None));
    assert_eq!((map.info().unwrap().format, std::fs::read(&path).unwrap() == before), (1, true));
    map.gc(Some(VersionId(4)), at(9)).unwrap();
    assert_eq!((map.info().unwrap().format, map.fsck()), (NEWEST, Ok(Vec::new())));
    let snapshot = map.snapshot(VersionId(4)).unwrap();
    assert_eq!(snapshot.features(Some(&everywhere)), snapshot.features(None));
}

#[test]
fn a_reader_of_an_older_map_sees_what_others_commit_and_that_they_migrate_it() {
    let (_directory, path) = copy(1);
    let reader = MapFile::open_read_only(&path).unwrap();
    let everywhere = BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap();
    let agree = |version| {
        let snapshot = reader.snapshot(VersionId(version)).unwrap();
        let there = snapshot.features(Some(&everywhere)).unwrap();
        assert_eq!(there, snapshot.features(None).unwrap());
        there.len()
    };
    assert_eq!(agree(4), 3);
    // A program of that time adds a banner and takes the chair that came with version 2.
    let old = rusqlite::Connection::open(&path).unwrap();
    old.execute_batch(
        "INSERT INTO version SELECT 5, 'apply', committed_at, NULL, '', '', 4, NULL, 1, 0, 1, NULL, NULL, NULL, NULL, NULL,
            NULL, NULL, NULL, hash FROM version WHERE version = 4;
        INSERT INTO feature_version (fid, from_version, kind, class, geometry, state)
            SELECT 77, 5, kind, class, geometry, state FROM feature_version WHERE fid = 1 AND to_version IS NULL;
        UPDATE feature_version SET to_version = 5 WHERE fid = 3 AND to_version IS NULL",
    )
    .unwrap();
    assert_eq!((agree(5), agree(4)), (3, 3));
    let [writer, late] = [(); 2].map(|()| MapFile::open(&path).unwrap());
    assert_eq!(late.snapshot(VersionId(5)).unwrap().features(Some(&everywhere)).unwrap().len(), 3);
    let mut update = transaction(5);
    update.additions = vec![chair(9.0)];
    assert_eq!(writer.commit(&update, at(9)), Ok(VersionId(6)));
    assert_eq!((reader.info().unwrap().format, agree(6), agree(5)), (NEWEST, 4, 3));
    // Who opened it before finds it migrated.
    update.base = VersionId(6);
    assert_eq!(late.commit(&update, at(9)), Ok(VersionId(7)));
    assert_eq!((agree(7), late.snapshot(VersionId(7)).unwrap().features(Some(&everywhere)).unwrap().len()), (5, 5));
}

#[test]
fn the_map_of_format_1_opens_and_takes_another_version() {
    let (_directory, path) = copy(1);
    let map = MapFile::open(&path).unwrap();
    assert_eq!(map.fsck(), Ok(Vec::new()));
    let snapshot = map.snapshot(VersionId(4)).unwrap();
    let states: Vec<_> =
        snapshot.features(None).unwrap().into_iter().map(|feature| (feature.fid.0, feature.state)).collect();
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
    let (_directory, path) = copy(1);
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
