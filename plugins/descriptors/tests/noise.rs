//! Captures in which nothing changed but the labels are noisy and the pose is off: nothing may be proposed.

mod world;

use resurvey_plugin::toy::noise::{Random, blobs, jitter};
use world::*;

/// Poses off by 1σ of `position_m` and `angle_deg`, labels jittered and with 2 % in blobs, walls of the map off by
/// `shift_m`.
fn proposals_of_noise(seeds: std::ops::Range<u64>, position_m: f64, angle_deg: f64, shift_m: f64) -> Vec<String> {
    let mut wrong = Vec::new();
    for seed in seeds {
        let mut random = Random::new(seed);
        let mut off = pose();
        off.position.easting_m += position_m * random.normal();
        off.position.northing_m += position_m * random.normal() + shift_m;
        off.yaw_rad += angle_deg.to_radians() * random.normal();
        off.pitch_rad += angle_deg.to_radians() * random.normal();
        let objects = [object(CHAIR, at(-2.0, 6.0, 0.0)), banner(at(6.0, FACADE_M, 7.0), 5.0, 3.0)];
        let map = with(street(), &objects);
        let mut labels = jitter(&photo(map.clone(), &pose()), 960, 2.0, &mut random);
        blobs(&mut labels, 960, (0.02, 30.0), &[STONE, GLASS, METAL, BANNER, OTHERS], &mut random);
        let (_, proposals) = update(map, labels, estimate(off, position_m, angle_deg));
        let not_rejected = proposals.len() - rejected(&proposals).len();
        if not_rejected > 0 {
            wrong.push(format!("seed {seed}: {proposals:?}"));
        }
    }
    wrong
}

#[test]
fn noise_with_a_pose_error_of_0_3_m_and_0_3_deg_proposes_nothing() {
    let wrong = proposals_of_noise(0..24, 0.3, 0.3, 0.0);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn walls_that_are_off_by_a_quarter_of_a_metre_propose_nothing() {
    let wrong = proposals_of_noise(100..112, 0.1, 0.1, 0.25);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn equal_images_give_no_region() {
    let map = with(street(), &[object(CHAIR, at(-2.0, 6.0, 0.0)), banner(at(6.0, FACADE_M, 7.0), 5.0, 3.0)]);
    let labels = photo(map.clone(), &pose());
    assert_eq!(update(map, labels, known(pose())).0, []);
}
