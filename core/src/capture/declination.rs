//! Magnetic declination by the World Magnetic Model (NOAA and BGS, WMM2020 and WMM2025).

use jiff::Timestamp;
use jiff::tz::TimeZone;
use resurvey_schema::Wgs84;
use world_magnetic_model::GeomagneticField;
use world_magnetic_model::time::Date;
use world_magnetic_model::uom::si::angle::degree;
use world_magnetic_model::uom::si::f32::{Angle, Length};
use world_magnetic_model::uom::si::length::meter;

/// Angle from true to magnetic north, degrees, east positive; fails outside 2020 to 2029. The model is good to 0.4°
/// outside the polar regions.
pub fn declination_deg(position: Wgs84, time: Timestamp) -> Result<f64, String> {
    let day = time.to_zoned(TimeZone::UTC).date();
    let ordinal = day.day_of_year().unsigned_abs();
    let date = Date::from_ordinal_date(i32::from(day.year()), ordinal).map_err(|error| error.to_string())?;
    let field = GeomagneticField::new(
        Length::new::<meter>(position.ellipsoidal_height_m as f32),
        Angle::new::<degree>(position.latitude_deg as f32),
        Angle::new::<degree>(position.longitude_deg as f32),
        date,
    );
    let declination = field.map_err(|error| format!("{day}: {error}"))?.declination().get::<degree>();
    Ok(f64::from(declination))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NOAA, *WMM2025 test values*: date, height (m), latitude, longitude, declination; 2027.5 is the middle of the
    /// year.
    const NOAA: [(&str, f64, f64, f64, f64); 8] = [
        ("2025-01-01T00:00:00Z", 0.0, 80.0, 0.0, 1.28),
        ("2025-01-01T00:00:00Z", 0.0, 0.0, 120.0, -0.16),
        ("2025-01-01T00:00:00Z", 0.0, -80.0, 240.0, 68.78),
        ("2025-01-01T00:00:00Z", 100_000.0, 80.0, 0.0, 0.85),
        ("2025-01-01T00:00:00Z", 65_000.0, 43.0, 93.0, 0.50),
        ("2027-07-02T12:00:00Z", 0.0, 80.0, 0.0, 2.59),
        ("2027-07-02T12:00:00Z", 0.0, 0.0, 120.0, -0.24),
        ("2027-07-02T12:00:00Z", 0.0, -80.0, 240.0, 68.49),
    ];

    #[test]
    fn declination_is_that_of_the_published_test_values() {
        for (time, height_m, latitude_deg, longitude_deg, expected_deg) in NOAA {
            let longitude_deg = if longitude_deg > 180.0 { longitude_deg - 360.0 } else { longitude_deg };
            let position = Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m: height_m };
            let found_deg = declination_deg(position, time.parse().unwrap()).unwrap();
            // The table is rounded to 0.01°, the date to a day.
            assert!((found_deg - expected_deg).abs() < 0.011, "{time} {latitude_deg}: {found_deg}");
        }
    }

    #[test]
    fn declination_in_hong_kong_is_about_three_degrees_west() {
        let position = Wgs84 { latitude_deg: 22.3, longitude_deg: 114.17, ellipsoidal_height_m: 5.0 };
        let found_deg = declination_deg(position, "2026-06-01T02:28:00Z".parse().unwrap()).unwrap();
        assert!((-3.6..-2.8).contains(&found_deg), "{found_deg}");
        let message = declination_deg(position, "2031-01-01T00:00:00Z".parse().unwrap()).unwrap_err();
        assert!(message.contains("2029-12-31"), "{message}");
    }
}
