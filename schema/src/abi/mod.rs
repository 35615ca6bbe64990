//! The plugin line, version 1: what stands in `schema/include/resurvey_plugin.h`, in Rust. The header has the prose; here
//! is one sentence each. `schema/tests/layout.rs` compares every size and offset of the two.
//!
//! Structs that begin with `size` may grow at their end (see [`Growing`]); all others are frozen. No bool, enum or
//! reference crosses; a missing function is a null pointer.

mod call;
mod declaration;
mod record;
mod result;
mod services;
mod table;

pub use call::{
    Camera, CompareRequest, Comparison, PanoramaRequest, Photo, Picture, PoseEstimate, Prior, RenderRequest, View,
};
pub use declaration::{Declaration, ENTRY_OFFSET, EntryFn, HEADER_BYTES, Header, MAGIC, SYMBOL_FAMILY, SYMBOL_PREFIX};
pub use record::{ClassRecord, Image, Labels, RayHit, Text};
pub use result::{Descriptor, Localization, Proposal, Region, Results};
pub use services::{FeatureReceiver, Services, Task, ViewReceiver};
pub use table::{ErrorText, HostInfo, Instance, Table};

/// Major version of the line: another one never loads.
pub const ABI_MAJOR: u16 = 1;
/// Minor version of the line: the host loads every minor of its major whose `min_host_minor` it reaches. 1 brought
/// segmenters.
pub const ABI_MINOR: u16 = 1;

/// What a function across the line returns.
pub type Status = i32;
/// The call did what it says.
pub const STATUS_OK: Status = 0;
/// There is no answer; the error text says why.
pub const STATUS_FAILED: Status = 1;
/// The callee panicked; the error text says where. The instance is not used again.
pub const STATUS_PANICKED: Status = 2;
/// The call ended early because the host asked for it.
pub const STATUS_CANCELLED: Status = 3;
/// The callee does not have this function, or not for these arguments.
pub const STATUS_UNSUPPORTED: Status = 4;

/// Number of a VPS matcher in [`Header::kind`].
pub const KIND_MATCHER: u16 = 1;
/// Number of a change detector.
pub const KIND_DETECTOR: u16 = 2;
/// Number of a descriptor estimator.
pub const KIND_ESTIMATOR: u16 = 3;
/// Number of a segmenter.
pub const KIND_SEGMENTER: u16 = 4;
/// Number kept for positioners: a better prior.
pub const KIND_POSITIONER: u16 = 5;

/// A struct whose first field is its size in bytes and whose all-zero value is valid. Each side copies the smaller of the
/// two sizes into a zeroed struct of its own, so that fields the other side does not know read as zero.
pub trait Growing: Copy + Default {
    /// The empty value, with `size` filled in.
    fn new() -> Self;
}

macro_rules! growing {
    ($($name:ty),* $(,)?) => {$(
        impl Growing for $name {
            fn new() -> Self {
                Self { size: size_of::<Self>() as u32, ..Self::default() }
            }
        }
    )*};
}

growing!(
    Camera,
    CompareRequest,
    Comparison,
    Descriptor,
    ErrorText,
    HostInfo,
    Localization,
    PanoramaRequest,
    Photo,
    Picture,
    PoseEstimate,
    Prior,
    Proposal,
    Region,
    RenderRequest,
    Results,
    Services,
    Table,
    View,
);
