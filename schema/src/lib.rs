//! What two separately written parties must agree on: the vocabulary of the field, file formats, SQL, and the plugin
//! ABI. Nothing here computes.
#![forbid(unsafe_code)]

pub mod abi;
pub mod camera;
pub mod capture;
pub mod changes;
pub mod class;
pub mod descriptor;
pub mod localization;
pub mod position;
pub mod region;
pub mod service;
pub mod sql;
pub mod wire;

pub use camera::{CameraModel, Intrinsics};
pub use capture::{CameraFile, CaptureFile, PriorFile};
pub use class::{Class, ClassId, ClassKind, ClassTable};
pub use descriptor::{Descriptor, DynamicDescriptor, MaterialDescriptor, Uncertainty};
pub use localization::{Alignment, Localization, RunnerUp};
pub use position::{GridPoint, Pose, Wgs84};
pub use region::{ChangeRegion, PixelBox, Proposal, Rejection};
