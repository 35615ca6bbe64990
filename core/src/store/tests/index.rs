//! The index through the public door: places and sizes of any kind, gc, and maps that it has to be made for.

use super::fsck::damage;
use super::*;
use crate::version::{BoxMm, Delta};
use proptest::prelude::*;

fn object(name: usize, digest: crate::version::Digest, bounds: BoxMm) -> FeatureState {
    FeatureState::Object { name: name.to_string(), geometry: digest, bounds }
}

/// Boxes from a point to half the reach of the index, most of them near each other.
fn place() -> impl Strategy<Value = BoxMm> {
    let low = || prop_oneof![3 => -60_000..60_000_i64, 1 => -1_000_000_000..1_000_000_000_i64];
    let width = || prop_oneof![Just(0_i64), 1..20_000_i64, 1..500_000_i64, 1..1_000_000_000_i64];
    (low(), low(), -9000..9000_i64, width(), width(), 0..30_000_i64)
        .prop_map(|(e, n, h, east, north, up)| BoxMm::from_mm([e, n, h], [e + east, n + north, h + up]).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_region_finds_boxes_of_every_size(places in prop::collection::vec(place(), 1..40), region in place()) {
        let scratch = Scratch::new();
        let mut import = transaction(0);
        let digest = import.add_geometry(b"a mesh".to_vec());
        import.additions = places.iter().enumerate().map(|(name, bounds)| object(name, digest, *bounds)).collect();
        scratch.map.commit(&import, at(1)).unwrap();
        let snapshot = scratch.map.snapshot(VersionId(1)).unwrap();
        let found: Vec<Fid> = snapshot.features(Some(&region)).unwrap().iter().map(|feature| feature.fid).collect();
        let mut expected = snapshot.features(None).unwrap();
        prop_assert_eq!(snapshot.bounds(), Ok(places.iter().copied().reduce(|all, bounds| all.union(&bounds))));
        expected.retain(|feature| feature.state.bounds().unwrap().intersects(&region));
        prop_assert_eq!(found, expected.iter().map(|feature| feature.fid).collect::<Vec<_>>());
        prop_assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
    }
}

/// A map whose version 1 has 30 banners in one place and each of the 60 after it moves a third of them.
fn busy_corner() -> Scratch {
    let scratch = Scratch::new();
    let mut import = transaction(0);
    import.additions = (0..30).map(|number| banner(0.01 * f64::from(number))).collect();
    scratch.map.commit(&import, at(1)).unwrap();
    for version in 1..61 {
        let live = scratch.map.snapshot(VersionId(version)).unwrap().features(None).unwrap();
        let mut update = transaction(version);
        let moved = live.into_iter().filter(|feature| feature.fid.0 % 3 == version % 3);
        update.deltas =
            moved.map(|feature| Delta::modify(feature.fid, feature.state, banner(0.001 * version as f64))).collect();
        scratch.map.commit(&update, at(2)).unwrap();
    }
    scratch
}

fn blocks(scratch: &Scratch) -> i64 {
    let count = "SELECT count(*) FROM feature_index ORDER BY 1";
    scratch.map.read(|connection| Ok(connection.query_row(count, [], |row| row.get(0))?)).unwrap()
}

fn everywhere() -> BoxMm {
    BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap()
}

#[test]
fn a_busy_corner_is_the_same_from_the_index_and_from_the_rows_at_every_version() {
    let scratch = busy_corner();
    assert!(blocks(&scratch) > 5, "{} blocks", blocks(&scratch));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
    for version in (0..=61).map(VersionId) {
        let snapshot = scratch.map.snapshot(version).unwrap();
        assert_eq!(snapshot.features(Some(&everywhere())), snapshot.features(None));
        for from in [VersionId(0), VersionId(1), VersionId(30), VersionId(61)] {
            let [here, all] = [Some(&everywhere()), None].map(|region| scratch.map.changes(from, version, region));
            assert_eq!(here, all);
        }
    }
    let [here, all] = [Some(&everywhere()), None].map(|region| scratch.map.log(region).unwrap());
    // Version 0 changed nothing anywhere.
    assert_eq!(here, all[..61]);
}

#[test]
fn what_is_forgotten_leaves_the_index_too() {
    let scratch = busy_corner();
    let (before, head) = (blocks(&scratch), VersionId(61));
    let state = scratch.map.snapshot(head).unwrap().features(None).unwrap();
    scratch.map.gc(Some(head), at(9)).unwrap();
    assert!(blocks(&scratch) < before / 3, "{} of {before}", blocks(&scratch));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
    assert_eq!(scratch.map.snapshot(head).unwrap().features(Some(&everywhere())), Ok(state));
}

#[test]
fn an_index_that_names_a_row_too_many_is_not_believed() {
    let scratch = busy_corner();
    damage(&scratch, "DELETE FROM feature_version WHERE fid = 7 AND to_version IS NULL");
    let error = scratch.map.snapshot(VersionId(61)).unwrap().features(Some(&everywhere())).unwrap_err();
    assert!(error.to_string().contains("of the features, which is not there"), "{error}");
}

#[test]
fn a_cell_with_a_number_below_all_is_found_and_no_question_goes_round_for_ever() {
    let scratch = busy_corner();
    damage(&scratch, "UPDATE feature_index SET cell = -cell");
    let snapshot = scratch.map.snapshot(VersionId(61)).unwrap();
    assert!(snapshot.features(Some(&everywhere())).unwrap().is_empty());
    assert!(!scratch.map.fsck().unwrap().is_empty());
    scratch.map.repair().unwrap();
    assert_eq!(snapshot.features(Some(&everywhere())), snapshot.features(None));
}
