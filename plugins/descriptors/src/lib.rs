//! Descriptor estimator: material rectangles and dynamic objects (Lee & Hsu, §3.9, Eq. 15–16, Alg. 1–3).
//!
//! [`estimator`] says what a region means; [`material`] measures rectangles on walls, [`dynamic`] objects on the ground,
//! [`removal`] names descriptors that are gone. What does not meet a requirement becomes a rejection with the measured
//! value beside its limit ([`requirement`]).
#![forbid(unsafe_code)]

pub mod contact;
pub mod crowd;
pub mod dynamic;
pub mod edges;
pub mod estimator;
pub mod evidence;
pub mod fit;
pub mod hull;
pub mod material;
pub mod outline;
pub mod paper;
pub mod plane;
pub mod quad;
pub mod rectangle;
pub mod removal;
pub mod requirement;
pub mod settings;
pub mod shape;
pub mod sight;
pub mod silhouette;
pub mod spread;
pub mod window;

pub use estimator::Descriptors;
pub use settings::Settings;

resurvey_plugin::export_estimator!(Descriptors);
