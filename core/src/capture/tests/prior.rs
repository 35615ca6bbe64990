//! What a prior is made of: `capture.json`, a fix, or both.

use crate::capture::fix::{GNSS_HEIGHT_SIGMA_M, SensedHeight};
use crate::capture::prior::{PriorInput, RoughHeight, RoughPrior, rough_prior};
use crate::capture::{CaptureError, Fix, Heading, North, PriorOrigin, SensedDatum};
use crate::crs::Crs;
use resurvey_schema::service::Prior;
use resurvey_schema::{PriorFile, Wgs84};
use std::f64::consts::PI;
use std::path::Path;

fn file() -> PriorFile {
    serde_json::from_str(
        r#"{"latitude":22.299139665,"longitude":114.17116039,"height":6.089,"height_datum":"hkpd",
            "yaw_deg":262.171,"pitch_deg":10.073,"roll_deg":0.679}"#,
    )
    .unwrap()
}

/// Nothing but pitch and roll.
fn tilt() -> PriorFile {
    serde_json::from_str(r#"{"pitch_deg":6.7,"roll_deg":0.9}"#).unwrap()
}

fn rough(file: &PriorFile, fix: Option<&Fix>) -> Result<RoughPrior, CaptureError> {
    let taken_at = Some("2026-06-01T10:28:00+08:00".parse().unwrap());
    let fix = fix.map(|fix| (fix, PriorOrigin::Photo));
    rough_prior(&PriorInput { file, fix, crs: Crs::Hk1980, taken_at, path: Path::new("capture.json") })
}

fn read(file: &PriorFile) -> Result<Prior, CaptureError> {
    rough(file, None).map(|rough| rough.prior)
}

/// In Tsim Sha Tsui, with nothing but a position.
const FIX: Fix = Fix {
    latitude_deg: 22.2977,
    longitude_deg: 114.1706,
    position_sigma_m: None,
    height: None,
    heading: None,
    taken_at: None,
};

fn heading(heading_deg: f64, north: North) -> Fix {
    Fix { heading: Some(Heading { heading_deg, north }), ..FIX }
}

#[test]
fn a_latitude_of_91_degrees_is_refused_by_name() {
    let message = read(&PriorFile { latitude: Some(91.0), ..file() }).unwrap_err().to_string();
    assert_eq!(message, "capture.json: prior.latitude is 91; expected -90 to 90 degrees");
}

#[test]
fn a_height_without_a_datum_is_refused_not_guessed() {
    let message = read(&PriorFile { height_datum: None, ..file() }).unwrap_err().to_string();
    assert!(message.contains("prior.height_datum is missing"), "{message}");
}

#[test]
fn half_a_position_is_refused() {
    assert!(read(&PriorFile { longitude: None, ..file() }).is_err());
    assert!(read(&PriorFile { easting: Some(835_600.0), northing: Some(817_800.0), ..file() }).is_err());
}

#[test]
fn grid_and_geographic_positions_and_both_heights_agree() {
    let from_wgs84 = read(&file()).unwrap().pose.position;
    let position = Crs::Hk1980.wgs84_from_grid(from_wgs84).unwrap();
    let ellipsoidal = |file: PriorFile| PriorFile {
        height: Some(position.ellipsoidal_height_m),
        height_datum: Some("ellipsoidal".to_owned()),
        ..file
    };
    let on_grid = PriorFile {
        latitude: None,
        longitude: None,
        easting: Some(from_wgs84.easting_m),
        northing: Some(from_wgs84.northing_m),
        ..file()
    };
    for other in [ellipsoidal(file()), on_grid.clone(), ellipsoidal(on_grid)] {
        let found = read(&other).unwrap().pose.position;
        assert!(found.plan_distance_m(&from_wgs84) < 1e-3 && (found.height_m - from_wgs84.height_m).abs() < 1e-3);
    }
}

#[test]
fn magnetic_north_needs_a_declination_and_true_north_the_convergence() {
    let north = |north: &str, declination_deg| PriorFile { north: Some(north.to_owned()), declination_deg, ..file() };
    assert!(read(&north("magnetic", None)).is_err());
    assert!(read(&north("up", None)).is_err());
    let grid = read(&north("grid", None)).unwrap();
    let by_true = read(&north("true", None)).unwrap();
    let convergence = Crs::Hk1980.convergence_rad(grid.pose.position).unwrap();
    assert!((grid.pose.yaw_rad - by_true.pose.yaw_rad - convergence).abs() < 1e-12);
    let magnetic = read(&north("magnetic", Some(-3.0))).unwrap();
    assert!((magnetic.pose.yaw_rad - by_true.pose.yaw_rad + 3_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn what_a_fix_says_wins_and_the_rest_is_from_the_capture() {
    let found = rough(&file(), Some(&Fix { position_sigma_m: Some(4.7), ..heading(90.0, North::True) })).unwrap();
    let Prior { pose, position_sigma_m, yaw_sigma_rad, .. } = found.prior;
    let expected = Crs::Hk1980.grid_from_latitude_longitude(22.2977, 114.1706, 6.089).unwrap();
    assert!(pose.position.plan_distance_m(&expected) < 1e-6);
    // The fix has no height, pitch or roll.
    assert!((pose.position.height_m - 6.089).abs() < 1e-6 && found.height == RoughHeight::Known);
    assert!((pose.pitch_rad.to_degrees() - 10.073).abs() < 1e-9 && (pose.roll_rad.to_degrees() - 0.679).abs() < 1e-9);
    assert!((position_sigma_m - 4.7).abs() < 1e-12 && (yaw_sigma_rad.to_degrees() - 20.0).abs() < 1e-9);
    assert_eq!(found.report.position_from, PriorOrigin::Photo);
    assert_eq!((found.report.height_from, found.report.heading_from), (PriorOrigin::Capture, Some(PriorOrigin::Photo)));
    let silent = rough(&file(), Some(&FIX)).unwrap();
    assert!((silent.prior.pose.yaw_rad.to_degrees() - 262.171).abs() < 1e-9);
    assert!((silent.prior.position_sigma_m - 15.0).abs() < 1e-12);
}

#[test]
fn a_sensed_heading_is_turned_to_grid_north() {
    let yaw_deg = |fix: &Fix, file: &PriorFile| rough(file, Some(fix)).unwrap().prior.pose.yaw_rad.to_degrees();
    let position = Crs::Hk1980.grid_from_latitude_longitude(22.2977, 114.1706, 0.0).unwrap();
    let convergence_deg = Crs::Hk1980.convergence_rad(position).unwrap().to_degrees();
    let by_true_deg = yaw_deg(&heading(90.0, North::True), &tilt());
    assert!((by_true_deg - 90.0 + convergence_deg).abs() < 1e-9);
    // Hong Kong's declination of 2026 by the World Magnetic Model is about 3.2° west.
    let by_model_deg = yaw_deg(&heading(90.0, North::Magnetic), &tilt());
    assert!((-3.6..-2.8).contains(&(by_model_deg - by_true_deg)), "{by_model_deg}");
    let stated = PriorFile { declination_deg: Some(-2.5), ..tilt() };
    assert!((yaw_deg(&heading(90.0, North::Magnetic), &stated) - by_true_deg + 2.5).abs() < 1e-9);
}

#[test]
fn a_magnetic_heading_without_a_date_asks_for_the_declination() {
    let (file, fix) = (tilt(), heading(90.0, North::Magnetic));
    let fix = Some((&fix, PriorOrigin::Nmea));
    let input = PriorInput { file: &file, fix, crs: Crs::Hk1980, taken_at: None, path: Path::new("capture.json") };
    let message = rough_prior(&input).unwrap_err().to_string();
    assert!(message.contains("prior.declination_deg is missing (no date)"), "{message}");
}

#[test]
fn a_heading_that_nobody_says_may_be_any() {
    for found in [rough(&tilt(), Some(&FIX)), rough(&PriorFile { yaw_deg: None, ..file() }, None)] {
        let found = found.unwrap();
        assert!((found.prior.yaw_sigma_rad - PI).abs() < 1e-12 && found.report.heading_from.is_none());
    }
}

#[test]
fn a_prior_without_a_position_says_what_may_give_one() {
    let message = read(&tilt()).unwrap_err().to_string();
    assert!(message.contains("prior is without a position") && message.contains("--nmea"), "{message}");
    assert!(message.contains("--photo"), "{message}");
}

#[test]
fn a_gnss_height_is_brought_to_the_datum_and_doubted() {
    let with = |height_m, datum, sigma_m| Fix { height: Some(SensedHeight { height_m, datum, sigma_m }), ..FIX };
    let position = Crs::Hk1980.grid_from_latitude_longitude(22.2977, 114.1706, 5.8).unwrap();
    let Wgs84 { ellipsoidal_height_m, .. } = Crs::Hk1980.wgs84_from_grid(position).unwrap();
    let loose = rough(&file(), Some(&with(ellipsoidal_height_m, SensedDatum::Ellipsoid, GNSS_HEIGHT_SIGMA_M))).unwrap();
    assert!((loose.prior.pose.position.height_m - 5.8).abs() < 1e-6);
    assert_eq!(
        (loose.height, loose.report.height_from),
        (RoughHeight::Loose { is_sea_level: false }, PriorOrigin::Photo)
    );
    let tight = rough(&file(), Some(&with(5.8, SensedDatum::SeaLevel, 0.1))).unwrap();
    assert!((tight.prior.pose.position.height_m - 5.8).abs() < 1e-6 && tight.height == RoughHeight::Known);
    assert!((tight.prior.height_sigma_m - 0.1).abs() < 1e-12);
    assert_eq!(rough(&tilt(), Some(&FIX)).unwrap().height, RoughHeight::Unknown);
}
