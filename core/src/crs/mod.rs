//! Coordinate reference systems: HK1980 Grid with HKPD heights in closed form, every other EPSG code through PROJ.

mod ellipsoid;
#[cfg(feature = "proj")]
mod epsg;
mod hk1980;
mod local;
mod system;
mod transverse_mercator;

pub use local::{LOCAL_LIMIT_M, LocalOrigin};
pub use resurvey_schema::{GridPoint, Wgs84};
pub use system::{Crs, CrsError};

#[cfg(test)]
#[cfg(feature = "proj")]
mod proj_tests;
#[cfg(test)]
mod tests;
