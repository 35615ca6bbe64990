//! Safe Rust SDK for resurvey plugins. Implement one of [`Scorer`], [`Searcher`], [`Detector`], [`Estimator`] and export
//! it with one macro call; the macro writes the unsafe part.

pub mod host;
pub mod image;
pub mod kinds;

pub use host::{ClassCounts, ClassSet, CompareRequest, Host, Level, PanoramaRequest, RayHit, ViewCounts};
pub use image::{Comparison, ImageRef, PoseEstimate, View, ViewFeature, ViewImages};
pub use kinds::{Detector, Error, Estimator, Photo, Plugin, Prior, Scorer, Searcher};
pub use resurvey_schema as schema;
