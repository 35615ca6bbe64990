//! The second time axis: when the world was so.

use super::*;
use crate::store::StoreError;
use crate::version::{Delta, Feature};

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
        request: None,
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
