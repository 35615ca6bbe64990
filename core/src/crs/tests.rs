//! The survey office's vectors, round trips, refusals and convergence through the public door.

use super::{Crs, CrsError, GridPoint, Wgs84};
use proptest::prelude::*;
use std::path::PathBuf;

/// Published values retyped from the Lands Department's transformation tool and API (source; easting, northing;
/// latitude, longitude) so that a fresh clone tests something.
const PUBLISHED: [(&str, [f64; 2], [f64; 2]); 4] = [
    ("tool, station HKSC", [832_591.320, 820_351.389], [22.322_172_084, 114.141_187_917]),
    ("API v2", [835_411.431, 817_266.016], [22.294_313_001, 114.168_562_005]),
    ("API v2", [813_259.7, 818_940.16], [22.309_278_113, 113.953_573_028]),
    ("tool of 2013, from siuying/hk_geo", [841_123.667, 818_587.958], [22.306_244_332, 114.223_998_898]),
];

fn shared() -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared"));
    let named = std::env::var_os("RESURVEY_SHARED").map(PathBuf::from);
    [named, Some(beside)].into_iter().flatten().find(|directory| directory.is_dir())
}

fn degrees_to_metres(a: Wgs84, b: Wgs84) -> f64 {
    let metres_per_degree = 111_000.0;
    let east = (a.longitude_deg - b.longitude_deg) * metres_per_degree * a.latitude_deg.to_radians().cos();
    east.hypot((a.latitude_deg - b.latitude_deg) * metres_per_degree)
}

fn position(latitude_deg: f64, longitude_deg: f64, ellipsoidal_height_m: f64) -> Wgs84 {
    Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m }
}

#[test]
fn published_positions_of_the_lands_department_are_met_within_5_mm() {
    for (source, [easting_m, northing_m], [latitude_deg, longitude_deg]) in PUBLISHED {
        let found = Crs::Hk1980.wgs84_from_grid(GridPoint::new(easting_m, northing_m, 0.0)).unwrap();
        let error_m = degrees_to_metres(found, position(latitude_deg, longitude_deg, 0.0));
        assert!(error_m < 0.005, "{source}: {:.1} mm", error_m * 1e3);
    }
}

/// One row of `hk1980_vectors.csv`; the source may hold commas inside quotes.
fn fields(line: &str) -> Vec<&str> {
    let rest = line
        .strip_prefix('"')
        .and_then(|quoted| quoted.split_once("\","))
        .map_or_else(|| line.split_once(',').map_or("", |(_, rest)| rest), |(_, rest)| rest);
    rest.split(',').collect()
}

#[test]
fn every_vector_of_the_shared_table_is_met_within_its_own_tolerance() {
    let Some(path) = shared().map(|directory| directory.join("data/crs/hk1980_vectors.csv")) else {
        eprintln!("SKIPPED: no shared directory; set RESURVEY_SHARED to test against hk1980_vectors.csv");
        return;
    };
    let table = std::fs::read_to_string(&path).unwrap();
    let mut rows = 0;
    for line in table.lines().skip(1) {
        let fields = fields(line);
        let number = |column: usize| fields[column].parse::<f64>().ok();
        let known = |column: usize| number(column).unwrap();
        let (direction, tolerance_m) = (fields[0], known(7));
        let error_m = match direction {
            "fwd" => {
                let height_m = number(5);
                let at = position(known(3), known(4), height_m.unwrap_or(0.0));
                let found = Crs::Hk1980.grid_from_wgs84(at).unwrap();
                found.plan_distance_m(&GridPoint::new(known(1), known(2), 0.0))
            }
            "inv" => {
                let at = GridPoint::new(known(1), known(2), number(6).unwrap_or(0.0));
                let found = Crs::Hk1980.wgs84_from_grid(at).unwrap();
                degrees_to_metres(found, position(known(3), known(4), 0.0))
            }
            "height" => {
                let found = Crs::Hk1980.grid_from_wgs84(position(known(3), known(4), known(5))).unwrap();
                (found.height_m - known(6)).abs()
            }
            other => panic!("unknown direction {other:?}"),
        };
        println!("{direction} {:.2} mm of {:.0} mm: {line}", error_m * 1e3, tolerance_m * 1e3);
        assert!(error_m <= tolerance_m, "{:.2} mm: {line}", error_m * 1e3);
        rows += 1;
    }
    assert_eq!(rows, 19);
}

proptest! {
    #[test]
    fn a_round_trip_over_hong_kong_returns_within_a_millimetre(
        easting_m in 793_000.0..871_000.0,
        northing_m in 799_000.0..850_000.0,
        height_m in -50.0..1000.0,
    ) {
        let point = GridPoint::new(easting_m, northing_m, height_m);
        let back = Crs::Hk1980.grid_from_wgs84(Crs::Hk1980.wgs84_from_grid(point).unwrap()).unwrap();
        prop_assert!(back.plan_distance_m(&point) < 1e-3);
        prop_assert!((back.height_m - height_m).abs() < 1e-3);
    }

    #[test]
    fn a_known_height_is_kept_and_leaves_the_plan_position_alone(
        easting_m in 793_000.0..871_000.0,
        northing_m in 799_000.0..850_000.0,
        height_m in -50.0..1000.0,
    ) {
        let point = GridPoint::new(easting_m, northing_m, height_m);
        let at = Crs::Hk1980.wgs84_from_grid(point).unwrap();
        let found =
            Crs::Hk1980.grid_from_latitude_longitude(at.latitude_deg, at.longitude_deg, height_m).unwrap();
        prop_assert!(found.plan_distance_m(&point) < 1e-5);
        prop_assert!((found.height_m - height_m).abs() < 1e-9);
    }

    #[test]
    fn no_number_makes_it_panic(a in any::<f64>(), b in any::<f64>(), c in any::<f64>()) {
        let _ = Crs::Hk1980.wgs84_from_grid(GridPoint::new(a, b, c));
        let _ = Crs::Hk1980.grid_from_wgs84(position(a, b, c));
        let _ = Crs::Hk1980.convergence_rad(GridPoint::new(a, b, c));
        let _ = Crs::Hk1980.grid_from_latitude_longitude(a, b, c);
    }

    #[test]
    fn no_name_makes_it_panic(name in ".*") {
        let _ = name.parse::<Crs>();
        let _ = format!("EPSG:{name}").parse::<Crs>();
    }
}

#[test]
fn letting_height_pass_through_would_cost_metres() {
    // Lands Department transformation API v2: 23.128 m above the ellipsoid are 26.009 m above HKPD; the 3D transform is
    // within 0.17 m of the department everywhere (conventions, "Frames").
    let found = Crs::Hk1980.grid_from_wgs84(position(22.322_24, 114.141_18, 23.128)).unwrap();
    assert!((found.height_m - 26.009).abs() < 0.17, "{}", found.height_m);
    assert!((found.height_m - 23.128).abs() > 2.0);
}

#[test]
fn positions_outside_hong_kong_are_refused_with_what_was_found_and_expected() {
    let refuse = |latitude_deg, longitude_deg| {
        Crs::Hk1980.grid_from_wgs84(position(latitude_deg, longitude_deg, 0.0)).unwrap_err().to_string()
    };
    assert_eq!(
        refuse(91.0, 114.0),
        "expected a position within easting 780000 to 890000 m, northing 780000 to 870000 m, height -1000 to 10000 m \
         (latitude 21.96 to 22.77, longitude 113.63 to 114.70) for EPSG:2326, found latitude 91, longitude 114, \
         ellipsoidal height 0 m"
    );
    assert!(refuse(22.3, 115.2).contains("found latitude 22.3, longitude 115.2"));
    assert!(refuse(f64::NAN, 114.0).contains("expected finite coordinates, found NaN"));
    let grid = Crs::Hk1980.wgs84_from_grid(GridPoint::new(500_000.0, 819_000.0, 0.0)).unwrap_err();
    assert!(grid.to_string().contains("found 500000.000, 819000.000, 0.000"), "{grid}");
}

#[test]
fn names_are_read_and_written_as_the_register_has_them() {
    assert_eq!("EPSG:2326".parse(), Ok(Crs::Hk1980));
    assert_eq!(" epsg:2056 ".parse(), Ok(Crs::Epsg(2056)));
    assert_eq!(Crs::Epsg(2056).to_string(), "EPSG:2056");
    for name in ["", "2326", "EPSG:", "EPSG:+2326", "EPSG:99999999999", "ESRI:2326", "EPSG:2326 "[..4].trim()] {
        assert_eq!(name.parse::<Crs>(), Err(CrsError::UnknownName { found: name.to_owned() }));
    }
}

#[test]
fn grid_north_lies_clockwise_of_true_north_east_of_the_central_meridian() {
    // tan γ = tan Δλ · sin φ (Gauss–Krüger on the sphere), which the ellipsoid changes by less than 1e-6 rad here; the
    // turn between the two datums adds 3e-5 rad (6″).
    for (easting_m, northing_m) in [(836_694.05, 819_069.80), (860_000.0, 840_000.0), (800_000.0, 805_000.0)] {
        let point = GridPoint::new(easting_m, northing_m, 10.0);
        let at = Crs::Hk1980.wgs84_from_grid(point).unwrap();
        let off_meridian_rad = (at.longitude_deg - 114.178_556 - 8.8 / 3600.0).to_radians();
        let expected_rad = (off_meridian_rad.tan() * at.latitude_deg.to_radians().sin()).atan();
        let found_rad = Crs::Hk1980.convergence_rad(point).unwrap();
        assert!((found_rad - expected_rad).abs() < 4e-5, "{found_rad} against {expected_rad}");
        assert!(easting_m < 836_695.0 || found_rad > 1e-3);
    }
}

#[cfg(not(feature = "proj"))]
#[test]
fn another_system_without_proj_says_how_to_get_it() {
    let error = Crs::Epsg(2056).wgs84_from_grid(GridPoint::new(2_600_000.0, 1_200_000.0, 0.0)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "EPSG:2056 needs PROJ, which this build lacks: build with \"cargo build --features proj\", or use EPSG:2326 \
         (HK1980 Grid)"
    );
}
