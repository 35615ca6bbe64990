//! Safe Rust SDK for resurvey plugins. Implement one of [`Scorer`], [`Searcher`], [`Detector`], [`Estimator`],
//! [`Segmenter`] and export it with one macro call; the macro writes the unsafe part, and `#![forbid(unsafe_code)]` still holds in the plugin.

#[cfg(panic = "abort")]
compile_error!(
    "a plugin must unwind: with panic = \"abort\" one panic of the plugin would end the host. Remove it from the profile."
);

mod abi_host;
mod borrow;
mod call;
mod caught;
pub mod class_list;
mod deliver;
#[doc(hidden)]
pub mod export;
pub mod host;
pub mod image;
pub mod kinds;
pub mod score;
pub mod toy;

pub use class_list::ClassList;
pub use host::Host;
pub use image::{Comparison, ImageRef, View, ViewImages};
pub use kinds::{Detector, Error, Estimator, Photo, Plugin, Scorer, Searcher, Segmenter};
pub use resurvey_schema as schema;
pub use resurvey_schema::service::{
    ClassCounts, ClassSet, CompareRequest, Level, PanoramaRequest, PoseEstimate, Prior, RayHit, ViewCounts, ViewFeature,
};

/// The code of the guide, compiled.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/plugin-guide.md")]
mod guide {}
