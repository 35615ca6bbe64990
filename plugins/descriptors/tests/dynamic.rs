//! Chairs and people on the pavement of the toy world.

mod world;

use resurvey_plugin::schema::{ClassId, Descriptor, GridPoint, Proposal};
use resurvey_plugin::toy::noise;
use world::*;

fn capture(objects: &[Descriptor]) -> Vec<u8> {
    photo(with(street(), objects), &pose())
}

fn positions(proposals: &[Proposal]) -> Vec<GridPoint> {
    placed(proposals).into_iter().map(Descriptor::anchor).collect()
}

#[test]
fn an_object_is_placed_where_its_centre_stands() {
    for (class, position) in [
        (PEDESTRIAN, at(0.0, 8.0, 0.0)),
        (PEDESTRIAN, at(-4.0, 9.0, 0.0)),
        (CHAIR, at(1.0, 4.0, 0.0)),
        (CHAIR, at(-2.0, 5.0, 0.0)),
    ] {
        let (_, proposals) = update(street(), capture(&[object(class, position)]), known(pose()));
        let found = positions(&proposals);
        assert!(found.len() == 1 && distance_m(&found[0], &position) < 0.15, "{position:?}: {proposals:?}");
        assert_eq!(placed(&proposals)[0].class(), class);
    }
}

#[test]
fn a_pose_error_moves_an_object_by_exactly_itself() {
    // docs/method.md, Oracles: on level ground.
    let position = at(0.5, 6.0, 0.0);
    let labels = capture(&[object(PEDESTRIAN, position)]);
    let (_, proposals) = update(street(), labels.clone(), known(pose()));
    let before = positions(&proposals)[0];
    for error in [[0.7, 0.0], [-0.3, 0.4]] {
        let mut wrong = pose();
        wrong.position.easting_m += error[0];
        wrong.position.northing_m += error[1];
        let (_, proposals) = update(street(), labels.clone(), estimate(wrong, 0.3, 0.02));
        let moved = positions(&proposals)[0];
        assert!((moved.easting_m - before.easting_m - error[0]).abs() < 1e-6);
        assert!((moved.northing_m - before.northing_m - error[1]).abs() < 1e-6);
    }
}

#[test]
fn two_chairs_that_touch_are_two() {
    let chairs = [at(0.0, 4.0, 0.0), at(0.5, 4.0, 0.0)];
    let (regions, proposals) = update(street(), capture(&chairs.map(|chair| object(CHAIR, chair))), known(pose()));
    assert_eq!(regions.len(), 1);
    let found = positions(&proposals);
    assert_eq!(found.len(), 2, "{proposals:?}");
    for chair in chairs {
        assert!(found.iter().any(|found| distance_m(found, &chair) < 0.2), "{chair:?} in {found:?}");
    }
}

#[test]
fn a_chair_that_partly_hides_one_behind_it_is_one_of_two() {
    let chairs = [at(0.0, 3.5, 0.0), at(0.75, 5.5, 0.0)];
    let (_, proposals) = update(street(), capture(&chairs.map(|chair| object(CHAIR, chair))), known(pose()));
    let found = positions(&proposals);
    assert_eq!(found.len(), 2, "{proposals:?}");
}

#[test]
fn a_person_cut_by_the_border_is_refused() {
    let (_, proposals) = update(street(), capture(&[object(PEDESTRIAN, at(4.2, 3.0, 0.0))]), known(pose()));
    assert!(placed(&proposals).is_empty());
    assert_eq!(rejected(&proposals)[0].requirement, "captured-entirely");
}

#[test]
fn a_person_whose_feet_a_wrong_blob_hides_is_refused() {
    // In the alley of the field captures such a person was placed 2.9 m too far away.
    let mut labels = capture(&[object(PEDESTRIAN, at(0.0, 8.0, 0.0))]);
    noise::ellipse(&mut labels, 960, ([480.0, 442.0], [26.0, 14.0], 0.0), GLASS);
    let (_, proposals) = update(street(), labels, known(pose()));
    assert!(placed(&proposals).is_empty(), "{proposals:?}");
    let rejection = rejected(&proposals).into_iter().find(|rejection| rejection.class_after == PEDESTRIAN).unwrap();
    assert_eq!(rejection.requirement, "captured-entirely");
    assert!(rejection.measured > rejection.limit, "share of the feet hidden");
}

#[test]
fn a_person_with_a_ragged_foot_is_one() {
    // In the blocks of the field captures a tip beside the feet passed for a second person.
    let person = at(0.0, 8.0, 0.0);
    let mut labels = capture(&[object(PEDESTRIAN, person)]);
    for row in 0..14usize {
        labels[(431 + row) * 960 + 470 - row..(431 + row) * 960 + 480].fill(PEDESTRIAN.0);
    }
    let (_, proposals) = update(street(), labels, known(pose()));
    let found = positions(&proposals);
    assert!(found.len() == 1 && distance_m(&found[0], &person) < 0.5, "{proposals:?}");
}

#[test]
fn a_picture_of_a_person_on_the_wall_has_no_ground_contact() {
    let mut labels = photo(street(), &pose());
    for v in 100..200 {
        labels[v * 960 + 460..v * 960 + 492].fill(PEDESTRIAN.0);
    }
    let (_, proposals) = update(street(), labels, known(pose()));
    assert!(placed(&proposals).is_empty());
    assert_eq!(rejected(&proposals)[0].requirement, "ground-contact");
}

#[test]
fn a_giant_is_refused_for_its_size() {
    let mut world = street();
    world.add_box(at(0.0, 8.0, 0.0), [1.5, 1.5, 5.0], PEDESTRIAN);
    let (_, proposals) = update(street(), photo(world, &pose()), known(pose()));
    assert!(placed(&proposals).is_empty(), "{proposals:?}");
    let rejection = rejected(&proposals)[0];
    assert_eq!(rejection.requirement, "size");
    assert!(rejection.measured > 2.0 && rejection.limit < 2.0);
}

#[test]
fn a_person_seen_from_an_uncertain_pose_is_refused() {
    let labels = capture(&[object(PEDESTRIAN, at(0.0, 8.0, 0.0))]);
    let (_, proposals) = update(street(), labels, estimate(pose(), 2.0, 0.1));
    assert_eq!(rejected(&proposals)[0].requirement, "uncertain");
}

#[test]
fn a_person_beyond_the_range_limit_is_refused() {
    let labels = capture(&[object(PEDESTRIAN, at(0.0, 8.0, 0.0))]);
    let limit = [("max_range_m", 5.into())];
    let (_, proposals) = update_with(street(), labels, known(pose()), &[], &limit);
    assert_eq!(rejected(&proposals)[0].requirement, "within-range");
    assert!((rejected(&proposals)[0].measured - 7.75f64.hypot(1.6)).abs() < 0.1, "to the near edge of its foot");
}

#[test]
fn jittered_contours_move_a_chair_by_decimetres_at_most() {
    let chairs = [at(-1.0, 4.0, 0.0), at(1.5, 5.0, 0.0)];
    let clean = capture(&chairs.map(|chair| object(CHAIR, chair)));
    for seed in 0..10 {
        let labels = noise::jitter(&clean, 960, 2.0, &mut noise::Random::new(seed));
        let (_, proposals) = update(street(), labels, known(pose()));
        let found = positions(&proposals);
        assert_eq!(found.len(), 2, "seed {seed}: {proposals:?}");
        for chair in chairs {
            assert!(found.iter().any(|found| distance_m(found, &chair) < 0.35), "seed {seed}: {found:?}");
        }
    }
}

fn removed(proposals: &[Proposal]) -> Vec<(ClassId, GridPoint)> {
    proposals
        .iter()
        .filter_map(|proposal| match proposal {
            Proposal::Remove { class, near, .. } => Some((*class, *near)),
            _ => None,
        })
        .collect()
}

#[test]
fn a_chair_that_is_gone_is_removed_and_its_neighbour_stays() {
    let chairs = [at(-0.6, 4.0, 0.0), at(0.6, 4.0, 0.0)].map(|chair| object(CHAIR, chair));
    let map = with(street(), &chairs);
    let mut wrong = pose();
    wrong.position.easting_m += 0.15;
    for pose in [pose(), wrong] {
        let (_, proposals) = update(map.clone(), capture(&chairs[..1]), estimate(pose, 0.15, 0.2));
        assert_eq!(removed(&proposals), [(CHAIR, at(0.6, 4.0, 0.0))]);
        assert!(placed(&proposals).is_empty(), "{proposals:?}");
    }
}

#[test]
fn a_chair_behind_foliage_is_not_removed() {
    let map = with(street(), &[object(CHAIR, at(0.0, 4.0, 0.0))]);
    let mut labels = photo(street(), &pose());
    noise::ellipse(&mut labels, 960, ([480.0, 440.0], [80.0, 90.0], 0.0), FOLIAGE);
    let (regions, proposals) = update(map, labels, known(pose()));
    assert_eq!((regions.len(), proposals.len()), (0, 0), "{proposals:?}");
}

#[test]
fn a_chair_that_is_still_there_is_no_change() {
    let chair = [object(CHAIR, at(0.0, 4.0, 0.0))];
    let map = with(street(), &chair);
    for (east_m, yaw_deg) in [(0.0, 0.0), (0.2, 0.0), (-0.2, 0.3), (0.3, -0.3)] {
        let mut wrong = pose();
        wrong.position.easting_m += east_m;
        wrong.yaw_rad += f64::to_radians(yaw_deg);
        let (regions, _) = update(map.clone(), capture(&chair), estimate(wrong, 0.2, 0.3));
        assert_eq!(regions, [], "{east_m} m, {yaw_deg} deg");
    }
}

#[test]
fn a_banner_taken_down_is_removed_whatever_is_behind_it() {
    let centre = at(0.0, FACADE_M, 7.0);
    let map = with(street(), &[banner(centre, 6.0, 4.0)]);
    let (_, proposals) = update(map, photo(street(), &pose()), known(pose()));
    let removed = removed(&proposals);
    assert!(removed.len() == 1 && removed[0].0 == BANNER && distance_m(&removed[0].1, &centre) < 1e-6);
    assert_eq!(proposals.len(), 1, "what was behind it is nothing new: {proposals:?}");
}
