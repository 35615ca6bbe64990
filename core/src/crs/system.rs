//! The projected coordinate reference system of a map or a model.

use super::ellipsoid::WGS_84;
#[cfg(feature = "proj")]
use super::epsg;
use super::{GridPoint, Wgs84, hk1980};
use std::fmt;
use std::str::FromStr;

/// A projected coordinate reference system: eastings, northings and heights in metres. Coordinates are always in the
/// order E, N, H, whatever the register says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Crs {
    /// HK1980 Grid (EPSG:2326) with heights above HKPD (EPSG:5738).
    #[default]
    Hk1980,
    /// Any other projected EPSG code, through PROJ: feature `proj`. **2D**: heights pass through unchanged, so the
    /// system's own heights are taken for ellipsoidal ones.
    Epsg(u32),
}

/// Why a position has no counterpart.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CrsError {
    /// Not the name of a system.
    #[error("expected a coordinate reference system such as EPSG:2326, found {found:?}")]
    UnknownName {
        /// What was given.
        found: String,
    },
    /// A coordinate is NaN or infinite.
    #[error("expected finite coordinates, found {}, {}, {}", found[0], found[1], found[2])]
    NotFinite {
        /// The coordinates, in their own order.
        found: [f64; 3],
    },
    /// A grid point outside the area of use.
    #[error(
        "expected a grid point within {expected} for {crs}, found {:.3}, {:.3}, {:.3} (easting, northing, height)",
        found[0], found[1], found[2]
    )]
    GridOutside {
        /// The system.
        crs: Crs,
        /// E, N, H.
        found: [f64; 3],
        /// Area of use in words.
        expected: String,
    },
    /// A WGS84 position outside the area of use.
    #[error(
        "expected a position within {expected} for {crs}, found latitude {}, longitude {}, ellipsoidal height {} m",
        found[0], found[1], found[2]
    )]
    Wgs84Outside {
        /// The system.
        crs: Crs,
        /// Latitude and longitude, degrees, and ellipsoidal height, metres.
        found: [f64; 3],
        /// Area of use in words.
        expected: String,
    },
    /// A point too far from a local origin for `f32` offsets.
    #[error(
        "point {:.3}, {:.3}, {:.3} is {:.3} m from the local origin {:.3}, {:.3}, {:.3} along one axis; \
         the limit is {limit_m} m",
        point[0], point[1], point[2], largest_difference_m(*point, *origin), origin[0], origin[1], origin[2]
    )]
    TooFarFromOrigin {
        /// E, N, H of the point.
        point: [f64; 3],
        /// E, N, H of the origin.
        origin: [f64; 3],
        /// Largest offset along an axis, metres.
        limit_m: f64,
    },
    /// Another system than HK1980 Grid in a build without PROJ.
    #[error(
        "{crs} needs PROJ, which this build lacks: build with \"cargo build --features proj\", or use EPSG:2326 \
         (HK1980 Grid)"
    )]
    NeedsProj {
        /// The system.
        crs: Crs,
    },
    /// PROJ does not know the code, or the code is not a projected system in metres.
    #[error("expected {crs} to be a projected system in metres with east and north axes, found {found}")]
    NotProjected {
        /// The system.
        crs: Crs,
        /// What PROJ says about it.
        found: String,
    },
    /// PROJ has no conversion, or refused a position.
    #[error("PROJ has no WGS84 counterpart for {crs} at {:.6}, {:.6}: {reason}", at[0], at[1])]
    Proj {
        /// The system.
        crs: Crs,
        /// First and second coordinate given.
        at: [f64; 2],
        /// PROJ's message.
        reason: String,
    },
}

fn largest_difference_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, |largest, d| if d > largest || d.is_nan() { d } else { largest })
}

impl fmt::Display for Crs {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "EPSG:{}", self.code())
    }
}

impl FromStr for Crs {
    type Err = CrsError;

    /// Reads `EPSG:2326`; the authority in any case.
    fn from_str(name: &str) -> Result<Self, CrsError> {
        let unknown = || CrsError::UnknownName { found: name.to_owned() };
        let (authority, code) = name.trim().split_once(':').ok_or_else(unknown)?;
        if !authority.eq_ignore_ascii_case("EPSG") || !code.bytes().all(|byte| byte.is_ascii_digit()) {
            return Err(unknown());
        }
        match code.parse().map_err(|_| unknown())? {
            HK1980_CODE => Ok(Self::Hk1980),
            code => Ok(Self::Epsg(code)),
        }
    }
}

const HK1980_CODE: u32 = 2326;

impl Crs {
    /// EPSG code.
    pub fn code(self) -> u32 {
        match self {
            Self::Hk1980 => HK1980_CODE,
            Self::Epsg(code) => code,
        }
    }

    /// WGS84 position of a grid point; fails outside the area of use.
    pub fn wgs84_from_grid(self, point: GridPoint) -> Result<Wgs84, CrsError> {
        if !point.is_finite() {
            return Err(CrsError::NotFinite { found: point.into() });
        }
        match self {
            Self::Hk1980 if hk1980::is_in_area(point) => Ok(hk1980::wgs84_from_grid(point)),
            Self::Hk1980 => Err(self.grid_outside(point, hk1980::AREA_OF_USE.to_owned())),
            Self::Epsg(code) => wgs84_from_epsg(code, point),
        }
    }

    /// Grid point of a WGS84 position; fails outside the area of use.
    pub fn grid_from_wgs84(self, position: Wgs84) -> Result<GridPoint, CrsError> {
        if !coordinates(position).iter().all(|coordinate| coordinate.is_finite()) {
            return Err(CrsError::NotFinite { found: coordinates(position) });
        }
        match self {
            Self::Hk1980 if hk1980::is_near(position) => Some(hk1980::grid_from_wgs84(position))
                .filter(|point| hk1980::is_in_area(*point))
                .ok_or_else(|| self.wgs84_outside(position, hk1980::AREA_OF_USE.to_owned())),
            Self::Hk1980 => Err(self.wgs84_outside(position, hk1980::AREA_OF_USE.to_owned())),
            Self::Epsg(code) => epsg_from_wgs84(code, position),
        }
    }

    /// Grid point at a WGS84 latitude and longitude, degrees, whose height above the map's vertical datum is known.
    pub fn grid_from_latitude_longitude(
        self,
        latitude_deg: f64,
        longitude_deg: f64,
        height_m: f64,
    ) -> Result<GridPoint, CrsError> {
        let at =
            |ellipsoidal_height_m| self.grid_from_wgs84(Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m });
        // The two heights differ by a few metres and almost the same few metres everywhere: one correction reaches 1 µm.
        let separation_m = at(height_m)?.height_m - height_m;
        Ok(GridPoint { height_m, ..at(height_m - separation_m)? })
    }

    /// Point of this system at the plan position of a point of `source`, through WGS84. The **height is kept** as it
    /// is: a model's heights are trusted to be above this map's vertical datum.
    pub fn grid_from_other(self, source: Self, point: GridPoint) -> Result<GridPoint, CrsError> {
        if self == source {
            return self.wgs84_from_grid(point).map(|_| point);
        }
        Ok(GridPoint { height_m: point.height_m, ..self.grid_from_wgs84(source.wgs84_from_grid(point)?)? })
    }

    /// Grid convergence at `point`: the angle from true (WGS84) north to grid north, radians, positive where grid
    /// north lies clockwise (east) of true north. `yaw_grid = yaw_true − convergence`.
    pub fn convergence_rad(self, point: GridPoint) -> Result<f64, CrsError> {
        // Central difference along grid north: 100 m are straight to 1e-10 rad and far above rounding.
        const REACH_M: f64 = 50.0;
        let middle = self.wgs84_from_grid(point)?;
        let at = |north_m| {
            let moved = GridPoint { northing_m: point.northing_m + north_m, ..point };
            match self {
                Self::Hk1980 => Ok(hk1980::wgs84_from_grid(moved)),
                Self::Epsg(_) => self.wgs84_from_grid(moved),
            }
        };
        let (south, north) = (at(-REACH_M)?, at(REACH_M)?);
        let latitude_rad = middle.latitude_deg.to_radians();
        let turn_deg = (north.longitude_deg - south.longitude_deg + 180.0).rem_euclid(360.0) - 180.0;
        let east_m = turn_deg.to_radians() * WGS_84.prime_vertical_radius_m(latitude_rad) * latitude_rad.cos();
        let north_m = (north.latitude_deg - south.latitude_deg).to_radians() * WGS_84.meridian_radius_m(latitude_rad);
        Ok(east_m.atan2(north_m))
    }

    pub(super) fn grid_outside(self, point: GridPoint, expected: String) -> CrsError {
        CrsError::GridOutside { crs: self, found: point.into(), expected }
    }

    pub(super) fn wgs84_outside(self, position: Wgs84, expected: String) -> CrsError {
        CrsError::Wgs84Outside { crs: self, found: coordinates(position), expected }
    }
}

fn coordinates(position: Wgs84) -> [f64; 3] {
    [position.latitude_deg, position.longitude_deg, position.ellipsoidal_height_m]
}

#[cfg(feature = "proj")]
fn wgs84_from_epsg(code: u32, point: GridPoint) -> Result<Wgs84, CrsError> {
    epsg::wgs84_from_grid(code, point)
}

#[cfg(feature = "proj")]
fn epsg_from_wgs84(code: u32, position: Wgs84) -> Result<GridPoint, CrsError> {
    epsg::grid_from_wgs84(code, position)
}

#[cfg(not(feature = "proj"))]
fn wgs84_from_epsg(code: u32, _: GridPoint) -> Result<Wgs84, CrsError> {
    Err(CrsError::NeedsProj { crs: Crs::Epsg(code) })
}

#[cfg(not(feature = "proj"))]
fn epsg_from_wgs84(code: u32, _: Wgs84) -> Result<GridPoint, CrsError> {
    Err(CrsError::NeedsProj { crs: Crs::Epsg(code) })
}
