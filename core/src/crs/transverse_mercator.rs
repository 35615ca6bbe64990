//! Transverse Mercator by Krüger's series to n⁶ (Karney 2011, "Transverse Mercator with an accuracy of a few
//! nanometers", equations 7–12, 35 and 36).

use super::ellipsoid::Ellipsoid;

/// One Transverse Mercator projection.
#[derive(Clone, Copy, Debug)]
pub(super) struct TransverseMercator {
    pub(super) ellipsoid: Ellipsoid,
    pub(super) latitude_of_origin_rad: f64,
    pub(super) central_meridian_rad: f64,
    /// On the central meridian.
    pub(super) scale: f64,
    pub(super) false_easting_m: f64,
    pub(super) false_northing_m: f64,
}

impl TransverseMercator {
    /// Easting and northing, metres, of a latitude and longitude, radians.
    pub(super) fn project(&self, latitude_rad: f64, longitude_rad: f64) -> (f64, f64) {
        let (xi, eta) = self.rectify(latitude_rad, longitude_rad - self.central_meridian_rad);
        let radius_m = self.rectifying_radius_m();
        (self.false_easting_m + radius_m * eta, self.false_northing_m + radius_m * (xi - self.xi_of_origin()))
    }

    /// Latitude and longitude, radians, of an easting and northing, metres.
    pub(super) fn unproject(&self, easting_m: f64, northing_m: f64) -> (f64, f64) {
        let radius_m = self.rectifying_radius_m();
        let xi = (northing_m - self.false_northing_m) / radius_m + self.xi_of_origin();
        let eta = (easting_m - self.false_easting_m) / radius_m;
        let (mut conformal_xi, mut conformal_eta) = (xi, eta);
        for (beta, twice_j) in inverse_coefficients(self.third_flattening()).into_iter().zip(EVEN) {
            conformal_xi -= beta * (twice_j * xi).sin() * (twice_j * eta).cosh();
            conformal_eta -= beta * (twice_j * xi).cos() * (twice_j * eta).sinh();
        }
        let conformal_tan = conformal_xi.sin() / conformal_eta.sinh().hypot(conformal_xi.cos());
        let longitude_rad = conformal_eta.sinh().atan2(conformal_xi.cos());
        (self.geodetic_tan(conformal_tan).atan(), longitude_rad + self.central_meridian_rad)
    }

    fn xi_of_origin(&self) -> f64 {
        self.rectify(self.latitude_of_origin_rad, 0.0).0
    }

    fn rectify(&self, latitude_rad: f64, longitude_rad: f64) -> (f64, f64) {
        let conformal_tan = self.conformal_tan(latitude_rad.tan());
        let (sin, cos) = longitude_rad.sin_cos();
        let conformal_xi = conformal_tan.atan2(cos);
        let conformal_eta = (sin / conformal_tan.hypot(cos)).asinh();
        let (mut xi, mut eta) = (conformal_xi, conformal_eta);
        for (alpha, twice_j) in forward_coefficients(self.third_flattening()).into_iter().zip(EVEN) {
            xi += alpha * (twice_j * conformal_xi).sin() * (twice_j * conformal_eta).cosh();
            eta += alpha * (twice_j * conformal_xi).cos() * (twice_j * conformal_eta).sinh();
        }
        (xi, eta)
    }

    fn third_flattening(&self) -> f64 {
        self.ellipsoid.flattening / (2.0 - self.ellipsoid.flattening)
    }

    fn rectifying_radius_m(&self) -> f64 {
        let n2 = self.third_flattening().powi(2);
        let series = 1.0 + n2 / 4.0 + n2.powi(2) / 64.0 + n2.powi(3) / 256.0;
        self.scale * self.ellipsoid.semi_major_m / (1.0 + self.third_flattening()) * series
    }

    /// Tangent of the conformal latitude from that of the geodetic one.
    fn conformal_tan(&self, tan: f64) -> f64 {
        let eccentricity = self.ellipsoid.eccentricity_squared().sqrt();
        let sigma = (eccentricity * (eccentricity * tan / tan.hypot(1.0)).atanh()).sinh();
        tan * sigma.hypot(1.0) - sigma * tan.hypot(1.0)
    }

    /// The inverse of [`Self::conformal_tan`] by Newton's method.
    fn geodetic_tan(&self, conformal_tan: f64) -> f64 {
        // It converges quadratically from the spherical value: three steps reach the last bit, two more are a margin.
        const STEPS: usize = 5;
        let e2 = self.ellipsoid.eccentricity_squared();
        let mut tan = conformal_tan / (1.0 - e2);
        for _ in 0..STEPS {
            let found = self.conformal_tan(tan);
            let slope = (1.0 - e2) * found.hypot(1.0) * tan.hypot(1.0) / (1.0 + (1.0 - e2) * tan.powi(2));
            tan += (conformal_tan - found) / slope;
        }
        tan
    }
}

/// 2j for j = 1…6.
const EVEN: [f64; 6] = [2.0, 4.0, 6.0, 8.0, 10.0, 12.0];

/// α₁…α₆, Karney's equation 35.
fn forward_coefficients(n: f64) -> [f64; 6] {
    let [n2, n3, n4, n5, n6] = [n.powi(2), n.powi(3), n.powi(4), n.powi(5), n.powi(6)];
    [
        n / 2.0 - 2.0 / 3.0 * n2 + 5.0 / 16.0 * n3 + 41.0 / 180.0 * n4 - 127.0 / 288.0 * n5 + 7891.0 / 37800.0 * n6,
        13.0 / 48.0 * n2 - 3.0 / 5.0 * n3 + 557.0 / 1440.0 * n4 + 281.0 / 630.0 * n5 - 1_983_433.0 / 1_935_360.0 * n6,
        61.0 / 240.0 * n3 - 103.0 / 140.0 * n4 + 15061.0 / 26880.0 * n5 + 167_603.0 / 181_440.0 * n6,
        49561.0 / 161_280.0 * n4 - 179.0 / 168.0 * n5 + 6_601_661.0 / 7_257_600.0 * n6,
        34729.0 / 80640.0 * n5 - 3_418_889.0 / 1_995_840.0 * n6,
        212_378_941.0 / 319_334_400.0 * n6,
    ]
}

/// β₁…β₆, Karney's equation 36.
fn inverse_coefficients(n: f64) -> [f64; 6] {
    let [n2, n3, n4, n5, n6] = [n.powi(2), n.powi(3), n.powi(4), n.powi(5), n.powi(6)];
    [
        n / 2.0 - 2.0 / 3.0 * n2 + 37.0 / 96.0 * n3 - n4 / 360.0 - 81.0 / 512.0 * n5 + 96199.0 / 604_800.0 * n6,
        n2 / 48.0 + n3 / 15.0 - 437.0 / 1440.0 * n4 + 46.0 / 105.0 * n5 - 1_118_711.0 / 3_870_720.0 * n6,
        17.0 / 480.0 * n3 - 37.0 / 840.0 * n4 - 209.0 / 4480.0 * n5 + 5569.0 / 90720.0 * n6,
        4397.0 / 161_280.0 * n4 - 11.0 / 504.0 * n5 - 830_251.0 / 7_257_600.0 * n6,
        4583.0 / 161_280.0 * n5 - 108_847.0 / 3_991_680.0 * n6,
        20_648_693.0 / 638_668_800.0 * n6,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// British National Grid, the worked example of EPSG Guidance Note 7-2, method 9807.
    fn british_national_grid() -> TransverseMercator {
        TransverseMercator {
            ellipsoid: Ellipsoid { semi_major_m: 6_377_563.396, flattening: 1.0 / 299.324_96 },
            latitude_of_origin_rad: 49.0_f64.to_radians(),
            central_meridian_rad: -2.0_f64.to_radians(),
            scale: 0.999_601_3,
            false_easting_m: 400_000.0,
            false_northing_m: -100_000.0,
        }
    }

    #[test]
    fn the_worked_example_of_epsg_guidance_note_7_2_is_met_in_both_directions() {
        let grid = british_national_grid();
        let (easting_m, northing_m) = grid.project(50.5_f64.to_radians(), 0.5_f64.to_radians());
        assert!((easting_m - 577_274.99).abs() < 0.005, "{easting_m}");
        assert!((northing_m - 69_740.50).abs() < 0.005, "{northing_m}");
        let (xi, eta) = grid.rectify(50.5_f64.to_radians(), 2.5_f64.to_radians());
        assert!((xi - 0.879_395_617_1).abs() < 1e-10, "{xi}");
        assert!((eta - 0.027_854_260_3).abs() < 1e-10, "{eta}");
        let (latitude_rad, longitude_rad) = grid.unproject(easting_m, northing_m);
        assert!((latitude_rad.to_degrees() - 50.5).abs() < 1e-12);
        assert!((longitude_rad.to_degrees() - 0.5).abs() < 1e-12);
    }

    #[test]
    fn the_origin_lies_at_the_false_origin() {
        let grid = british_national_grid();
        let (easting_m, northing_m) = grid.project(grid.latitude_of_origin_rad, grid.central_meridian_rad);
        assert!((easting_m - 400_000.0).abs() < 1e-9 && (northing_m + 100_000.0).abs() < 1e-9);
    }
}
