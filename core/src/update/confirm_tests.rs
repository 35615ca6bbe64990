//! Agreement and fusion against values worked out by hand.

use super::super::overlap::tests::banner;
use super::*;
use proptest::prelude::*;
use resurvey_schema::{ClassId, ClassTable};

fn sure(position_m: f64, size_m: Option<f64>) -> Option<Uncertainty> {
    Some(Uncertainty { position_m, size_m, area_m2: None })
}

fn chair(east: f64, sigma_m: f64) -> Descriptor {
    Descriptor::Dynamic(DynamicDescriptor {
        class: ClassId(5),
        position: GridPoint::new(836_700.0 + east, 818_430.0, 7.2),
        size_m: [0.5, 0.5, 0.9],
        yaw_rad: None,
        sigma: sure(sigma_m, None),
    })
}

fn poster(west: f64, width: f64, sigma_m: f64) -> Descriptor {
    Descriptor::Material(MaterialDescriptor { sigma: sure(sigma_m, Some(sigma_m)), ..banner(west, 0.0, width, 3.0) })
}

fn says(proposal: u64, photo: &[u8], change: Change) -> Testimony {
    let (photo, observation) = (Digest::of(photo), Digest::of(&proposal.to_le_bytes()));
    Testimony { proposal, photo, observation, change }
}

#[test]
fn two_measurements_are_fused_with_weights_of_one_over_variance() {
    // σ 0.1 and 0.2 m: weights 100 and 25. Mean of 0 and 0.3 is 0.06; 1σ is 1/√125 = 0.0894 m; χ² is
    // (0.06/0.1)² + (0.24/0.2)² = 1.8, so the Birge ratio is √1.8 = 1.3416.
    let own = says(2, b"b", Change::Add(chair(0.3, 0.2)));
    let found = confirm(&own, &[says(1, b"a", Change::Add(chair(0.0, 0.1)))], 2).unwrap();
    let Change::Add(fused) = &found.change else { panic!() };
    assert!((fused.anchor().easting_m - 836_700.06).abs() < 1e-9, "{fused:?}");
    assert!((fused.sigma().unwrap().position_m - 0.089_442_7 * 1.341_640_8).abs() < 1e-6);
    assert_eq!(found.proposals, [1, 2]);
    assert_eq!(found.observations.len(), 2);
}

#[test]
fn measurements_that_agree_better_than_they_need_are_surer_than_each() {
    let own = says(3, b"c", Change::Add(chair(0.0, 0.1)));
    let others = [says(1, b"a", Change::Add(chair(0.0, 0.1))), says(2, b"b", Change::Add(chair(0.0, 0.1)))];
    let found = confirm(&own, &others, 3).unwrap();
    let Change::Add(fused) = found.change else { panic!() };
    // 0.1 / √3.
    assert!((fused.sigma().unwrap().position_m - 0.057_735).abs() < 1e-6);
}

#[test]
fn the_same_photo_twice_counts_once() {
    let own = says(3, b"a", Change::Add(chair(0.0, 0.1)));
    let others = [says(1, b"a", Change::Add(chair(0.0, 0.1)))];
    assert_eq!(confirm(&own, &others, 2), None);
    let found = confirm(&own, &[others[0].clone(), says(2, b"b", Change::Add(chair(0.1, 0.1)))], 2).unwrap();
    assert_eq!((found.proposals, found.observations.len()), (vec![1, 2, 3], 2));
}

#[test]
fn captures_that_differ_by_more_than_three_sigma_do_not_confirm_each_other() {
    let own = says(2, b"b", Change::Add(chair(0.0, 0.1)));
    // The difference has 1σ 0.1414 m, so the limit is 0.4243 m.
    let at = |east: f64| confirm(&own, &[says(1, b"a", Change::Add(chair(east, 0.1)))], 2);
    assert!(at(0.42).is_some() && at(0.43).is_none());
    let wider = says(2, b"b", Change::Add(poster(0.0, 4.0, 0.1)));
    let of_width = |width: f64| confirm(&wider, &[says(1, b"a", Change::Add(poster(0.0, width, 0.1)))], 2);
    assert!(of_width(4.3).is_some() && of_width(4.5).is_none());
}

#[test]
fn what_is_said_of_another_thing_confirms_nothing() {
    let own = says(9, b"z", Change::Add(chair(0.0, 0.1)));
    let Descriptor::Dynamic(dynamic) = chair(0.0, 0.1) else { panic!() };
    let pedestrian = Descriptor::Dynamic(DynamicDescriptor { class: ClassId(4), ..dynamic });
    let removal = Change::Remove { fid: 1, before: chair(0.0, 0.1) };
    let others = [says(1, b"a", Change::Add(pedestrian)), says(2, b"b", removal.clone())];
    assert_eq!(confirm(&own, &others, 2), None);
    let other = Change::Remove { fid: 2, before: chair(0.0, 0.1) };
    assert_eq!(confirm(&says(3, b"c", other), &others, 2), None);
    let found = confirm(&says(3, b"c", removal.clone()), &others, 2).unwrap();
    assert_eq!((found.change, found.proposals), (removal, vec![2, 3]));
    // The same feature, but as it was at another version.
    let stale = Change::Remove { fid: 1, before: chair(0.2, 0.1) };
    assert_eq!(confirm(&says(4, b"d", stale), &others, 2), None);
}

#[test]
fn a_fused_banner_has_the_mean_size_and_a_normal_of_its_corners() {
    let own = says(2, b"b", Change::Add(poster(0.0, 4.0, 0.1)));
    let found = confirm(&own, &[says(1, b"a", Change::Add(poster(0.0, 4.2, 0.1)))], 2).unwrap();
    let Change::Add(Descriptor::Material(fused)) = found.change else { panic!() };
    let [width, height] = size_m(&fused);
    assert!((width - 4.1).abs() < 1e-6 && (height - 3.0).abs() < 1e-6);
    assert!((Vector3::from(fused.normal) - Vector3::new(0.0, -1.0, 0.0)).norm() < 1e-9);
}

#[test]
fn headings_are_averaged_around_north() {
    let facing = |degrees: f64| {
        let Descriptor::Dynamic(dynamic) = chair(0.0, 0.1) else { panic!() };
        Descriptor::Dynamic(DynamicDescriptor { yaw_rad: Some(degrees.to_radians()), ..dynamic })
    };
    let own = says(2, b"b", Change::Add(facing(350.0)));
    let found = confirm(&own, &[says(1, b"a", Change::Add(facing(20.0)))], 2).unwrap();
    let Change::Add(Descriptor::Dynamic(fused)) = found.change else { panic!() };
    assert!((fused.yaw_rad.unwrap().to_degrees() - 5.0).abs() < 1e-6, "{fused:?}");
}

proptest! {
    #[test]
    fn what_is_fused_is_a_state_that_a_map_takes_and_does_not_depend_on_the_order(
        offsets in proptest::collection::vec((-0.1..0.1_f64, 3.9..4.1_f64, 0.1..0.5_f64), 2..6),
    ) {
        let all: Vec<Testimony> = offsets.iter().enumerate().map(|(place, (west, width, sigma))| {
            says(place as u64, &[place as u8], Change::Add(poster(*west, *width, *sigma)))
        }).collect();
        let found = confirm(&all[0], &all, all.len()).unwrap();
        let Change::Add(fused) = &found.change else { panic!() };
        FeatureState::Descriptor(fused.clone()).validate(&ClassTable::default()).unwrap();
        let last = all.last().unwrap();
        let other = confirm(last, &all, all.len()).unwrap();
        let Change::Add(reversed) = &other.change else { panic!() };
        prop_assert!(distance_m(fused.anchor(), reversed.anchor()) < 1e-6);
        let eastings = || all.iter().map(|one| match &one.change {
            Change::Add(descriptor) => descriptor.anchor().easting_m,
            other => panic!("{other:?}"),
        });
        let (low, high) = (eastings().fold(f64::INFINITY, f64::min), eastings().fold(f64::NEG_INFINITY, f64::max));
        prop_assert!((low - 1e-9..=high + 1e-9).contains(&fused.anchor().easting_m));
    }
}

#[test]
fn what_one_photo_says_in_two_captures_is_settled_once_and_each_thing_for_itself() {
    // Two chairs 0.6 m apart, within three sigma of each other; photo a was sent twice, with another prior.
    let beside = |proposal, photo: &[u8], seen: u64, east| Testimony {
        observation: Digest::of(&seen.to_le_bytes()),
        ..says(proposal, photo, Change::Add(chair(east, 0.2)))
    };
    let others = [
        beside(1, b"a", 10, 0.0),
        beside(2, b"a", 10, 0.6),
        beside(3, b"a", 11, 0.01),
        beside(4, b"a", 11, 0.61),
        beside(6, b"b", 12, 0.62),
    ];
    let found = confirm(&beside(5, b"b", 12, 0.02), &others, 2).unwrap();
    assert_eq!(found.proposals, [1, 3, 5]);
    assert_eq!(confirm(&beside(5, b"a", 12, 0.02), &others[..4], 2), None);
}
