//! What the host does for a plugin during a call. Every function may be called from any thread until the call returns.

use super::call::{CompareRequest, PanoramaRequest, RenderRequest, View};
use super::record::{ClassRecord, RayHit, Text};
use super::result::Descriptor;
use super::{ErrorText, Status};
use crate::position::{GridPoint, Pose, Wgs84};
use crate::service::ClassCounts;
use core::ffi::c_void;

/// Takes view `index`, which is lent for the length of this call.
pub type ViewReceiver = unsafe extern "C" fn(receiver: *mut c_void, index: usize, view: *const View);
/// Takes one descriptor of the map, lent for the length of this call.
pub type FeatureReceiver = unsafe extern "C" fn(receiver: *mut c_void, fid: u64, descriptor: *const Descriptor);
/// One item of a parallel loop.
pub type Task = unsafe extern "C" fn(task: *mut c_void, index: usize);

/// The table of services. A null function is a service that this host does not have. The first argument is always
/// `context`, the last one takes the text of an error and may be null.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Services {
    /// Bytes of this struct.
    pub size: u32,
    /// Counts per view in the two comparisons: one more than the highest class index of the map.
    pub class_slots: u32,
    /// Goes first into each function below.
    pub context: *mut c_void,
    /// The class table of the map, by rising index.
    pub classes: *const ClassRecord,
    /// Its length.
    pub class_count: usize,
    /// Hands one view per pose to the receiver, on this thread and in order.
    pub render: Option<
        unsafe extern "C" fn(
            *mut c_void,
            *const RenderRequest,
            poses: *const Pose,
            count: usize,
            receiver: *mut c_void,
            receive: Option<ViewReceiver>,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Fills `count × class_slots` counts.
    pub compare_views: Option<
        unsafe extern "C" fn(
            *mut c_void,
            *const CompareRequest,
            poses: *const Pose,
            count: usize,
            counts: *mut ClassCounts,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Fills `count × yaw_count × class_slots` counts.
    pub compare_panoramas: Option<
        unsafe extern "C" fn(
            *mut c_void,
            *const PanoramaRequest,
            positions: *const GridPoint,
            count: usize,
            counts: *mut ClassCounts,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Fills `count` bytes: 1 inside a solid building, 0 outside.
    pub inside_solid: Option<
        unsafe extern "C" fn(
            *mut c_void,
            positions: *const GridPoint,
            count: usize,
            inside: *mut u8,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Fills `count` unit directions for pixel coordinates u, v.
    pub pixel_rays: Option<
        unsafe extern "C" fn(
            *mut c_void,
            *const Pose,
            pixels: *const [f64; 2],
            count: usize,
            directions: *mut [f64; 3],
            *mut ErrorText,
        ) -> Status,
    >,
    /// Fills `count` pixel coordinates; NaN behind the camera or outside the model.
    pub project: Option<
        unsafe extern "C" fn(
            *mut c_void,
            *const Pose,
            points: *const GridPoint,
            count: usize,
            pixels: *mut [f64; 2],
            *mut ErrorText,
        ) -> Status,
    >,
    /// Fills `count` hits.
    pub cast_rays: Option<
        unsafe extern "C" fn(
            *mut c_void,
            origin: *const GridPoint,
            directions: *const [f64; 3],
            count: usize,
            limit_m: f64,
            with_descriptors: u32,
            hits: *mut RayHit,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Hands the descriptors near a point to the receiver, on this thread and by rising feature id.
    pub descriptors_near: Option<
        unsafe extern "C" fn(
            *mut c_void,
            *const GridPoint,
            radius_m: f64,
            receiver: *mut c_void,
            receive: Option<FeatureReceiver>,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Fills one height, metres; NaN when there is no ground below.
    pub ground_height:
        Option<unsafe extern "C" fn(*mut c_void, *const GridPoint, height_m: *mut f64, *mut ErrorText) -> Status>,
    /// Fills one grid position.
    pub grid_from_wgs84:
        Option<unsafe extern "C" fn(*mut c_void, *const Wgs84, point: *mut GridPoint, *mut ErrorText) -> Status>,
    /// Fills one WGS84 position.
    pub wgs84_from_grid:
        Option<unsafe extern "C" fn(*mut c_void, *const GridPoint, position: *mut Wgs84, *mut ErrorText) -> Status>,
    /// Runs `run(task, 0)…run(task, count - 1)` on the threads of the host and returns when all are done.
    pub parallel_for: Option<
        unsafe extern "C" fn(*mut c_void, count: usize, task: *mut c_void, run: Option<Task>, *mut ErrorText) -> Status,
    >,
    /// Writes a line to the log: 0 warning, 1 info, 2 debug.
    pub log: Option<unsafe extern "C" fn(*mut c_void, level: u32, text: Text)>,
    /// Tells how far the call is, 0–1.
    pub progress: Option<unsafe extern "C" fn(*mut c_void, fraction: f64)>,
    /// 1 when the call is to end; a plugin returns within 200 ms.
    pub cancelled: Option<unsafe extern "C" fn(*mut c_void) -> u32>,
}
