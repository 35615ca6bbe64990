//! Undoing versions.

use super::*;
use crate::store::{ConflictingChange, Made, Revert, Reverted, StoreError};
use crate::version::{BoxMm, Counts, Delta, Digest, VersionKind};

fn wish(version: u64, region: Option<BoxMm>) -> Revert {
    Revert {
        version: VersionId(version),
        region,
        author: "ada".to_owned(),
        message: None,
        idempotency_key: None,
        request: None,
    }
}

fn undo(scratch: &Scratch, version: u64) -> Result<VersionId, CommitError> {
    scratch.map.revert(&wish(version, None), at(50))
}

/// Around what stands `offset` m north of the banner's corner.
fn around(offset: f64) -> Option<BoxMm> {
    let n = 817_816.210_8 + offset;
    Some(BoxMm::of_plan(835_560.0, n - 1.0, 835_575.0, n + 1.0).unwrap())
}

#[test]
fn an_undo_says_what_it_undoes_and_speaks_of_the_same_time() {
    let scratch = Scratch::with_two_features();
    let mut update = transaction(1);
    update.deltas = vec![Delta::modify(Fid(1), banner(0.0), banner(1.0))];
    update.observed_at = Some(at(-100));
    scratch.map.commit(&update, at(2)).unwrap();
    assert_eq!(undo(&scratch, 2), Ok(VersionId(3)));
    let record = scratch.map.version(VersionId(3)).unwrap();
    assert_eq!(
        (record.kind, record.reverts, record.observed_at),
        (VersionKind::Revert, Some(VersionId(2)), Some(at(-100)))
    );
    assert_eq!((record.author.as_str(), record.message.as_str()), ("ada", "revert version 2: a test"));
    assert_eq!(scratch.live(1), banner(0.0));
}

#[test]
fn an_undo_of_what_later_versions_changed_is_refused_with_each_of_them() {
    let scratch = Scratch::with_two_features();
    let mut both = transaction(1);
    both.deltas =
        vec![Delta::modify(Fid(1), banner(0.0), banner(1.0)), Delta::modify(Fid(2), chair(100.0), chair(101.0))];
    scratch.map.commit(&both, at(2)).unwrap();
    let mut later = transaction(2);
    later.deltas = vec![Delta::modify(Fid(2), chair(101.0), chair(102.0))];
    scratch.map.commit(&later, at(3)).unwrap();
    let Err(CommitError::Conflict { base, head, changed, .. }) = undo(&scratch, 2) else { panic!() };
    let found = Some(chair(102.0));
    let expected = ConflictingChange { fid: Fid(2), changed_in: Some(VersionId(3)), found, is_target: true };
    assert_eq!((base, head, changed), (VersionId(2), VersionId(3), vec![expected]));
    // Twice the same is a conflict too.
    assert_eq!(undo(&scratch, 3), Ok(VersionId(4)));
    assert!(matches!(undo(&scratch, 3), Err(CommitError::Conflict { .. })));
    assert_eq!(undo(&scratch, 2), Ok(VersionId(5)));
    assert_eq!((scratch.live(1), scratch.live(2)), (banner(0.0), chair(100.0)));
}

#[test]
fn an_undo_of_a_region_leaves_the_rest() {
    let scratch = Scratch::with_two_features();
    let both = |scratch: &Scratch| (scratch.live(1), scratch.live(2));
    let mut update = transaction(1);
    update.deltas =
        vec![Delta::modify(Fid(1), banner(0.0), banner(1.0)), Delta::modify(Fid(2), chair(100.0), chair(110.0))];
    scratch.map.commit(&update, at(2)).unwrap();
    // The chair left this region, so it is undone from its old place as well as from its new one.
    assert_eq!(scratch.map.revert(&wish(2, around(100.0)), at(3)), Ok(VersionId(3)));
    assert_eq!(both(&scratch), (banner(1.0), chair(100.0)));
    let counts = scratch.map.version(VersionId(3)).unwrap().counts;
    assert_eq!(counts, Some(Counts { added: 0, modified: 1, removed: 0 }));
    let nothing = CommitError::NothingToRevert { version: VersionId(2), place: " in the region" };
    assert_eq!(scratch.map.revert(&wish(2, around(500.0)), at(4)), Err(nothing));
    assert_eq!(undo(&scratch, 3), Ok(VersionId(4)));
    assert_eq!(both(&scratch), (banner(1.0), chair(110.0)));
}

#[test]
fn an_import_is_undone_and_done_again_with_its_geometry() {
    let scratch = Scratch::new();
    let bounds = BoxMm::from_mm([0; 3], [1000; 3]).unwrap();
    let mut import = transaction(0);
    let geometry = import.add_geometry(b"a mesh".to_vec());
    import.additions = vec![FeatureState::Object { name: "tower".to_owned(), geometry, bounds }];
    scratch.map.commit(&import, at(1)).unwrap();
    assert_eq!(undo(&scratch, 1), Ok(VersionId(2)));
    assert_eq!(undo(&scratch, 2), Ok(VersionId(3)));
    assert_eq!(scratch.live(1), import.additions[0]);
    assert_eq!(scratch.map.geometry(Digest::of(b"a mesh")), Ok(b"a mesh".to_vec()));
}

#[test]
fn a_class_table_is_undone_while_it_is_in_force() {
    let scratch = Scratch::with_two_features();
    let mut classes: Vec<_> = ClassTable::default().iter().cloned().collect();
    classes[8].name = "ground".to_owned();
    let mut rename = transaction(1);
    rename.classes = Some(ClassTable::new(classes).unwrap());
    scratch.map.commit(&rename, at(2)).unwrap();
    assert_eq!(undo(&scratch, 2), Ok(VersionId(3)));
    let name = |version| scratch.map.snapshot(VersionId(version)).unwrap().classes().name(ClassId(8)).to_owned();
    assert_eq!((name(2).as_str(), name(3).as_str()), ("ground", "others"));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn what_cannot_be_undone_is_refused_by_name() {
    let scratch = Scratch::with_two_features();
    assert_eq!(undo(&scratch, 0), Err(CommitError::NothingToRevert { version: VersionId(0), place: "" }));
    let missing = StoreError::NoSuchVersion { version: VersionId(9), head: VersionId(1) };
    assert_eq!(undo(&scratch, 9), Err(CommitError::Store(missing)));
}

#[test]
fn an_undo_that_is_sent_twice_is_done_once() {
    let scratch = Scratch::with_two_features();
    let keyed = Revert { idempotency_key: Some("undo 1".to_owned()), ..wish(1, None) };
    assert_eq!(scratch.map.revert(&keyed, at(2)), Ok(VersionId(2)));
    assert_eq!(scratch.map.revert(&keyed, at(3)), Ok(VersionId(2)));
    assert_eq!(scratch.map.made_with("undo 1"), Ok(Some(VersionId(2))));
    assert_eq!(scratch.map.head(), Ok(VersionId(2)));
}

#[test]
fn an_undo_that_is_sent_again_is_found_although_what_it_undid_is_forgotten() {
    let scratch = Scratch::with_two_features();
    let keyed = Revert { idempotency_key: Some("undo 1".to_owned()), ..wish(1, None) };
    assert_eq!(scratch.map.revert(&keyed, at(2)), Ok(VersionId(2)));
    scratch.map.gc(Some(VersionId(2)), at(3)).unwrap();
    assert_eq!(scratch.map.revert_once(&keyed, at(4)), Ok(Made { version: VersionId(2), repeated: true }));
}

#[test]
fn several_undos_that_are_sent_again_are_all_told_again() {
    let scratch = Scratch::with_two_features();
    scratch.add(1, &[chair(3.0)]).unwrap();
    scratch.add(2, &[chair(6.0)]).unwrap();
    let keyed = Revert { idempotency_key: Some("all".to_owned()), ..wish(0, None) };
    let versions = [VersionId(2), VersionId(3)];
    let undone = vec![(VersionId(3), VersionId(4)), (VersionId(2), VersionId(5))];
    let once = scratch.map.revert_all(&versions, &keyed, at(4)).unwrap();
    assert_eq!(once, Reverted { undone: undone.clone(), repeated: false });
    scratch.map.gc(Some(VersionId(5)), at(5)).unwrap();
    let again = scratch.map.revert_all(&versions, &keyed, at(6)).unwrap();
    assert_eq!((again, scratch.map.head()), (Reverted { undone, repeated: true }, Ok(VersionId(5))));
}
