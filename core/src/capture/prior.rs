//! The phone's rough pose, checked and brought into the map frame.

use super::CaptureError;
use crate::crs::{Crs, CrsError};
use resurvey_schema::service::Prior;
use resurvey_schema::{GridPoint, Pose, PriorFile, Wgs84};
use std::path::Path;

/// 1σ of a phone's position in a street, metres, where the capture does not say: the paper's phone was off by 13 m in
/// the mean.
const POSITION_SIGMA_M: f64 = 15.0;
/// 1σ of a phone's compass between buildings, degrees: the paper's was off by up to 34°.
const YAW_SIGMA_DEG: f64 = 20.0;
/// 1σ of a height that was taken from the ground below, metres.
const HEIGHT_SIGMA_M: f64 = 0.5;
/// 1σ of a phone's pitch and roll from gravity, degrees.
const TILT_SIGMA_DEG: f64 = 1.0;

/// The prior in the frame of a map in `crs`; `path` is named in errors.
pub fn prior_from_file(file: &PriorFile, crs: Crs, path: &Path) -> Result<Prior, CaptureError> {
    let check = Check { path };
    let position = position(file, crs, &check)?;
    let pose = Pose {
        position,
        yaw_rad: yaw_rad(file, crs, position, &check)?,
        pitch_rad: check.within("prior.pitch_deg", file.pitch_deg, 90.0, "-90 to 90 degrees")?.to_radians(),
        roll_rad: check.within("prior.roll_deg", file.roll_deg, 180.0, "-180 to 180 degrees")?.to_radians(),
    };
    Ok(Prior {
        pose,
        position_sigma_m: check.sigma("prior.position_sigma_m", file.position_sigma_m, POSITION_SIGMA_M)?,
        height_sigma_m: check.sigma("prior.height_sigma_m", file.height_sigma_m, HEIGHT_SIGMA_M)?,
        yaw_sigma_rad: check.sigma("prior.yaw_sigma_deg", file.yaw_sigma_deg, YAW_SIGMA_DEG)?.to_radians(),
        tilt_sigma_rad: check.sigma("prior.tilt_sigma_deg", file.tilt_sigma_deg, TILT_SIGMA_DEG)?.to_radians(),
    })
}

fn position(file: &PriorFile, crs: Crs, check: &Check<'_>) -> Result<GridPoint, CaptureError> {
    let ellipsoidal = match file.height_datum.as_deref() {
        Some("hkpd") => false,
        Some("ellipsoidal") => true,
        other => {
            let found = other.map_or_else(|| "missing".to_owned(), |datum| format!("{datum:?}"));
            return Err(check.value("prior.height_datum", found, "\"hkpd\" or \"ellipsoidal\"; it is never guessed"));
        }
    };
    let height_m = check.within("prior.height", file.height, 10_000.0, "-10000 to 10000 m")?;
    let position = match (file.latitude, file.longitude, file.easting, file.northing) {
        (Some(latitude), Some(longitude), None, None) => {
            let latitude_deg = check.within("prior.latitude", latitude, 90.0, "-90 to 90 degrees")?;
            let longitude_deg = check.within("prior.longitude", longitude, 180.0, "-180 to 180 degrees")?;
            if ellipsoidal {
                crs.grid_from_wgs84(Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m: height_m })
            } else {
                crs.grid_from_latitude_longitude(latitude_deg, longitude_deg, height_m)
            }
        }
        (None, None, Some(easting), Some(northing)) => {
            let easting_m = check.within("prior.easting", easting, 1e8, "a finite number of metres")?;
            let northing_m = check.within("prior.northing", northing, 1e8, "a finite number of metres")?;
            on_the_grid(GridPoint::new(easting_m, northing_m, height_m), ellipsoidal, crs)
        }
        _ => {
            let found = "not one complete pair".to_owned();
            return Err(check.value("prior", found, "either latitude and longitude or easting and northing"));
        }
    };
    position.map_err(|source| CaptureError::Position { path: check.path.to_owned(), source })
}

/// The grid point whose height is either above the map's datum already or above the ellipsoid.
fn on_the_grid(point: GridPoint, ellipsoidal: bool, crs: Crs) -> Result<GridPoint, CrsError> {
    let separation_m = crs.wgs84_from_grid(point)?.ellipsoidal_height_m - point.height_m;
    let height_m = if ellipsoidal { point.height_m - separation_m } else { point.height_m };
    Ok(GridPoint { height_m, ..point })
}

fn yaw_rad(file: &PriorFile, crs: Crs, position: GridPoint, check: &Check<'_>) -> Result<f64, CaptureError> {
    let yaw_rad = check.within("prior.yaw_deg", file.yaw_deg, 720.0, "-720 to 720 degrees")?.to_radians();
    let convergence = || {
        crs.convergence_rad(position).map_err(|source| CaptureError::Position { path: check.path.to_owned(), source })
    };
    match (file.north.as_deref().unwrap_or("grid"), file.declination_deg) {
        ("grid", None) => Ok(yaw_rad),
        ("true", None) => Ok(yaw_rad - convergence()?),
        ("magnetic", Some(declination)) => {
            let declination_deg = check.within("prior.declination_deg", declination, 180.0, "-180 to 180 degrees")?;
            Ok(yaw_rad + declination_deg.to_radians() - convergence()?)
        }
        ("magnetic", None) => {
            let expected = "the magnetic declination in degrees east, because prior.north is \"magnetic\"";
            Err(check.value("prior.declination_deg", "missing".to_owned(), expected))
        }
        ("grid" | "true", Some(declination)) => {
            let expected = "no value, because prior.north is not \"magnetic\"";
            Err(check.value("prior.declination_deg", declination.to_string(), expected))
        }
        (other, _) => Err(check.value("prior.north", format!("{other:?}"), "\"grid\", \"true\" or \"magnetic\"")),
    }
}

struct Check<'a> {
    path: &'a Path,
}

impl Check<'_> {
    fn value(&self, key: &'static str, found: String, expected: &'static str) -> CaptureError {
        CaptureError::Value { path: self.path.to_owned(), key, found, expected }
    }

    /// `value` if it is finite and at most `limit` from zero.
    fn within(&self, key: &'static str, value: f64, limit: f64, expected: &'static str) -> Result<f64, CaptureError> {
        if value.is_finite() && value.abs() <= limit {
            Ok(value)
        } else {
            Err(self.value(key, value.to_string(), expected))
        }
    }

    fn sigma(&self, key: &'static str, value: Option<f64>, default: f64) -> Result<f64, CaptureError> {
        let value = value.unwrap_or(default);
        if value.is_finite() && (0.0..=1000.0).contains(&value) {
            Ok(value)
        } else {
            Err(self.value(key, value.to_string(), "0 to 1000"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> PriorFile {
        serde_json::from_str(
            r#"{"latitude":22.299139665,"longitude":114.17116039,"height":6.089,"height_datum":"hkpd",
                "yaw_deg":262.171,"pitch_deg":10.073,"roll_deg":0.679}"#,
        )
        .unwrap()
    }

    fn read(file: &PriorFile) -> Result<Prior, CaptureError> {
        prior_from_file(file, Crs::Hk1980, Path::new("capture.json"))
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
            height: position.ellipsoidal_height_m,
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
        let north =
            |north: &str, declination_deg| PriorFile { north: Some(north.to_owned()), declination_deg, ..file() };
        assert!(read(&north("magnetic", None)).is_err());
        assert!(read(&north("up", None)).is_err());
        let grid = read(&north("grid", None)).unwrap();
        let by_true = read(&north("true", None)).unwrap();
        let convergence = Crs::Hk1980.convergence_rad(grid.pose.position).unwrap();
        assert!((grid.pose.yaw_rad - by_true.pose.yaw_rad - convergence).abs() < 1e-12);
        let magnetic = read(&north("magnetic", Some(-3.0))).unwrap();
        assert!((magnetic.pose.yaw_rad - by_true.pose.yaw_rad + 3_f64.to_radians()).abs() < 1e-12);
    }
}
