//! Tests of priors from every source.

mod exif;
mod ground;
mod nmea;
mod photos;
mod prior;
