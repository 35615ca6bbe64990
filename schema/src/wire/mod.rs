//! The plugin wire, version 1: what host and plugin say when the plugin runs in a process of its own. Each line is one JSON
//! object with one key, the name of the message; arrays lie in shared memory. `docs/plugin-wire.md` has the prose.

mod answer;
mod array;
mod call;
mod message;
mod request;

pub use answer::{
    WireAlignment, WireDescriptor, WireLocalization, WireProposal, WireRegion, WireRejection, WireRunnerUp,
};
pub use array::{Array, Dtype, Number};
pub use call::{
    DetectCall, EstimateCall, ScoreCall, Scratch, SearchCall, SegmentCall, WireCamera, WireEstimate, WirePrior,
    WireViews,
};
pub use message::{Hello, Invalid, Refused, ToHost, ToPlugin};
pub use request::{
    CastRaysRequest, ComparePanoramasRequest, CompareViewsRequest, NearFeature, PixelRaysRequest, PointsRequest,
    ProjectRequest, RenderRequest, Served,
};

/// Version of the wire: the number in `hello`.
pub const WIRE_VERSION: u32 = 1;
/// Longest line of a plugin in bytes, with its end.
pub const LONGEST_LINE: usize = 1 << 20;
/// What the declaration in an executable plugin begins with; a JSON object follows on the same line.
pub const DECLARATION: &str = "resurvey-plugin: ";
/// What the file name of an executable plugin begins with.
pub const EXECUTABLE_PREFIX: &str = "resurvey-plugin-";

/// Bytes at the start of the shared memory that hold no arrays.
pub const MEMORY_HEADER: usize = 4096;
/// The first eight bytes of the shared memory.
pub const MEMORY_MAGIC: [u8; 8] = *b"RSVWIRE1";
/// Where the byte lies that the host sets to 1 when the call is to end.
pub const CANCEL_AT: usize = 8;
/// Where the `u32` lies that the plugin raises with every view it has scored.
pub const SCORED_AT: usize = 16;
