//! Optimistic commits.

use super::*;
use crate::store::{ConflictingChange, StoreError};
use crate::version::{BoxMm, Delta};

fn modify(scratch: &Scratch, base: u64, fid: u64, after: FeatureState) -> Result<VersionId, CommitError> {
    let mut transaction = transaction(base);
    let before = scratch.map.snapshot(VersionId(base)).unwrap().feature(Fid(fid)).unwrap().state;
    transaction.deltas = vec![Delta::modify(Fid(fid), before, after)];
    scratch.map.commit(&transaction, at(9))
}

#[test]
fn a_stale_base_version_is_refused() {
    let scratch = Scratch::with_two_features();
    assert_eq!(modify(&scratch, 1, 1, banner(0.5)), Ok(VersionId(2)));
    let changed = vec![ConflictingChange {
        fid: Fid(1),
        changed_in: Some(VersionId(2)),
        found: Some(banner(0.5)),
        is_target: true,
    }];
    let error = modify(&scratch, 1, 1, banner(0.7)).unwrap_err();
    assert_eq!(error, CommitError::Conflict { base: VersionId(1), head: VersionId(2), changed, looked_at: vec![] });
    assert!(error.to_string().contains("feature 1 (version 2)"), "{error}");
    assert_eq!((scratch.map.head(), scratch.live(1)), (Ok(VersionId(2)), banner(0.5)));
}

#[test]
fn what_came_into_the_viewed_region_meanwhile_is_a_conflict() {
    let scratch = Scratch::with_two_features();
    scratch.add(1, &[chair(3.0)]).unwrap();
    let mut update = transaction(1);
    update.additions = vec![chair(3.0)];
    update.viewed_region = Some(BoxMm::of_plan(835_560.0, 817_816.0, 835_570.0, 817_830.0).unwrap());
    let CommitError::Conflict { changed, .. } = scratch.map.commit(&update, at(9)).unwrap_err() else { panic!() };
    let [ConflictingChange { fid: Fid(3), changed_in: Some(VersionId(2)), is_target: false, .. }] = changed[..] else {
        panic!("{changed:?}")
    };
    // The same look at the far chair, where nothing happened.
    update.viewed_region = Some(BoxMm::of_plan(835_560.0, 817_900.0, 835_570.0, 817_930.0).unwrap());
    assert_eq!(scratch.map.commit(&update, at(9)), Ok(VersionId(3)));
}

#[test]
fn what_left_the_viewed_region_meanwhile_is_a_conflict() {
    let scratch = Scratch::with_two_features();
    let mut removal = transaction(1);
    removal.deltas = vec![Delta::remove(Fid(1), banner(0.0))];
    assert_eq!(scratch.map.commit(&removal, at(2)), Ok(VersionId(2)));
    let mut update = transaction(1);
    update.additions = vec![chair(3.0)];
    update.viewed_region = Some(BoxMm::of_plan(835_560.0, 817_816.0, 835_570.0, 817_830.0).unwrap());
    let CommitError::Conflict { changed, .. } = scratch.map.commit(&update, at(9)).unwrap_err() else { panic!() };
    assert_eq!((changed[0].fid, changed[0].changed_in, &changed[0].found), (Fid(1), Some(VersionId(2)), &None));
}

#[test]
fn a_number_that_is_not_finite_is_refused() {
    let scratch = Scratch::new();
    for value in [f64::NAN, f64::INFINITY, 1e300] {
        let error = scratch.add(0, &[chair(value)]).unwrap_err();
        assert!(error.to_string().starts_with("addition 0: northing"), "{error}");
    }
    assert_eq!(scratch.map.head(), Ok(VersionId(0)));
}

#[test]
fn a_feature_beyond_the_reach_of_the_index_is_refused() {
    let scratch = Scratch::with_two_features();
    let error = scratch.add(1, &[chair(3e6)]).unwrap_err();
    assert_eq!(error, CommitError::OutsideIndex { feature: "feature 3".to_owned() });
    assert_eq!(scratch.map.head(), Ok(VersionId(1)));
}

#[test]
fn a_transaction_that_could_mean_two_things_is_refused() {
    let scratch = Scratch::with_two_features();
    let commit = |deltas: Vec<Delta>| {
        let mut update = transaction(1);
        update.deltas = deltas;
        scratch.map.commit(&update, at(2)).unwrap_err()
    };
    assert_eq!(commit(vec![]), CommitError::Empty);
    let twice = vec![Delta::remove(Fid(1), banner(0.0)), Delta::modify(Fid(1), banner(0.0), banner(1.0))];
    assert_eq!(commit(twice), CommitError::Twice { fid: Fid(1) });
    assert_eq!(commit(vec![Delta::modify(Fid(1), banner(0.0), banner(0.0))]), CommitError::NoChange { fid: Fid(1) });
    assert_eq!(commit(vec![Delta::add(Fid(0), chair(1.0))]), CommitError::FidRange { fid: Fid(0) });
    let mut update = transaction(5);
    update.additions = vec![chair(1.0)];
    let missing = StoreError::NoSuchVersion { version: VersionId(5), head: VersionId(1) };
    assert_eq!(scratch.map.commit(&update, at(2)), Err(CommitError::Store(missing)));
}

#[test]
fn a_class_may_be_added_but_not_lost() {
    let scratch = Scratch::with_two_features();
    let mut classes: Vec<_> = ClassTable::default().iter().cloned().collect();
    let mut plant = classes[5].clone();
    (plant.index, plant.name, plant.colour) = (ClassId(9), "plant".to_owned(), [1, 2, 3]);
    classes.push(plant);
    let mut update = transaction(1);
    update.classes = Some(ClassTable::new(classes.clone()).unwrap());
    assert_eq!(scratch.map.commit(&update, at(2)), Ok(VersionId(2)));
    let names = |version| {
        let snapshot = scratch.map.snapshot(VersionId(version)).unwrap();
        snapshot.classes().by_name("plant").map(|class| class.index)
    };
    assert_eq!((names(1), names(2)), (None, Some(ClassId(9))));
    classes.remove(3);
    update.classes = Some(ClassTable::new(classes).unwrap());
    assert_eq!(scratch.map.commit(&update, at(3)), Err(CommitError::ClassLost { class: "banner".to_owned() }));
}

#[test]
fn time_never_goes_back_although_the_clock_does() {
    let scratch = Scratch::with_two_features();
    let mut update = transaction(1);
    update.additions = vec![chair(1.0)];
    scratch.map.commit(&update, at(-1000)).unwrap();
    // Version 1 was made at minute 1, so version 2 is not earlier.
    assert_eq!(scratch.map.version(VersionId(2)).unwrap().committed_at, at(1));
    assert_eq!(scratch.map.resolve("@2026-03-01T00:01:00Z"), Ok(VersionId(2)));
}

#[test]
fn a_snapshot_stays_as_it_is_while_others_commit() {
    let scratch = Scratch::with_two_features();
    let other = MapFile::open(scratch.map.path()).unwrap();
    let [early, reader] = [scratch.map.snapshot(VersionId(0)).unwrap(), other.snapshot(VersionId(1)).unwrap()];
    let everywhere = BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap();
    modify(&scratch, 1, 1, banner(0.5)).unwrap();
    assert!(early.features(Some(&everywhere)).unwrap().is_empty());
    let states: Vec<_> = reader.features(Some(&everywhere)).unwrap().into_iter().map(|feature| feature.state).collect();
    assert_eq!(states, [banner(0.0), chair(100.0)]);
    assert_eq!(other.snapshot(VersionId(2)).unwrap().feature(Fid(1)).unwrap().state, banner(0.5));
}

#[test]
fn of_eight_writers_at_once_none_is_lost() {
    let scratch = Scratch::new();
    let path = scratch.map.path();
    let write = |writer: u64| {
        let map = MapFile::open(path).unwrap();
        map.set_busy_timeout(std::time::Duration::from_secs(60)).unwrap();
        for place in 0..5 {
            let mut update = transaction(map.head().unwrap().0);
            update.additions = vec![chair((writer * 5 + place) as f64)];
            map.commit(&update, at(1)).unwrap();
        }
    };
    std::thread::scope(|scope| (0..8).for_each(|writer| drop(scope.spawn(move || write(writer)))));
    assert_eq!(scratch.map.head(), Ok(VersionId(40)));
    let features = scratch.map.snapshot(VersionId(40)).unwrap().features(None).unwrap();
    let mut offsets: Vec<_> = features.into_iter().map(|feature| feature.state.bounds().unwrap().min()[1]).collect();
    offsets.sort_unstable();
    offsets.dedup();
    assert_eq!(offsets.len(), 40);
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn two_that_change_the_same_feature_at_once_cannot_both_win() {
    let scratch = Scratch::with_two_features();
    let path = scratch.map.path();
    let write = |offset: f64| {
        let map = MapFile::open(path).unwrap();
        let mut update = transaction(1);
        update.deltas = vec![Delta::modify(Fid(2), chair(100.0), chair(offset))];
        map.commit(&update, at(2))
    };
    let results = std::thread::scope(|scope| {
        let writers: Vec<_> = (0..4).map(|writer| scope.spawn(move || write(f64::from(writer)))).collect();
        writers.into_iter().map(|writer| writer.join().unwrap()).collect::<Vec<_>>()
    });
    assert_eq!(results.iter().filter(|result| **result == Ok(VersionId(2))).count(), 1);
    assert_eq!(results.iter().filter(|result| matches!(result, Err(CommitError::Conflict { .. }))).count(), 3);
}
