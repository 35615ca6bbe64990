//! The second time axis: when the world was so.

use super::history::{content, play, steps};
use super::*;
use crate::store::StoreError;
use crate::version::{BoxMm, Delta, Feature};
use proptest::prelude::*;

fn states(features: Vec<Feature>) -> Vec<(u64, FeatureState)> {
    features.into_iter().map(|feature| (feature.fid.0, feature.state)).collect()
}

fn seen(scratch: &Scratch, version: u64, minute: i64) -> Vec<(u64, FeatureState)> {
    states(scratch.map.snapshot(VersionId(version)).unwrap().features_observed(at(minute), None).unwrap())
}

/// Commits a change of the chair, feature 1, that was seen at `minute`.
fn moved(scratch: &Scratch, base: u64, (before, after): (Option<f64>, Option<f64>), minute: i64) -> VersionId {
    let mut update = transaction(base);
    update.deltas = Delta::from_sides(Fid(1), before.map(chair), after.map(chair)).into_iter().collect();
    update.observed_at = Some(at(minute));
    scratch.map.commit(&update, at(100 + base as i64)).unwrap()
}

#[test]
fn a_photo_that_comes_late_speaks_of_the_time_when_it_was_taken() {
    let scratch = Scratch::new();
    moved(&scratch, 0, (None, Some(0.0)), 10);
    // Taken at minute 30, uploaded first; then one that was taken at minute 20.
    moved(&scratch, 1, (Some(0.0), Some(3.0)), 30);
    moved(&scratch, 2, (Some(3.0), Some(2.0)), 20);
    assert_eq!(seen(&scratch, 3, 9), []);
    assert_eq!(seen(&scratch, 3, 10), [(1, chair(0.0))]);
    assert_eq!(seen(&scratch, 3, 25), [(1, chair(2.0))]);
    assert_eq!(seen(&scratch, 3, 30), [(1, chair(3.0))]);
    // Version 2 did not know of the late photo yet.
    assert_eq!(seen(&scratch, 2, 25), [(1, chair(0.0))]);
}

#[test]
fn what_went_and_came_back_was_not_there_in_between() {
    let scratch = Scratch::new();
    moved(&scratch, 0, (None, Some(0.0)), 10);
    moved(&scratch, 1, (Some(0.0), None), 20);
    moved(&scratch, 2, (None, Some(5.0)), 30);
    let at_minutes = [15, 20, 29, 30].map(|minute| seen(&scratch, 3, minute));
    assert_eq!(at_minutes, [vec![(1, chair(0.0))], vec![], vec![], vec![(1, chair(5.0))]]);
}

#[test]
fn where_nobody_said_when_the_time_of_the_commit_counts() {
    let scratch = Scratch::with_two_features(); // committed at minute 1
    assert_eq!(seen(&scratch, 1, 0), []);
    assert_eq!(seen(&scratch, 1, 1).len(), 2);
}

#[test]
fn what_was_undone_never_was() {
    let scratch = Scratch::new();
    moved(&scratch, 0, (None, Some(0.0)), 10);
    moved(&scratch, 1, (Some(0.0), Some(4.0)), 20);
    let wish = crate::store::Revert {
        version: VersionId(2),
        region: None,
        author: String::new(),
        message: None,
        idempotency_key: None,
    };
    scratch.map.revert(&wish, at(200)).unwrap();
    assert_eq!(seen(&scratch, 2, 25), [(1, chair(4.0))]);
    assert_eq!(seen(&scratch, 3, 25), [(1, chair(0.0))]);
}

#[test]
fn a_time_that_only_forgotten_versions_knew_is_refused() {
    let scratch = Scratch::new();
    moved(&scratch, 0, (None, Some(0.0)), 10);
    moved(&scratch, 1, (Some(0.0), Some(1.0)), 20);
    moved(&scratch, 2, (Some(1.0), Some(2.0)), 30);
    scratch.map.gc(Some(VersionId(3)), at(300)).unwrap();
    let snapshot = scratch.map.snapshot(VersionId(3)).unwrap();
    let gone = StoreError::ForgottenTime { time: at(25), next: VersionId(3) };
    assert_eq!(snapshot.features_observed(at(25), None), Err(gone));
    assert_eq!(seen(&scratch, 3, 30), [(1, chair(2.0))]);
    assert_eq!(seen(&scratch, 3, 5), []);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn where_photos_come_in_order_both_axes_agree(history in steps()) {
        let scratch = Scratch::new();
        let contents = play(&scratch, &history);
        let head = contents.len() as u64 - 1;
        for (version, expected) in contents.iter().enumerate() {
            // Version v was committed at minute v, without a time of its own.
            let found = scratch.map.snapshot(VersionId(head)).unwrap().features_observed(at(version as i64), None).unwrap();
            let found: history::Content = found.into_iter().map(|one| (one.fid, one.state)).collect();
            prop_assert_eq!(&found, expected);
            prop_assert_eq!(&found, &content(&scratch, version));
        }
    }

    #[test]
    fn the_answer_for_a_region_is_the_whole_answer_filtered(
        moves in proptest::collection::vec((-20.0..20.0_f64, 0_i64..50), 1..8), minute in 0_i64..60, low in -25.0..20.0_f64,
    ) {
        let scratch = Scratch::new();
        let mut last = None;
        for (version, (offset, seen)) in moves.iter().enumerate() {
            moved(&scratch, version as u64, (last, Some(*offset)), *seen);
            last = Some(*offset);
        }
        let n0 = 817_816.210_8 + low;
        let region = BoxMm::of_plan(835_500.0, n0, 835_600.0, n0 + 10.0).unwrap();
        let snapshot = scratch.map.snapshot(VersionId(moves.len() as u64)).unwrap();
        let mut whole = snapshot.features_observed(at(minute), None).unwrap();
        whole.retain(|feature| feature.state.bounds().unwrap().intersects(&region));
        prop_assert_eq!(snapshot.features_observed(at(minute), Some(&region)).unwrap(), whole);
    }
}
