//! Agreement with PROJ, an implementation of its own, with every step spelled out; and other codes through PROJ.

use super::{Crs, CrsError, GridPoint, Wgs84};
use proj::Proj;

/// PROJ's HK1980 Grid → WGS84 longitude and latitude in degrees, for points `height_m` above HKPD (the Rust interface
/// is 2D, so the height is a step of the pipeline). `last` may change what comes out as the first two coordinates.
fn pipeline(height_m: f64, last: &str) -> Proj {
    let steps = format!(
        "+proj=pipeline +step +proj=affine +zoff={height_m} \
         +step +inv +proj=tmerc +lat_0=22d18'43.68\"N +lon_0=114d10'42.80\"E +k=1 +x_0=836694.05 +y_0=819069.8 +ellps=intl \
         +step +proj=cart +ellps=intl \
         +step +proj=helmert +convention=coordinate_frame +x=-162.619 +y=-276.959 +z=-161.764 \
               +rx=-0.067753 +ry=2.243648 +rz=1.158828 +s=-1.094246 \
         +step +inv +proj=cart +ellps=WGS84 \
         +step +proj=unitconvert +xy_in=rad +xy_out=deg {last}"
    );
    Proj::new(&steps).unwrap()
}

/// Uniform in 0…1 by a linear congruence (Knuth's MMIX constants): the same points on every machine.
fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 11) as f64 / (1_u64 << 53) as f64
}

#[test]
fn ten_thousand_points_over_hong_kong_agree_with_proj_within_a_millimetre() {
    let mut state = 1980;
    let (mut worst_plan_m, mut worst_height_m, mut worst_back_m) = (0.0_f64, 0.0_f64, 0.0_f64);
    for _ in 0..20 {
        let height_m = uniform(&mut state) * 1000.0 - 50.0;
        let longitude_latitude = pipeline(height_m, "");
        let height_first = pipeline(height_m, "+step +proj=axisswap +order=3,1,2");
        for _ in 0..500 {
            let easting_m = 793_000.0 + 78_000.0 * uniform(&mut state);
            let northing_m = 799_000.0 + 51_000.0 * uniform(&mut state);
            let (longitude_deg, latitude_deg) = longitude_latitude.convert((easting_m, northing_m)).unwrap();
            let (ellipsoidal_height_m, _) = height_first.convert((easting_m, northing_m)).unwrap();
            let point = GridPoint::new(easting_m, northing_m, height_m);
            let ours = Crs::Hk1980.wgs84_from_grid(point).unwrap();
            let east_m = (ours.longitude_deg - longitude_deg) * 111_320.0 * latitude_deg.to_radians().cos();
            let north_m = (ours.latitude_deg - latitude_deg) * 110_750.0;
            worst_plan_m = worst_plan_m.max(east_m.hypot(north_m));
            worst_height_m = worst_height_m.max((ours.ellipsoidal_height_m - ellipsoidal_height_m).abs());
            let theirs = Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m };
            let back = Crs::Hk1980.grid_from_wgs84(theirs).unwrap();
            worst_back_m = worst_back_m.max(back.plan_distance_m(&point)).max((back.height_m - height_m).abs());
        }
    }
    println!("against PROJ: plan {worst_plan_m:.1e} m, height {worst_height_m:.1e} m, back {worst_back_m:.1e} m");
    assert!(worst_plan_m < 1e-3 && worst_height_m < 1e-3 && worst_back_m < 1e-3);
}

/// swisstopo, "Approximate formulas for the transformation between Swiss projection coordinates and WGS84": 1 m.
fn swisstopo_degrees(easting_m: f64, northing_m: f64) -> (f64, f64) {
    let (y, x) = ((easting_m - 2_600_000.0) / 1e6, (northing_m - 1_200_000.0) / 1e6);
    let longitude = 2.677_909_4 + 4.728_982 * y + 0.791_484 * y * x + 0.1306 * y * x * x - 0.0436 * y.powi(3);
    let latitude =
        16.902_389_2 + 3.238_272 * x - 0.270_978 * y * y - 0.002_528 * x * x - 0.0447 * y * y * x - 0.014 * x.powi(3);
    (latitude * 100.0 / 36.0, longitude * 100.0 / 36.0)
}

#[test]
fn swiss_coordinates_match_the_formulas_of_the_survey_office() {
    for (easting_m, northing_m) in [(2_600_000.0, 1_200_000.0), (2_700_000.0, 1_100_000.0), (2_726_201.0, 1_202_028.0)]
    {
        let point = GridPoint::new(easting_m, northing_m, 553.6);
        let found = Crs::Epsg(2056).wgs84_from_grid(point).unwrap();
        let (latitude_deg, longitude_deg) = swisstopo_degrees(easting_m, northing_m);
        assert!((found.latitude_deg - latitude_deg).abs() < 1.5e-5, "{found:?}");
        assert!((found.longitude_deg - longitude_deg).abs() < 2e-5, "{found:?}");
        assert!((found.ellipsoidal_height_m - 553.6).abs() < 1e-9, "heights pass through");
        let back = Crs::Epsg(2056).grid_from_wgs84(found).unwrap();
        // In 2D the height between two tilted ellipsoids is lost: there and back misses by 1.3 mm here.
        assert!(back.plan_distance_m(&point) < 5e-3, "{back:?}");
    }
}

#[test]
fn a_system_registered_with_the_northing_first_still_takes_easting_northing() {
    // EPSG:31467 (Gauss–Krüger zone 3, Germany) is N, E in the register. Its central meridian is 9° E at E 3 500 000.
    let found = Crs::Epsg(31467).wgs84_from_grid(GridPoint::new(3_500_000.0, 5_500_000.0, 0.0)).unwrap();
    assert!((found.longitude_deg - 9.0).abs() < 0.002 && (found.latitude_deg - 49.6).abs() < 0.1, "{found:?}");
    let back = Crs::Epsg(31467).grid_from_wgs84(found).unwrap();
    assert!(back.plan_distance_m(&GridPoint::new(3_500_000.0, 5_500_000.0, 0.0)) < 1e-3);
}

#[test]
fn a_model_in_utm_lands_on_hk1980_grid_with_its_height_kept() {
    // Lands Department transformation tool, station HKSC: WGS84 UTM 50Q 205494 E, 2471279 N, to the metre.
    let found = Crs::Hk1980.grid_from_other(Crs::Epsg(32650), GridPoint::new(205_494.0, 2_471_279.0, 23.119)).unwrap();
    assert!(found.plan_distance_m(&GridPoint::new(832_591.320, 820_351.389, 0.0)) < 1.5, "{found:?}");
    assert!((found.height_m - 23.119).abs() < 1e-9);
    // The same register name, computed by PROJ itself: no shift may be lost.
    let through_proj = Crs::Epsg(32650).grid_from_other(Crs::Hk1980, found).unwrap();
    assert!(through_proj.plan_distance_m(&GridPoint::new(205_494.0, 2_471_279.0, 0.0)) < 1e-3, "{through_proj:?}");
}

#[test]
fn convergence_in_utm_matches_the_formula_of_the_projection() {
    let point = GridPoint::new(205_494.0, 2_471_279.0, 0.0);
    let at = Crs::Epsg(32650).wgs84_from_grid(point).unwrap();
    let expected_rad = ((at.longitude_deg - 117.0).to_radians().tan() * at.latitude_deg.to_radians().sin()).atan();
    let found_rad = Crs::Epsg(32650).convergence_rad(point).unwrap();
    assert!((found_rad - expected_rad).abs() < 1e-5, "{found_rad} against {expected_rad}");
}

#[test]
fn a_code_that_is_not_projected_in_metres_is_refused_by_name() {
    let refuse = |code| Crs::Epsg(code).wgs84_from_grid(GridPoint::new(0.0, 0.0, 0.0)).unwrap_err();
    for (code, found) in [(4326, "GeographicCRS"), (2230, "US survey foot"), (7405, "CompoundCRS"), (999_999, "")] {
        let error = refuse(code);
        assert!(matches!(error, CrsError::NotProjected { .. }), "{error}");
        assert!(error.to_string().contains(found), "{error}");
        println!("{error}");
    }
}

#[test]
fn a_position_outside_the_area_of_use_is_refused() {
    let hong_kong = Wgs84 { latitude_deg: 22.3, longitude_deg: 114.2, ellipsoidal_height_m: 0.0 };
    let error = Crs::Epsg(2056).grid_from_wgs84(hong_kong).unwrap_err();
    assert!(matches!(error, CrsError::Wgs84Outside { .. }), "{error}");
    assert!(error.to_string().contains("for EPSG:2056, found latitude 22.3"), "{error}");
    let error = Crs::Epsg(2056).wgs84_from_grid(GridPoint::new(0.0, 0.0, 0.0)).unwrap_err();
    assert!(!error.to_string().is_empty());
    assert!(Crs::Epsg(2056).grid_from_wgs84(Wgs84 { latitude_deg: f64::NAN, ..hong_kong }).is_err());
}

#[test]
fn threads_convert_at_the_same_time_and_agree() {
    let point = GridPoint::new(2_600_000.0, 1_200_000.0, 0.0);
    let alone = Crs::Epsg(2056).wgs84_from_grid(point).unwrap();
    let threads: Vec<_> =
        (0..8).map(|_| std::thread::spawn(move || Crs::Epsg(2056).wgs84_from_grid(point).unwrap())).collect();
    for thread in threads {
        assert_eq!(thread.join().unwrap(), alone);
    }
}
