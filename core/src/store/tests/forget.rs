//! Forgetting versions: what is kept stays what it was, and what is gone says so.

use super::fsck::eventful;
use super::*;
use crate::store::conformance::Content;
use crate::store::{Forgetting, StoreError};
use crate::version::{BoxMm, Counts, Delta, Digest, Observation, Side, Step, VersionRecord};
use proptest::prelude::*;
use rusqlite::Connection;

fn versions(numbers: &[u64]) -> Vec<VersionId> {
    numbers.iter().copied().map(VersionId).collect()
}

/// Versions 1 to 5: a chair that moves with each.
pub(super) fn moving() -> Scratch {
    let scratch = Scratch::new();
    scratch.add(0, &[chair(0.0)]).unwrap();
    for version in 1..5 {
        let mut update = transaction(version);
        let (before, after) = (chair(version as f64 - 1.0), chair(version as f64));
        update.deltas = vec![Delta::modify(Fid(1), before, after)];
        scratch.map.commit(&update, at(version as i64 + 1)).unwrap();
    }
    scratch
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn what_is_kept_is_what_it_was_then(history in moves(), limits in (any::<usize>(), any::<usize>()), tag in any::<usize>()) {
        let scratch = Scratch::new();
        let contents = play(&scratch.map, &history);
        let head = contents.len() - 1;
        let tagged = VersionId((tag % contents.len()) as u64);
        scratch.map.tag("kept", tagged, at(90)).unwrap();
        let hashes: Vec<VersionRecord> = scratch.map.log(None).unwrap();
        let mut limits = [limits.0 % contents.len(), limits.1 % contents.len()];
        limits.sort_unstable();
        for limit in limits {
            let before = VersionId(limit as u64);
            let plan = scratch.map.gc_plan(Some(before)).unwrap();
            prop_assert_eq!(scratch.map.gc(Some(before), at(91)), Ok(plan));
            prop_assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
        }
        prop_assert_eq!(scratch.map.log(None).unwrap(), hashes);
        let is_kept = |version: usize| version == 0 || version >= limits[1] || version as u64 == tagged.0;
        let mut kept: Vec<usize> = Vec::new();
        for (version, expected) in contents.iter().enumerate() {
            if is_kept(version) {
                prop_assert_eq!(&content(&scratch.map, version), expected);
                kept.push(version);
            } else {
                let next = (version..=head).find(|version| is_kept(*version)).unwrap();
                let gone = StoreError::Forgotten { version: VersionId(version as u64), next: VersionId(next as u64) };
                prop_assert_eq!(scratch.map.snapshot(VersionId(version as u64)).err(), Some(gone));
            }
        }
        for pair in kept.windows(2) {
            let deltas = scratch.map.changes(VersionId(pair[0] as u64), VersionId(pair[1] as u64), None).unwrap();
            let mut here: Content = contents[pair[0]].clone();
            for delta in deltas {
                prop_assert_eq!(here.get(&delta.fid()), delta.before());
                match delta.after() {
                    Some(after) => here.insert(delta.fid(), after.clone()),
                    None => here.remove(&delta.fid()),
                };
            }
            prop_assert_eq!(&here, &contents[pair[1]]);
        }
        // Nothing is left to forget, and the map goes on.
        prop_assert!(scratch.map.gc(Some(VersionId(limits[1] as u64)), at(92)).unwrap().is_empty());
        scratch.add(head as u64, &[chair(70.0)]).unwrap();
        scratch.map.compact().unwrap();
        prop_assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
    }
}

#[test]
fn only_what_was_asked_for_is_forgotten_and_said_before() {
    let scratch = moving();
    assert_eq!(
        scratch.map.gc(None, at(9)),
        Ok(Forgetting { kept: versions(&[0, 1, 2, 3, 4, 5]), ..Forgetting::default() })
    );
    scratch.map.tag("surveyed", VersionId(2), at(9)).unwrap();
    let plan = scratch.map.gc_plan(Some(VersionId(5))).unwrap();
    assert_eq!((&plan.versions, &plan.kept), (&versions(&[1, 3, 4]), &versions(&[0, 2, 5])));
    assert_eq!((plan.states, plan.geometries, plan.label_images), (3, 0, 0));
    assert_eq!(scratch.map.snapshot(VersionId(3)).map(|snapshot| snapshot.version()), Ok(VersionId(3)));
    assert_eq!(scratch.map.gc(Some(VersionId(5)), at(9)), Ok(plan));
    let states = |version| scratch.map.snapshot(VersionId(version)).unwrap().feature(Fid(1)).unwrap().state;
    assert_eq!((states(2), states(5)), (chair(1.0), chair(4.0)));
    assert_eq!(
        scratch.map.changes(VersionId(2), VersionId(5), None).unwrap(),
        [Delta::modify(Fid(1), chair(1.0), chair(4.0))]
    );
    let gone = StoreError::Forgotten { version: VersionId(4), next: VersionId(5) };
    assert_eq!(scratch.map.changes_of(VersionId(5)), Err(gone.clone()));
    assert_eq!(scratch.map.tag("lost", VersionId(4), at(9)), Err(gone));
    assert_eq!(scratch.map.version(VersionId(4)).unwrap().author, "phone 7");
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn what_depended_on_forgotten_versions_is_refused_not_guessed() {
    let scratch = moving();
    scratch.map.gc(Some(VersionId(5)), at(9)).unwrap();
    let wish = crate::store::Revert {
        version: VersionId(5),
        region: None,
        author: String::new(),
        message: None,
        idempotency_key: None,
        request: None,
    };
    let gone = StoreError::Forgotten { version: VersionId(4), next: VersionId(5) };
    assert_eq!(scratch.map.revert(&wish, at(9)), Err(CommitError::Store(gone.clone())));
    let mut stale = transaction(4);
    stale.additions = vec![chair(30.0)];
    stale.viewed_region = Some(BoxMm::of_plan(0.0, 0.0, 1.0, 1.0).unwrap());
    assert_eq!(scratch.map.commit(&stale, at(9)), Err(CommitError::Store(gone)));
    let missing = StoreError::NoSuchVersion { version: VersionId(9), head: VersionId(5) };
    assert_eq!(scratch.map.gc(Some(VersionId(9)), at(9)), Err(missing));
}

#[test]
fn geometry_and_images_go_with_the_last_version_that_needs_them() {
    let scratch = eventful();
    // Version 3 was made from a photo whose labels are kept; the banner that it moved lives on.
    let mut removal = transaction(4);
    let snapshot = scratch.map.snapshot(VersionId(4)).unwrap();
    removal.deltas =
        snapshot.features(None).unwrap().into_iter().map(|one| Delta::remove(one.fid, one.state)).collect();
    scratch.map.commit(&removal, at(6)).unwrap();
    scratch.map.untag("surveyed").unwrap();
    let unseen = scratch.map.gc_plan(Some(VersionId(4))).unwrap();
    assert_eq!((unseen.geometries, unseen.label_images), (0, 0), "{unseen:?}");
    let done = scratch.map.gc(Some(VersionId(5)), at(7)).unwrap();
    assert_eq!((done.states, done.geometries, done.label_images), (5, 1, 1), "{done:?}");
    assert_eq!(scratch.map.label_image(Digest::of(b"png")), Ok(None));
    assert!(scratch.map.observation_of(VersionId(3)).unwrap().is_some());
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn the_label_image_of_an_attempt_without_a_version_is_kept() {
    let scratch = moving();
    let mut attempt: Observation = history::observation(crate::version::Decision::Unreliable);
    attempt.labels = Some(b"attempt".to_vec());
    scratch.map.record_observation(VersionId(5), &attempt, at(8)).unwrap();
    scratch.map.gc(Some(VersionId(5)), at(9)).unwrap();
    assert_eq!(scratch.map.label_image(Digest::of(b"attempt")), Ok(Some(b"attempt".to_vec())));
}

#[test]
fn the_number_of_a_forgotten_feature_is_not_given_again() {
    let scratch = moving();
    scratch.add(5, &[chair(60.0)]).unwrap();
    let mut removal = transaction(6);
    removal.deltas = vec![Delta::remove(Fid(2), chair(60.0))];
    scratch.map.commit(&removal, at(8)).unwrap();
    scratch.map.gc(Some(VersionId(7)), at(9)).unwrap();
    assert_eq!(scratch.map.log_of(Fid(2)), Err(StoreError::NeverAFeature { fid: Fid(2) }));
    scratch.add(7, &[chair(70.0)]).unwrap();
    assert_eq!(scratch.live(3), chair(70.0));
}

#[test]
fn a_damaged_map_forgets_nothing() {
    let scratch = moving();
    fsck::damage(&scratch, "UPDATE version SET hash = zeroblob(32) WHERE version = 2");
    let error = scratch.map.gc(Some(VersionId(5)), at(9)).unwrap_err();
    assert!(
        matches!(error, StoreError::Damaged { .. }) && error.to_string().contains("nothing was forgotten"),
        "{error}"
    );
    assert!(scratch.map.snapshot(VersionId(3)).is_ok());
}

#[test]
fn a_life_span_that_is_still_asked_for_cannot_be_deleted() {
    let scratch = moving();
    scratch.map.tag("surveyed", VersionId(2), at(9)).unwrap();
    scratch.map.gc(Some(VersionId(5)), at(9)).unwrap();
    let raw = Connection::open(scratch.map.path()).unwrap();
    for sql in [
        "DELETE FROM feature_version",
        "DELETE FROM feature_version WHERE from_version = 2",
        "DELETE FROM forgotten",
        "UPDATE forgotten SET operations = zeroblob(32)",
        "UPDATE forgotten SET last_fid = 0",
        "UPDATE forgotten SET has_state = 1",
        "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at) VALUES (2, 0, zeroblob(32), 9, 0)",
        "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at) VALUES (5, 0, zeroblob(32), 9, 0)",
    ] {
        assert!(raw.execute_batch(sql).is_err(), "{sql}");
    }
}

#[test]
fn what_a_forgotten_version_did_is_said_to_be_unknown_and_not_guessed() {
    let scratch = Scratch::new();
    scratch.add(0, &[chair(0.0), banner(50.0)]).unwrap();
    for version in 1..5 {
        let mut update = transaction(version);
        let (before, after) = (chair(version as f64 - 1.0), chair(version as f64));
        update.deltas = vec![Delta::modify(Fid(1), before, after)];
        if version == 4 {
            update.deltas.push(Delta::remove(Fid(2), banner(50.0)));
        }
        scratch.map.commit(&update, at(version as i64 + 1)).unwrap();
    }
    scratch.map.tag("surveyed", VersionId(3), at(9)).unwrap();
    scratch.map.gc(Some(VersionId(5)), at(9)).unwrap();
    let state = |offset: f64| Side::State(chair(offset));
    let step = |version, before, after| Step { version: VersionId(version), before, after };
    let steps = |fid| scratch.map.why(Fid(fid)).unwrap().into_iter().map(|one| one.step).collect::<Vec<_>>();
    // Version 1, 2 and 4 are forgotten. That the banner came with version 1 is known, because version 0 had nothing.
    let expected = [
        step(5, Side::Forgotten, state(4.0)),
        step(4, state(2.0), Side::Forgotten),
        step(3, Side::Forgotten, state(2.0)),
    ];
    assert_eq!(steps(1), expected);
    let hung = || Side::State(banner(50.0));
    assert_eq!(steps(2), [step(5, hung(), Side::Absent), step(1, Side::Absent, hung())]);
    let counts = |log: Vec<VersionRecord>| log.into_iter().map(|one| (one.version.0, one.counts)).collect::<Vec<_>>();
    assert_eq!(counts(scratch.map.log_of(Fid(1)).unwrap()), [(5, None), (4, None), (3, None)]);
    let (added, removed) = (Counts { added: 1, ..Counts::default() }, Counts { removed: 1, ..Counts::default() });
    assert_eq!(counts(scratch.map.log_of(Fid(2)).unwrap()), [(5, Some(removed)), (1, Some(added))]);
    // Of a region a forgotten version may have changed more than what is left tells.
    let everywhere = BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap();
    let there = counts(scratch.map.log(Some(&everywhere)).unwrap());
    assert_eq!(there, [(5, None), (4, None), (3, None), (1, None)]);
    // The versions themselves still say how many they changed.
    let counts = Counts { modified: 1, ..Counts::default() };
    assert_eq!(scratch.map.version(VersionId(4)).unwrap().counts, Some(counts));
}
