//! Ellipsoids of revolution and the step between geodetic and geocentric coordinates (EPSG method 9602).

/// An ellipsoid of revolution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ellipsoid {
    /// Equatorial radius, metres.
    pub(super) semi_major_m: f64,
    /// (a − b) / a.
    pub(super) flattening: f64,
}

/// International 1924 (EPSG:7022), under HK1980.
pub(super) const INTERNATIONAL_1924: Ellipsoid = Ellipsoid { semi_major_m: 6_378_388.0, flattening: 1.0 / 297.0 };

/// WGS 84 (EPSG:7030).
pub(super) const WGS_84: Ellipsoid = Ellipsoid { semi_major_m: 6_378_137.0, flattening: 1.0 / 298.257_223_563 };

/// Latitude and longitude in radians, height above the ellipsoid in metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Geodetic {
    pub(super) latitude_rad: f64,
    pub(super) longitude_rad: f64,
    pub(super) height_m: f64,
}

impl Ellipsoid {
    /// Square of the first eccentricity.
    pub(super) fn eccentricity_squared(&self) -> f64 {
        self.flattening * (2.0 - self.flattening)
    }

    /// Radius of curvature east–west, metres.
    pub(super) fn prime_vertical_radius_m(&self, latitude_rad: f64) -> f64 {
        self.semi_major_m / (1.0 - self.eccentricity_squared() * latitude_rad.sin().powi(2)).sqrt()
    }

    /// Radius of curvature north–south, metres.
    pub(super) fn meridian_radius_m(&self, latitude_rad: f64) -> f64 {
        let e2 = self.eccentricity_squared();
        self.semi_major_m * (1.0 - e2) / (1.0 - e2 * latitude_rad.sin().powi(2)).powf(1.5)
    }

    /// Geocentric X, Y, Z, metres.
    pub(super) fn geocentric(&self, at: Geodetic) -> [f64; 3] {
        let radius_m = self.prime_vertical_radius_m(at.latitude_rad);
        let (sin_latitude, cos_latitude) = at.latitude_rad.sin_cos();
        let (sin_longitude, cos_longitude) = at.longitude_rad.sin_cos();
        let across_m = (radius_m + at.height_m) * cos_latitude;
        [
            across_m * cos_longitude,
            across_m * sin_longitude,
            (radius_m * (1.0 - self.eccentricity_squared()) + at.height_m) * sin_latitude,
        ]
    }

    /// The inverse of [`Self::geocentric`] away from the poles: Bowring (1976), iterated on the reduced latitude.
    pub(super) fn geodetic(&self, [x, y, z]: [f64; 3]) -> Geodetic {
        // Bowring's first step is good to 1e-9 m near the surface; two more cost nothing and cover every height we take.
        const STEPS: usize = 3;
        let e2 = self.eccentricity_squared();
        let minor_m = self.semi_major_m * (1.0 - self.flattening);
        let second_e2 = e2 / (1.0 - e2);
        let across_m = x.hypot(y);
        let mut reduced = (z * self.semi_major_m).atan2(across_m * minor_m);
        let mut latitude_rad = reduced;
        for _ in 0..STEPS {
            let (sin, cos) = reduced.sin_cos();
            latitude_rad =
                (z + second_e2 * minor_m * sin.powi(3)).atan2(across_m - e2 * self.semi_major_m * cos.powi(3));
            reduced = ((1.0 - self.flattening) * latitude_rad.sin()).atan2(latitude_rad.cos());
        }
        let (sin, cos) = latitude_rad.sin_cos();
        let height_m =
            across_m * cos + z * sin - self.semi_major_m.powi(2) / self.prime_vertical_radius_m(latitude_rad);
        Geodetic { latitude_rad, longitude_rad: y.atan2(x), height_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geocentric_coordinates_match_the_worked_example_of_epsg_guidance_note_7_2() {
        // Method 9602: WGS 84, 53°48'33.820"N 2°07'46.380"E, 73.0 m.
        let at = Geodetic {
            latitude_rad: (53.0 + 48.0 / 60.0 + 33.820 / 3600.0_f64).to_radians(),
            longitude_rad: (2.0 + 7.0 / 60.0 + 46.380 / 3600.0_f64).to_radians(),
            height_m: 73.0,
        };
        let expected_m = [3_771_793.968, 140_253.342, 5_124_304.349];
        for (found, expected) in WGS_84.geocentric(at).into_iter().zip(expected_m) {
            assert!((found - expected).abs() < 1e-3, "{found} against {expected}");
        }
    }

    #[test]
    fn geodetic_undoes_geocentric_within_a_micrometre() {
        for height_m in [-1000.0, 0.0, 9000.0] {
            let at = Geodetic { latitude_rad: 0.39, longitude_rad: 1.99, height_m };
            let back = INTERNATIONAL_1924.geodetic(INTERNATIONAL_1924.geocentric(at));
            assert!((back.latitude_rad - at.latitude_rad).abs() < 1e-13);
            assert!((back.longitude_rad - at.longitude_rad).abs() < 1e-13);
            assert!((back.height_m - at.height_m).abs() < 1e-6);
        }
    }
}
