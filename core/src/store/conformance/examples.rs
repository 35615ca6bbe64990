//! Laws that one example shows.

use super::laws::wish;
use super::{Make, add, at, banner, chair, new_map, sound, state, transaction, with_two_features};
use crate::store::{CommitError, ConflictingChange, Made, Revert, StoreError};
use crate::version::{BoxMm, Delta, Digest, FeatureState, Fid, UpdateTransaction, VersionId, VersionKind};

/// A metre around what stands `offset` m north of the place of the test's features.
fn around(offset: f64) -> BoxMm {
    let n = 817_816.210_8 + offset;
    BoxMm::of_plan(835_560.0, n - 1.0, 835_575.0, n + 1.0).expect("ends in order")
}

fn moving(base: u64, fid: u64, before: FeatureState, after: FeatureState) -> UpdateTransaction {
    let mut update = transaction(base);
    update.deltas = vec![Delta::modify(Fid(fid), before, after)];
    update
}

/// The same feature, or a place that the other looked at: the second is refused with what changed and by which version.
pub fn of_two_writers_at_one_place_the_second_is_refused(make: Make<'_>) {
    let subject = with_two_features(make);
    let history = subject.history();
    assert_eq!(history.commit(&moving(1, 1, banner(0.0), banner(0.5)), at(2)), Ok(VersionId(2)));
    let found = Some(banner(0.5));
    let changed = vec![ConflictingChange { fid: Fid(1), changed_in: Some(VersionId(2)), found, is_target: true }];
    let (base, head) = (VersionId(1), VersionId(2));
    assert_eq!(
        history.commit(&moving(1, 1, banner(0.0), banner(0.7)), at(3)),
        Err(CommitError::Conflict { base, head, changed, looked_at: vec![] })
    );
    // A look at the banner, from before it was moved.
    let mut looked = moving(1, 2, chair(100.0), chair(101.0));
    looked.viewed_region = Some(around(0.0));
    let Err(CommitError::Conflict { changed, .. }) = history.commit(&looked, at(3)) else { panic!("no conflict") };
    assert_eq!(changed.iter().map(|one| (one.fid, one.is_target)).collect::<Vec<_>>(), [(Fid(1), false)]);
    // The other way round: version 3 looked at a place where a writer who did not know of it puts a chair.
    looked.base = VersionId(2);
    assert_eq!(history.commit(&looked, at(3)), Ok(VersionId(3)));
    let mut blind = transaction(2);
    blind.additions = vec![chair(0.5)];
    let Err(CommitError::Conflict { looked_at, .. }) = history.commit(&blind, at(4)) else { panic!("no conflict") };
    assert_eq!((looked_at, history.head()), (vec![VersionId(3)], Ok(VersionId(3))));
    sound(subject.as_ref());
}

/// From the same base, each with its own look.
pub fn writers_at_different_places_both_pass(make: Make<'_>) {
    let subject = with_two_features(make);
    let history = subject.history();
    let mut first = moving(1, 1, banner(0.0), banner(0.5));
    first.viewed_region = Some(around(5.0));
    let mut second = moving(1, 2, chair(100.0), chair(101.0));
    second.viewed_region = Some(around(100.0));
    assert_eq!(history.commit(&first, at(2)), Ok(VersionId(2)));
    assert_eq!(history.commit(&second, at(3)), Ok(VersionId(3)));
    assert_eq!((state(history, 1), state(history, 2)), (banner(0.5), chair(101.0)));
    sound(subject.as_ref());
}

/// The same idempotency key gives the same version, also after others.
pub fn a_retry_is_committed_once(make: Make<'_>) {
    let subject = with_two_features(make);
    let history = subject.history();
    let mut update = transaction(1);
    update.additions = vec![chair(3.0)];
    update.idempotency_key = Some("phone 7, photo 12".to_owned());
    assert_eq!(history.made_with("phone 7, photo 12"), Ok(None));
    assert_eq!(history.commit(&update, at(2)), Ok(VersionId(2)));
    assert_eq!(add(history, &[chair(50.0)]), Ok(VersionId(3)));
    assert_eq!(history.commit(&update, at(4)), Ok(VersionId(2)));
    assert_eq!(history.made_with("phone 7, photo 12"), Ok(Some(VersionId(2))));
    assert_eq!(history.head(), Ok(VersionId(3)));
    sound(subject.as_ref());
}

/// What was asked for under a key is the only thing that gets its version; anything else is told both.
pub fn a_key_goes_with_one_request(make: Make<'_>) {
    let subject = with_two_features(make);
    let history = subject.history();
    let asking = |offset: f64, request: Option<Digest>| {
        let mut update = transaction(1);
        update.additions = vec![chair(offset)];
        (update.idempotency_key, update.request) = (Some("photo 12".to_owned()), request);
        update
    };
    let (first, other) = (Digest::of(b"first"), Digest::of(b"other"));
    let version = VersionId(2);
    let made = |repeated| Ok(Made { version, repeated });
    assert_eq!(history.commit_once(&asking(3.0, Some(first)), at(2)), made(false));
    assert_eq!(history.commit_once(&asking(3.0, Some(first)), at(3)), made(true));
    // Who does not say what is asked for is believed.
    assert_eq!(history.commit_once(&asking(3.0, None), at(3)), made(true));
    let made = (VersionKind::Update, Some(first));
    let refused = |kind, request| {
        let asked = (kind, request);
        Err(CommitError::OtherRequest { key: "photo 12".to_owned(), version, made, asked })
    };
    assert_eq!(history.commit_once(&asking(4.0, Some(other)), at(3)), refused(VersionKind::Update, Some(other)));
    let undo = Revert { idempotency_key: Some("photo 12".to_owned()), ..wish(1, None) };
    assert_eq!(history.revert_once(&undo, at(3)), refused(VersionKind::Revert, None));
    assert_eq!((history.head(), history.request_of(version)), (Ok(version), Ok(Some(first))));
    sound(subject.as_ref());
}

/// Of two photos that come in the wrong order each speaks of the time when it was taken.
pub fn a_late_photo_speaks_of_its_own_time(make: Make<'_>) {
    let subject = make(&new_map(), at(0));
    let history = subject.history();
    let steps = [(None, Some(0.0), 10), (Some(0.0), Some(3.0), 30), (Some(3.0), Some(2.0), 20), (Some(2.0), None, 40)];
    for (base, (before, after, seen)) in steps.into_iter().enumerate() {
        let mut update = transaction(base as u64);
        update.deltas = Delta::from_sides(Fid(1), before.map(chair), after.map(chair)).into_iter().collect();
        update.observed_at = Some(at(seen));
        assert_eq!(history.commit(&update, at(100)), Ok(VersionId(base as u64 + 1)));
    }
    let seen = |version, minute| {
        let features = history.features_observed(VersionId(version), at(minute), None).expect("features");
        features.into_iter().map(|feature| feature.state).collect::<Vec<_>>()
    };
    for (minute, expected) in [(9, vec![]), (10, vec![0.0]), (25, vec![2.0]), (30, vec![3.0]), (40, vec![])] {
        assert_eq!(seen(4, minute), expected.into_iter().map(chair).collect::<Vec<_>>(), "at minute {minute}");
    }
    // Version 2 did not know of the late photo yet.
    assert_eq!(seen(2, 25), [chair(0.0)]);
    sound(subject.as_ref());
}

/// A feature that went keeps its number, and comes back under it.
pub fn a_number_is_never_given_twice(make: Make<'_>) {
    let subject = with_two_features(make);
    let history = subject.history();
    let removal = Delta::remove(Fid(2), chair(100.0));
    let mut update = transaction(1);
    update.deltas = vec![removal.clone()];
    assert_eq!(history.commit(&update, at(2)), Ok(VersionId(2)));
    assert_eq!(add(history, &[chair(5.0)]), Ok(VersionId(3)));
    assert_eq!(state(history, 3), chair(5.0));
    update = transaction(3);
    update.deltas = vec![removal.undone()];
    assert_eq!(history.commit(&update, at(4)), Ok(VersionId(4)));
    assert_eq!(state(history, 2), chair(100.0));
    sound(subject.as_ref());
}

/// A change set brings numbers of its own: none that was another thing's, and none that would use up all numbers.
pub fn a_number_stays_with_its_thing_and_near_the_others(make: Make<'_>) {
    let subject = with_two_features(make);
    let history = subject.history();
    let mut update = transaction(1);
    update.deltas = vec![Delta::remove(Fid(2), chair(100.0))];
    assert_eq!(history.commit(&update, at(2)), Ok(VersionId(2)));
    let under = |base, fid, state: FeatureState| UpdateTransaction {
        deltas: vec![Delta::add(Fid(fid), state)],
        ..transaction(base)
    };
    let (was, found) = ("a dynamic descriptor of class 5".to_owned(), "a material descriptor of class 3".to_owned());
    let refused = CommitError::FidOfAnother { fid: Fid(2), was, found };
    assert_eq!(history.commit(&under(2, 2, banner(50.0)), at(3)), Err(refused));
    assert_eq!(history.commit(&under(2, 2, chair(70.0)), at(3)), Ok(VersionId(3)));
    let ahead = CommitError::FidAhead { fid: Fid::MAX, last: Fid(2) };
    assert_eq!(history.commit(&under(3, Fid::MAX.0, chair(0.0)), at(4)), Err(ahead));
    assert_eq!(history.commit(&under(3, 1_000_000, chair(0.0)), at(4)), Ok(VersionId(4)));
    assert_eq!(add(history, &[chair(5.0)]), Ok(VersionId(5)));
    assert_eq!(state(history, 1_000_001), chair(5.0));
    sound(subject.as_ref());
}

/// Objects name their geometry; a map that has it needs it no second time, and takes none under a wrong name.
pub fn geometry_is_kept_once_under_its_digest(make: Make<'_>) {
    let subject = make(&new_map(), at(0));
    let history = subject.history();
    let bounds = BoxMm::from_mm([0; 3], [1000; 3]).expect("ends in order");
    let tower = |geometry| FeatureState::Object { name: "tower".to_owned(), geometry, bounds };
    let digest = Digest::of(b"a mesh");
    let missing = CommitError::NoGeometry { name: "tower".to_owned(), digest };
    assert_eq!(add(history, &[tower(digest)]), Err(missing));
    let mut import = transaction(0);
    let named = import.add_geometry(b"a mesh".to_vec());
    import.additions = vec![tower(named)];
    assert_eq!(history.commit(&import, at(1)), Ok(VersionId(1)));
    assert_eq!(add(history, &[tower(digest)]), Ok(VersionId(2)));
    assert_eq!(history.geometry(digest), Ok(b"a mesh".to_vec()));
    import = transaction(2);
    import.geometries.insert(digest, b"another mesh".to_vec());
    import.additions = vec![tower(digest)];
    let found = Digest::of(b"another mesh");
    assert_eq!(history.commit(&import, at(3)), Err(CommitError::WrongDigest { given: digest, found }));
    assert_eq!(history.geometry(found), Err(StoreError::NoSuchGeometry { digest: found }));
    sound(subject.as_ref());
}

/// Numbers, `head`, tags and dates.
pub fn a_version_has_names(make: Make<'_>) {
    let subject = with_two_features(make); // versions 0 and 1 at minutes 0 and 1 of 2026-03-01, UTC
    let history = subject.history();
    assert_eq!(add(history, &[chair(1.0)]), Ok(VersionId(2)));
    assert_eq!(history.tag("surveyed", VersionId(1), at(9)), Ok(()));
    let taken = StoreError::TagTaken { name: "surveyed".to_owned(), version: VersionId(1) };
    assert_eq!(history.tag("surveyed", VersionId(2), at(9)), Err(taken));
    assert_eq!(history.tag("head", VersionId(2), at(9)), Err(StoreError::TagName { name: "head".to_owned() }));
    let names =
        [("1", 1), ("v1", 1), ("head", 2), ("surveyed", 1), ("@2026-03-01", 2), ("@2026-03-01T08:01:30+08:00", 1)];
    for (name, version) in names {
        assert_eq!(history.resolve(name), Ok(VersionId(version)), "{name}");
    }
    assert_eq!(history.resolve_range("surveyed..head"), Ok((VersionId(1), VersionId(2))));
    assert_eq!(history.tags(), Ok(vec![("surveyed".to_owned(), VersionId(1))]));
    assert_eq!(history.untag("surveyed"), Ok(VersionId(1)));
    assert_eq!(history.resolve("surveyed"), Err(StoreError::NoSuchTag { name: "surveyed".to_owned() }));
    sound(subject.as_ref());
}

/// Versions, features, times and names that no map has.
pub fn what_is_not_there_is_refused_by_name(make: Make<'_>) {
    let subject = with_two_features(make);
    let history = subject.history();
    let (ahead, head) = (VersionId(7), VersionId(1));
    let no_version = StoreError::NoSuchVersion { version: ahead, head };
    assert_eq!(history.version(ahead).err(), Some(no_version.clone()));
    assert_eq!(history.features(ahead, None).err(), Some(no_version.clone()));
    assert_eq!(history.changes(head, ahead, None).err(), Some(no_version.clone()));
    assert_eq!(history.tag("later", ahead, at(3)).err(), Some(no_version));
    let absent = StoreError::NoSuchFeature { fid: Fid(1), version: VersionId(0) };
    assert_eq!(history.feature(VersionId(0), Fid(1)).err(), Some(absent));
    assert_eq!(history.lives(Fid(9)).err(), Some(StoreError::NeverAFeature { fid: Fid(9) }));
    assert_eq!(history.version_at(at(-1)).err(), Some(StoreError::BeforeFirst { asked: at(-1), first: at(0) }));
    assert_eq!(history.untag("never").err(), Some(StoreError::NoSuchTag { name: "never".to_owned() }));
    sound(subject.as_ref());
}
