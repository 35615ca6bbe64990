//! Banners on a façade of the toy world: what is measured, and what each requirement refuses.

mod world;

use resurvey_plugin::schema::{ClassId, Pose};
use resurvey_plugin::toy::{Paint, noise};
use world::*;

fn banner_capture(east_m: f64, height_m: f64) -> Vec<u8> {
    photo(with(street(), &[banner(at(east_m, FACADE_M, height_m), 6.0, 4.0)]), &pose())
}

/// The one rejection, which must be of `requirement`.
fn refused(map: resurvey_plugin::toy::ToyScene, photo: Vec<u8>, requirement: &str, unit: &str) -> (f64, f64) {
    let (_, proposals) = update(map, photo, known(pose()));
    assert!(placed(&proposals).is_empty(), "{proposals:?}");
    let rejection = rejected(&proposals).into_iter().find(|rejection| rejection.class_after == BANNER);
    let rejection = rejection.expect("the banner is refused");
    assert_eq!((rejection.requirement.as_str(), rejection.unit.as_str()), (requirement, unit), "{rejection:?}");
    (rejection.measured, rejection.limit)
}

#[test]
fn a_banner_at_the_true_pose_is_measured_within_5_cm_and_2_percent() {
    let truth = at(1.0, FACADE_M, 7.0);
    let (regions, proposals) = update(street(), banner_capture(1.0, 7.0), known(pose()));
    assert_eq!(regions.len(), 1, "stone and windows behind it are one region");
    let banner = the_banner(&proposals);
    assert!(distance_m(&banner.centre(), &truth) < 0.05, "{:?}", banner.centre());
    let [_, _, area_m2] = measures(banner);
    assert!((area_m2 / 24.0 - 1.0).abs() < 0.02, "{area_m2} m2");
    let want = [at(-2.0, FACADE_M, 5.0), at(4.0, FACADE_M, 5.0), at(4.0, FACADE_M, 9.0), at(-2.0, FACADE_M, 9.0)];
    for (found, want) in banner.corners.iter().zip(&want) {
        assert!(distance_m(found, want) < 0.06, "corners go bottom-left, bottom-right, top-right, top-left");
    }
    assert!(banner.normal[1] < -0.999, "outward is towards the camera");
}

#[test]
fn backing_off_scales_the_area_by_its_square() {
    // docs/method.md, Oracles: (1 + e/z)².
    for back_m in [0.5, 1.0, 2.0] {
        let mut wrong = pose();
        wrong.position.northing_m -= back_m;
        let any_sigma = [("max_position_sigma_m", 10.into())];
        let estimate = estimate(wrong, back_m, 0.02);
        let (_, proposals) = update_with(street(), banner_capture(0.0, 7.0), estimate, &[], &any_sigma);
        let [_, _, area_m2] = measures(the_banner(&proposals));
        let want_m2 = 24.0 * (1.0 + back_m / FACADE_M).powi(2);
        assert!((area_m2 / want_m2 - 1.0).abs() < 0.02, "{back_m} m: {area_m2} m2, expected {want_m2}");
    }
}

#[test]
fn the_sigma_covers_a_pose_error_of_its_size() {
    let mut wrong = pose();
    wrong.position.easting_m += 0.4;
    let (_, proposals) = update(street(), banner_capture(0.0, 7.0), estimate(wrong, 0.4, 0.3));
    let banner = the_banner(&proposals);
    let error_m = distance_m(&banner.centre(), &at(0.0, FACADE_M, 7.0));
    assert!((error_m - 0.4).abs() < 0.05, "a step to the side moves the banner by it: {error_m}");
    assert!(banner.sigma.unwrap().position_m > error_m);
}

#[test]
fn a_banner_cut_by_the_image_border_is_not_placed() {
    let (measured, limit) = refused(street(), banner_capture(-27.0, 7.0), "captured-entirely", "px");
    assert!(measured > 0.0 && limit < 0.5, "{measured} px on the border, {limit} allowed");
}

#[test]
fn a_banner_of_which_foliage_hides_a_side_is_not_placed() {
    let mut labels = banner_capture(0.0, 7.0);
    noise::ellipse(&mut labels, 960, ([530.0, 280.0], [25.0, 60.0], 0.0), FOLIAGE);
    let (measured, limit) = refused(street(), labels, "captured-entirely", "ratio");
    assert!(measured > limit);
}

#[test]
fn a_banner_of_which_foliage_hides_a_corner_keeps_its_corners() {
    let mut labels = banner_capture(0.0, 7.0);
    noise::ellipse(&mut labels, 960, ([533.0, 320.0], [22.0, 22.0], 0.0), FOLIAGE);
    let (_, proposals) = update(street(), labels, known(pose()));
    let banner = the_banner(&proposals);
    assert!(distance_m(&banner.corners[1], &at(3.0, FACADE_M, 5.0)) < 0.1, "{:?}", banner.corners);
}

#[test]
fn a_banner_beyond_the_range_limit_is_not_placed() {
    let mut far = street();
    far.rectangles.clear();
    far.add_wall(
        [ORIGIN[0] - 99.0, ORIGIN[1] + 55.0],
        [ORIGIN[0] + 99.0, ORIGIN[1] + 55.0],
        [0.0, 60.0],
        Paint::Plain(STONE),
    );
    let labels = photo(with(far.clone(), &[banner(at(0.0, 55.0, 15.0), 16.0, 10.0)]), &pose());
    let (measured_m, limit_m) = refused(far, labels, "within-range", "m");
    assert!(measured_m > 55.0 && (limit_m - 50.0).abs() < 1e-9);
}

#[test]
fn a_banner_around_a_corner_of_the_building_is_not_coplanar() {
    let mut corner = street();
    corner.rectangles.clear();
    let plan = |e: f64, n: f64| [ORIGIN[0] + e, ORIGIN[1] + n];
    corner.add_wall(plan(-30.0, 30.0), plan(0.0, 15.0), [0.0, 20.0], Paint::Plain(STONE));
    corner.add_wall(plan(0.0, 15.0), plan(30.0, 30.0), [0.0, 20.0], Paint::Plain(STONE));
    let mut labels = photo(corner.clone(), &pose());
    for v in 200..280 {
        labels[v * 960 + 420..v * 960 + 540].fill(BANNER.0);
    }
    let (measured_m, limit_m) = refused(corner, labels, "coplanar", "m");
    assert!(measured_m > limit_m);
}

#[test]
fn a_disk_or_an_ellipse_is_no_rectangle() {
    for axes in [[55.0, 55.0], [70.0, 40.0], [35.0, 35.0]] {
        let mut labels = photo(street(), &pose());
        noise::ellipse(&mut labels, 960, ([500.0, 250.0], axes, 0.0), BANNER);
        let (measured, limit) = refused(street(), labels, "rectangle", "ratio");
        assert!(measured > limit, "{axes:?} leaves the corners of its rectangle empty: {measured}");
    }
}

#[test]
fn a_triangle_is_no_rectangle() {
    let mut labels = photo(street(), &pose());
    for v in 200..300usize {
        labels[v * 960 + 480 - (v - 200) / 2..v * 960 + 480 + (v - 200) / 2].fill(BANNER.0);
    }
    refused(street(), labels, "rectangle", "ratio");
}

#[test]
fn an_l_shape_is_no_rectangle() {
    let mut labels = photo(street(), &pose());
    for v in 200..300usize {
        let right = if v < 250 { 480 } else { 560 };
        labels[v * 960 + 420..v * 960 + right].fill(BANNER.0);
    }
    refused(street(), labels, "rectangle", "ratio");
}

#[test]
fn contours_that_wander_by_4_px_leave_a_banner_and_its_mean_area() {
    let clean = banner_capture(0.0, 7.0);
    let (mut found, mut sum) = (0, 0.0);
    for seed in 100..140 {
        let labels = noise::jitter(&clean, 960, 4.0, &mut noise::Random::new(seed));
        let (_, proposals) = update(street(), labels, known(pose()));
        if !placed(&proposals).is_empty() {
            found += 1;
            sum += measures(the_banner(&proposals))[2] / 24.0 - 1.0;
        }
    }
    let mean = sum / f64::from(found);
    println!("{found} of 40 measured, mean area error {:.1} %", 100.0 * mean);
    assert!(found >= 36 && mean.abs() < 0.03, "{found} of 40, {mean}");
}

#[test]
fn a_trapezium_is_no_rectangle() {
    let mut labels = photo(street(), &pose());
    for v in 200..300usize {
        let half = 20 + (v - 200) / 2;
        labels[v * 960 + 480 - half..v * 960 + 480 + half].fill(BANNER.0);
    }
    let (measured, limit) = refused(street(), labels, "rectangle", "ratio");
    assert!(measured > limit);
}

#[test]
fn a_banner_seen_from_an_uncertain_pose_is_not_placed() {
    let (_, proposals) = update(street(), banner_capture(0.0, 7.0), estimate(pose(), 2.0, 0.1));
    assert!(placed(&proposals).is_empty());
    assert_eq!(rejected(&proposals)[0].requirement, "uncertain");
    assert!(rejected(&proposals)[0].measured > 1.5);
}

#[test]
fn making_a_true_rectangle_halves_the_error_under_noise() {
    let truth = [at(-3.0, FACADE_M, 5.0), at(3.0, FACADE_M, 5.0), at(3.0, FACADE_M, 9.0), at(-3.0, FACADE_M, 9.0)];
    let clean = banner_capture(0.0, 7.0);
    let mut error_m = [0.0, 0.0];
    let mut found = [0, 0];
    for seed in 0..12 {
        let labels = noise::jitter(&clean, 960, 2.0, &mut noise::Random::new(seed));
        for (way, regularise) in [false, true].into_iter().enumerate() {
            let changes = [("regularise", regularise.into())];
            let (_, proposals) = update_with(street(), labels.clone(), known(pose()), &[], &changes);
            if placed(&proposals).is_empty() {
                continue;
            }
            found[way] += 1;
            let banner = the_banner(&proposals);
            error_m[way] += banner.corners.iter().zip(&truth).map(|(a, b)| distance_m(a, b)).sum::<f64>() / 4.0;
        }
    }
    assert!(found == [12, 12], "{found:?} of 12 measured");
    let [free_m, regular_m] = [0, 1].map(|way| error_m[way] / f64::from(found[way]));
    println!("mean corner error: {free_m:.3} m as fitted, {regular_m:.3} m as a rectangle");
    assert!(regular_m < 0.8 * free_m && regular_m < 0.15, "{free_m} m, {regular_m} m");
}

#[test]
fn the_paper_s_profile_refuses_when_any_region_touches_the_border() {
    let two = [banner(at(0.0, FACADE_M, 9.0), 14.0, 10.0), banner(at(-30.0, FACADE_M, 9.0), 16.0, 10.0)];
    let labels = photo(with(street(), &two), &pose());
    let paper = [("profile", "paper".into())];
    let (_, proposals) = update_with(street(), labels.clone(), known(pose()), &[], &paper);
    assert!(placed(&proposals).is_empty());
    let (_, proposals) = update(street(), labels, known(pose()));
    assert_eq!(placed(&proposals).len(), 1, "the whole banner does not depend on the other one: {proposals:?}");
}

#[test]
fn the_same_banner_seen_again_is_no_change() {
    let labels = banner_capture(0.0, 7.0);
    let (_, proposals) = update(street(), labels.clone(), known(pose()));
    let map = with(street(), &[placed(&proposals)[0].clone()]);
    assert_eq!(update(map, labels, known(pose())).0, []);
}

#[test]
fn a_rolled_and_turned_camera_measures_the_same_banner() {
    let turned = Pose { yaw_rad: 0.6, pitch_rad: 0.15, roll_rad: 0.1, ..pose() };
    let labels = photo(with(street(), &[banner(at(9.0, FACADE_M, 7.0), 6.0, 4.0)]), &turned);
    let (_, proposals) = update(street(), labels, known(turned));
    let banner = the_banner(&proposals);
    assert_eq!(banner.class, ClassId(3));
    assert!(distance_m(&banner.centre(), &at(9.0, FACADE_M, 7.0)) < 0.05);
    assert!((measures(banner)[2] / 24.0 - 1.0).abs() < 0.02);
}

#[test]
fn a_covariance_of_nan_is_refused_as_uncertain() {
    let mut unknown = known(pose());
    unknown.covariance = [[f64::NAN; 3]; 3];
    let (_, proposals) = update(street(), banner_capture(0.0, 7.0), unknown);
    assert!(placed(&proposals).is_empty());
    assert_eq!(rejected(&proposals)[0].requirement, "uncertain");
}

#[test]
fn a_mask_that_does_not_fit_its_bounds_is_an_error_that_says_so() {
    use resurvey_plugin::schema::{ChangeRegion, PixelBox};
    use resurvey_plugin::{Estimator, Plugin};
    let host = resurvey_plugin::toy::ToyHost::new(street(), camera());
    let capture = host.capture(banner_capture(0.0, 7.0), known(pose()));
    let bounds = PixelBox { left: 900, top: 700, right: 970, bottom: 710 };
    let region = ChangeRegion { class_before: STONE, class_after: BANNER, bounds, mask: vec![1; 700], pixels: 700 };
    let settings = settings::<resurvey_descriptors::Descriptors>(&[]);
    let mut estimator = resurvey_descriptors::Descriptors::create(settings).unwrap();
    let error = estimator.estimate(&host, &capture.comparison(), &[region]).unwrap_err();
    assert!(error.0.contains("region 0") && error.0.contains("960×720"), "{error}");
}
