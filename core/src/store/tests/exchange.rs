//! Change sets between copies of a map: out as text, in on another copy, and back.

use super::*;
use crate::version::{Digest, read_change_set, write_change_set};
use proptest::prelude::*;
use resurvey_schema::changes::{ChangeSetHeader, FORMAT};
use std::collections::BTreeMap;

/// What leads from one version to another, as text.
fn changes(scratch: &Scratch, from: u64, to: u64) -> String {
    let (from, to) = (VersionId(from), VersionId(to));
    let deltas = scratch.map.changes(from, to, None).unwrap();
    let digests = deltas.iter().filter_map(|delta| delta.after()?.geometry());
    let geometries: BTreeMap<Digest, Vec<u8>> =
        digests.map(|digest| (digest, scratch.map.geometry(digest).unwrap())).collect();
    let header = ChangeSetHeader {
        format: FORMAT.to_owned(),
        base_version: None,
        author: None,
        message: None,
        observed_at: None,
        map_id: None,
        base_hash: None,
        classes: None,
    };
    let (before, after) = (scratch.map.snapshot(from).unwrap(), scratch.map.snapshot(to).unwrap());
    write_change_set(&header, &deltas, (before.classes(), after.classes()), &geometries).unwrap()
}

/// Applies a set to the newest version, unless it changes nothing.
fn apply(scratch: &Scratch, text: &str) -> usize {
    let head = scratch.map.head().unwrap();
    let set = read_change_set(text, scratch.map.snapshot(head).unwrap().classes()).unwrap();
    let transaction = set.into_transaction(head);
    if !transaction.is_empty() {
        scratch.map.commit(&transaction, at(99)).unwrap();
    }
    scratch.map.head().unwrap().0 as usize
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn a_copy_is_led_from_any_version_to_any_other_and_back(
        history in moves(), from in any::<usize>(), to in any::<usize>(),
    ) {
        let (scratch, copy) = (Scratch::new(), Scratch::new());
        let contents = play(&scratch.map, &history);
        let (from, to) = (from % contents.len(), to % contents.len());
        let start = apply(&copy, &changes(&scratch, 0, from as u64));
        prop_assert_eq!(&content(&copy.map, start), &contents[from]);
        let there = apply(&copy, &changes(&scratch, from as u64, to as u64));
        prop_assert_eq!(&content(&copy.map, there), &contents[to]);
        let back = apply(&copy, &changes(&scratch, to as u64, from as u64));
        prop_assert_eq!(&content(&copy.map, back), &contents[from]);
        prop_assert_eq!(copy.map.fsck(), Ok(Vec::new()));
    }
}

#[test]
fn objects_travel_with_their_geometry_and_every_kind_of_descriptor_to_the_last_bit() {
    let scratch = fsck::eventful();
    let mut turned = transaction(4);
    let FeatureState::Descriptor(Descriptor::Dynamic(chair)) = chair(8.0) else { panic!() };
    // A heading that does not come back from degrees to the last bit is the same all the same.
    let facing = |yaw: f64| {
        FeatureState::Descriptor(Descriptor::Dynamic(DynamicDescriptor { yaw_rad: Some(yaw), ..chair.clone() }))
    };
    turned.additions = (0..50).map(|step| facing(f64::from(step) * 0.123_456_789)).collect();
    scratch.map.commit(&turned, at(7)).unwrap();
    let copy = Scratch::new();
    // The class table was renamed in version 4: the copy takes over what was there before.
    let there = apply(&copy, &changes(&scratch, 0, 3));
    assert_eq!(content(&copy.map, there), content(&scratch.map, 3));
    assert_eq!(copy.map.geometry(Digest::of(b"a mesh")), Ok(b"a mesh".to_vec()));
    let there = apply(&copy, &changes(&scratch, 4, 5));
    let pairs = content(&copy.map, there).into_iter().zip(content(&scratch.map, 5));
    for ((fid, state), (other_fid, other)) in pairs {
        assert!(fid == other_fid && state.is_same_as(&other), "{state:?} {other:?}");
    }
    let back = apply(&copy, &changes(&scratch, 5, 4));
    assert_eq!(content(&copy.map, back), content(&scratch.map, 3));
}
