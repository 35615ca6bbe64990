//! Coordinate reference systems: HK1980 Grid with HKPD heights in closed form, every other EPSG code through PROJ.

pub use resurvey_schema::{GridPoint, Wgs84};
