//! HK1980 Grid (EPSG:2326) with HKPD heights (EPSG:5738) ⇄ WGS84, in closed form: Transverse Mercator on International
//! 1924 and the seven-parameter coordinate-frame rotation EPSG:1825, applied in 3D.

use super::ellipsoid::{Geodetic, INTERNATIONAL_1924, WGS_84};
use super::transverse_mercator::TransverseMercator;
use super::{GridPoint, Wgs84};

/// Positions that are taken: Hong Kong (easting 793–871 km, northing 799–850 km) and 13 to 20 km around it. Swapped
/// axes pass: nothing but types can catch them.
const EASTING_M: std::ops::RangeInclusive<f64> = 780_000.0..=890_000.0;
const NORTHING_M: std::ops::RangeInclusive<f64> = 780_000.0..=870_000.0;
const HEIGHT_M: std::ops::RangeInclusive<f64> = -1_000.0..=10_000.0;

/// The area of use in words.
pub(super) const AREA_OF_USE: &str = "easting 780000 to 890000 m, northing 780000 to 870000 m, height -1000 to 10000 m \
     (latitude 21.96 to 22.77, longitude 113.63 to 114.70)";

/// Angles of the datum origin and the false origin: Lands Department, "Explanatory Notes on Geodetic Datums in Hong Kong".
fn projection() -> TransverseMercator {
    TransverseMercator {
        ellipsoid: INTERNATIONAL_1924,
        latitude_of_origin_rad: (22.0 + 18.0 / 60.0 + 43.68 / 3600.0_f64).to_radians(),
        central_meridian_rad: (114.0 + 10.0 / 60.0 + 42.80 / 3600.0_f64).to_radians(),
        scale: 1.0,
        false_easting_m: 836_694.05,
        false_northing_m: 819_069.80,
    }
}

/// A coordinate-frame rotation (EPSG method 1032): x' = t + (1 + s)(x + x × r).
#[derive(Clone, Copy, Debug)]
struct FrameRotation {
    translation_m: [f64; 3],
    rotation_arcsec: [f64; 3],
    scale_ppm: f64,
}

/// EPSG:1825, HK1980 → WGS84.
const WGS84_FROM_HK1980: FrameRotation = FrameRotation {
    translation_m: [-162.619, -276.959, -161.764],
    rotation_arcsec: [-0.067753, 2.243648, 1.158828],
    scale_ppm: -1.094246,
};

impl FrameRotation {
    fn rotation_rad(&self) -> [f64; 3] {
        self.rotation_arcsec.map(|arcsec| (arcsec / 3600.0).to_radians())
    }

    fn apply(&self, x: [f64; 3]) -> [f64; 3] {
        let turned = cross(x, self.rotation_rad());
        let scale = 1.0 + self.scale_ppm * 1e-6;
        std::array::from_fn(|i| self.translation_m[i] + scale * (x[i] + turned[i]))
    }

    /// Exact inverse. Turning back by −r instead would miss by |r|²·R = 1 mm.
    fn undo(&self, y: [f64; 3]) -> [f64; 3] {
        let r = self.rotation_rad();
        let scale = 1.0 + self.scale_ppm * 1e-6;
        let b: [f64; 3] = std::array::from_fn(|i| (y[i] - self.translation_m[i]) / scale);
        let turned = cross(b, r);
        let along = dot(b, r);
        std::array::from_fn(|i| (b[i] - turned[i] + along * r[i]) / (1.0 + dot(r, r)))
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Whether `point` is finite and inside the area of use.
pub(super) fn is_in_area(point: GridPoint) -> bool {
    EASTING_M.contains(&point.easting_m) && NORTHING_M.contains(&point.northing_m) && HEIGHT_M.contains(&point.height_m)
}

/// Whether `position` is near enough to Hong Kong for [`grid_from_wgs84`] to mean anything.
pub(super) fn is_near(position: Wgs84) -> bool {
    (20.0..=25.0).contains(&position.latitude_deg)
        && (112.0..=117.0).contains(&position.longitude_deg)
        && position.ellipsoidal_height_m.abs() < 20_000.0
}

/// WGS84 position of a grid point.
pub(super) fn wgs84_from_grid(point: GridPoint) -> Wgs84 {
    let (latitude_rad, longitude_rad) = projection().unproject(point.easting_m, point.northing_m);
    let hk1980 = Geodetic { latitude_rad, longitude_rad, height_m: point.height_m };
    let wgs84 = WGS_84.geodetic(WGS84_FROM_HK1980.apply(INTERNATIONAL_1924.geocentric(hk1980)));
    Wgs84 {
        latitude_deg: wgs84.latitude_rad.to_degrees(),
        longitude_deg: wgs84.longitude_rad.to_degrees(),
        ellipsoidal_height_m: wgs84.height_m,
    }
}

/// Grid point of a WGS84 position.
pub(super) fn grid_from_wgs84(position: Wgs84) -> GridPoint {
    let wgs84 = Geodetic {
        latitude_rad: position.latitude_deg.to_radians(),
        longitude_rad: position.longitude_deg.to_radians(),
        height_m: position.ellipsoidal_height_m,
    };
    let hk1980 = INTERNATIONAL_1924.geodetic(WGS84_FROM_HK1980.undo(WGS_84.geocentric(wgs84)));
    let (easting_m, northing_m) = projection().project(hk1980.latitude_rad, hk1980.longitude_rad);
    GridPoint::new(easting_m, northing_m, hk1980.height_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lands Department transformation API v2: latitude, longitude, ellipsoidal height → easting, northing, HKPD.
    const GEODETIC_SURVEY: ([f64; 3], [f64; 3]) = ([22.32224, 114.14118, 23.128], [832_590.508, 820_358.910, 26.009]);

    /// Distance in plan between the department's grid point and what `hk1980_from_wgs84` makes of its WGS84 position.
    fn plan_error_m(hk1980_from_wgs84: impl Fn(Geodetic) -> Geodetic) -> f64 {
        let ([latitude_deg, longitude_deg, height_m], [easting_m, northing_m, _]) = GEODETIC_SURVEY;
        let wgs84 =
            Geodetic { latitude_rad: latitude_deg.to_radians(), longitude_rad: longitude_deg.to_radians(), height_m };
        let found = hk1980_from_wgs84(wgs84);
        let (east_m, north_m) = projection().project(found.latitude_rad, found.longitude_rad);
        (east_m - easting_m).hypot(north_m - northing_m)
    }

    fn rotation_error_m(rotation: FrameRotation) -> f64 {
        plan_error_m(|wgs84| INTERNATIONAL_1924.geodetic(rotation.undo(WGS_84.geocentric(wgs84))))
    }

    #[test]
    fn the_inverse_rotation_is_exact() {
        let x = [-2_413_000.0, 5_387_000.0, 2_405_000.0];
        let back = WGS84_FROM_HK1980.undo(WGS84_FROM_HK1980.apply(x));
        assert!((0..3).all(|i| (back[i] - x[i]).abs() < 1e-8), "{back:?}");
    }

    #[test]
    fn wrong_variants_of_the_datum_shift_stay_wrong() {
        let swapped_sign =
            FrameRotation { rotation_arcsec: WGS84_FROM_HK1980.rotation_arcsec.map(|r| -r), ..WGS84_FROM_HK1980 };
        let translation_only = FrameRotation { rotation_arcsec: [0.0; 3], scale_ppm: 0.0, ..WGS84_FROM_HK1980 };
        assert!(rotation_error_m(WGS84_FROM_HK1980) < 0.002);
        // 304 m, 55.8 m and 27.9 m on average over Hong Kong.
        let dropped_m = plan_error_m(|wgs84| wgs84);
        assert!((300.0..310.0).contains(&dropped_m), "no datum shift: {dropped_m} m");
        let swapped_m = rotation_error_m(swapped_sign);
        assert!((54.0..58.0).contains(&swapped_m), "position-vector sign: {swapped_m} m");
        let translated_m = rotation_error_m(translation_only);
        assert!((26.0..30.0).contains(&translated_m), "translation alone: {translated_m} m");
    }
}
