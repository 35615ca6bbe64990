//! The host's services as a Rust trait, over the table of C functions.

use crate::borrow::{self, growing};
use crate::caught::{caught, forward};
use crate::host::Host;
use crate::image::{ImageRef, ViewImages};
use crate::kinds::Error;
use resurvey_schema::abi::{self, ErrorText, Growing, STATUS_OK, Status, Text};
use resurvey_schema::service::{ClassCounts, CompareRequest, Level, PanoramaRequest, RayHit, ViewCounts};
use resurvey_schema::{ClassId, ClassTable, Descriptor, GridPoint, Pose, Wgs84};
use std::ffi::c_void;
use std::sync::{Mutex, PoisonError};

/// Bytes for the text of a service's error.
const ERROR_BYTES: usize = 512;

/// The services of the call in progress.
pub(crate) struct AbiHost {
    services: abi::Services,
    classes: ClassTable,
}

// SAFETY: the header says that every service may be called from any thread during the call.
unsafe impl Sync for AbiHost {}

impl AbiHost {
    /// # Safety
    /// `services` is the table of a call that outlives the value.
    pub(crate) unsafe fn new(services: *const abi::Services) -> Result<Self, Error> {
        // SAFETY: the caller's promise.
        let services = unsafe { growing(services) }?;
        // SAFETY: the table lends its classes as long as itself.
        let classes = unsafe { borrow::classes(services.classes, services.class_count) }?;
        Ok(Self { services, classes })
    }

    fn context(&self) -> *mut c_void {
        self.services.context
    }

    fn slots(&self) -> usize {
        self.services.class_slots as usize
    }
}

/// Runs one service with a buffer for its error.
fn ask(body: impl FnOnce(*mut ErrorText) -> Status) -> Result<(), Error> {
    let mut bytes = [0; ERROR_BYTES];
    let mut error = ErrorText { capacity: ERROR_BYTES as u32, data: bytes.as_mut_ptr(), ..ErrorText::new() };
    let status = body(&raw mut error);
    if status == STATUS_OK {
        return Ok(());
    }
    let length = ERROR_BYTES.min(error.length as usize);
    Err(Error(String::from_utf8_lossy(&bytes[..length]).into_owned()))
}

/// The function of a service, or an error that names it.
fn service<F>(function: Option<F>, name: &str) -> Result<F, Error> {
    function.ok_or_else(|| Error(format!("this host has no service {name}")))
}

/// `count` zeroed counts from memory that is not touched yet: a search asks for 100 MB of them.
fn zeroed_counts(count: usize) -> Result<Vec<ClassCounts>, Error> {
    const WORDS: usize = size_of::<ClassCounts>() / size_of::<u32>();
    let words = count.checked_mul(WORDS).filter(|words| *words <= isize::MAX as usize / size_of::<u32>());
    let words = words.ok_or_else(|| Error(format!("{count} counts do not fit into memory")))?;
    let words = Box::into_raw(vec![0_u32; words].into_boxed_slice());
    // SAFETY: `ClassCounts` is seven `u32` in `repr(C)`: same alignment, same bytes, and the box has exactly
    // `count` of them.
    Ok(unsafe { Vec::from_raw_parts(words.cast::<ClassCounts>(), count, count) })
}

fn class_sets(request: &CompareRequest) -> ([u64; 4], [u64; 4]) {
    (request.ignored_in_photo.0, request.ignored_in_view.0)
}

/// Where the views of one rendering gather.
struct Views {
    views: Vec<ViewImages>,
    error: Option<Error>,
}

unsafe extern "C" fn take_view(receiver: *mut c_void, _index: usize, view: *const abi::View) {
    // SAFETY: the host hands our own receiver back, during the call of `render`, on its thread.
    let views = unsafe { &mut *receiver.cast::<Views>() };
    // SAFETY: the host lends the view for this call.
    match unsafe { copy_view(view) } {
        Ok(view) => views.views.push(view),
        Err(error) => views.error = Some(error),
    }
}

/// # Safety
/// The host lends `view`.
unsafe fn copy_view(view: *const abi::View) -> Result<ViewImages, Error> {
    // SAFETY: the caller's promise.
    let view = unsafe { borrow::view(view) }?;
    Ok(ViewImages {
        width: view.labels.width(),
        height: view.labels.height(),
        origin: view.origin,
        labels: copy(view.labels),
        range_m: copy(view.range_m),
        points: copy(view.points),
        features: copy(view.features),
        feature_table: view.feature_table.to_vec(),
    })
}

fn copy<T: Copy>(image: ImageRef<'_, T>) -> Vec<T> {
    (0..image.height()).flat_map(|v| image.row(v)).copied().collect()
}

/// Where the descriptors near a point gather.
struct Features {
    features: Vec<(u64, Descriptor)>,
    error: Option<Error>,
}

unsafe extern "C" fn take_feature(receiver: *mut c_void, fid: u64, descriptor: *const abi::Descriptor) {
    // SAFETY: as in `take_view`.
    let features = unsafe { &mut *receiver.cast::<Features>() };
    // SAFETY: the host lends the descriptor for this call.
    match unsafe { growing(descriptor) }.and_then(|descriptor| borrow::descriptor(&descriptor)) {
        Ok(descriptor) => features.features.push((fid, descriptor)),
        Err(error) => features.error = Some(error),
    }
}

/// One parallel loop: what to run, and the first panic.
struct Loop<'a> {
    task: &'a (dyn Fn(usize) + Sync),
    panic: Mutex<Option<String>>,
}

unsafe extern "C" fn run_task(task: *mut c_void, index: usize) {
    // SAFETY: the host hands our own loop back, during the call of `parallel_for`; it is only read.
    let this = unsafe { &*task.cast_const().cast::<Loop<'_>>() };
    if let Err(text) = caught(|| (this.task)(index)) {
        this.panic.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
    }
}

impl Host for AbiHost {
    fn classes(&self) -> &ClassTable {
        &self.classes
    }

    fn render(&self, stride: u32, with_descriptors: bool, poses: &[Pose]) -> Result<Vec<ViewImages>, Error> {
        let function = service(self.services.render, "render")?;
        let with_descriptors = u32::from(with_descriptors);
        let how = abi::RenderRequest { stride, with_descriptors, ..abi::RenderRequest::new() };
        let mut views = Views { views: Vec::with_capacity(poses.len()), error: None };
        let (receiver, receive) = ((&raw mut views).cast(), Some(take_view as abi::ViewReceiver));
        // SAFETY: the host's own function and context; everything lent lives until it returns. So in all services below.
        ask(|error| unsafe {
            function(self.context(), &raw const how, poses.as_ptr(), poses.len(), receiver, receive, error)
        })?;
        views.error.map_or(Ok(views.views), Err)
    }

    fn compare_views(&self, request: &CompareRequest, poses: &[Pose]) -> Result<Vec<ViewCounts>, Error> {
        let function = service(self.services.compare_views, "compare_views")?;
        let (ignored_in_photo, ignored_in_view) = class_sets(request);
        let how = abi::CompareRequest {
            stride: request.stride,
            ignored_in_photo,
            ignored_in_view,
            boundary_tolerance_px: request.boundary_tolerance_px,
            ..abi::CompareRequest::new()
        };
        let mut counts = zeroed_counts(poses.len().saturating_mul(self.slots()))?;
        let to = counts.as_mut_ptr();
        // SAFETY: as in `render`; `to` has room for one view per pose.
        ask(|error| unsafe { function(self.context(), &raw const how, poses.as_ptr(), poses.len(), to, error) })?;
        Ok((0..poses.len()).map(|pose| counts[pose * self.slots()..(pose + 1) * self.slots()].to_vec()).collect())
    }

    fn compare_panoramas(&self, request: &PanoramaRequest, positions: &[GridPoint]) -> Result<Vec<ClassCounts>, Error> {
        let function = service(self.services.compare_panoramas, "compare_panoramas")?;
        let how = abi::PanoramaRequest {
            columns: request.columns,
            yaw_step_columns: request.yaw_step_columns,
            yaw_count: request.yaw_count,
            first_yaw_rad: request.first_yaw_rad,
            pitch_rad: request.pitch_rad,
            roll_rad: request.roll_rad,
            ignored_in_photo: request.ignored_in_photo.0,
            ignored_in_view: request.ignored_in_view.0,
            ..abi::PanoramaRequest::new()
        };
        let headings = positions.len().saturating_mul(request.yaw_count as usize);
        let mut counts = zeroed_counts(headings.saturating_mul(self.slots()))?;
        let (from, to) = (positions.as_ptr(), counts.as_mut_ptr());
        // SAFETY: as in `render`; `to` has room for every position, heading and class.
        ask(|error| unsafe { function(self.context(), &raw const how, from, positions.len(), to, error) })?;
        Ok(counts)
    }

    fn inside_solid(&self, positions: &[GridPoint]) -> Result<Vec<bool>, Error> {
        let function = service(self.services.inside_solid, "inside_solid")?;
        let mut inside = vec![0; positions.len()];
        let (from, to) = (positions.as_ptr(), inside.as_mut_ptr());
        // SAFETY: as in `render`.
        ask(|error| unsafe { function(self.context(), from, positions.len(), to, error) })?;
        Ok(inside.into_iter().map(|inside: u8| inside != 0).collect())
    }

    fn pixel_rays(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, Error> {
        let function = service(self.services.pixel_rays, "pixel_rays")?;
        let mut directions = vec![[0.0; 3]; pixels.len()];
        let (from, to) = (pixels.as_ptr(), directions.as_mut_ptr());
        // SAFETY: as in `render`.
        ask(|error| unsafe { function(self.context(), pose, from, pixels.len(), to, error) })?;
        Ok(directions)
    }

    fn project(&self, pose: &Pose, points: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, Error> {
        let function = service(self.services.project, "project")?;
        let mut pixels = vec![[f64::NAN; 2]; points.len()];
        let (from, to) = (points.as_ptr(), pixels.as_mut_ptr());
        // SAFETY: as in `render`.
        ask(|error| unsafe { function(self.context(), pose, from, points.len(), to, error) })?;
        Ok(pixels.into_iter().map(|[u, v]| (u.is_finite() && v.is_finite()).then_some([u, v])).collect())
    }

    fn cast_rays(
        &self,
        origin: GridPoint,
        directions: &[[f64; 3]],
        limit_m: f64,
        with_descriptors: bool,
    ) -> Result<Vec<Option<RayHit>>, Error> {
        let function = service(self.services.cast_rays, "cast_rays")?;
        let mut hits = vec![abi::RayHit::MISS; directions.len()];
        let (from, to, with) = (directions.as_ptr(), hits.as_mut_ptr(), u32::from(with_descriptors));
        let count = directions.len();
        // SAFETY: as in `render`.
        ask(|error| unsafe { function(self.context(), &raw const origin, from, count, limit_m, with, to, error) })?;
        let hit = |hit: abi::RayHit| {
            (hit.hit != 0).then(|| RayHit {
                point: hit.point,
                range_m: hit.range_m,
                normal: hit.normal,
                class: ClassId(hit.class),
                fid: (hit.has_fid != 0).then_some(hit.fid),
            })
        };
        Ok(hits.into_iter().map(hit).collect())
    }

    fn descriptors_near(&self, point: GridPoint, radius_m: f64) -> Result<Vec<(u64, Descriptor)>, Error> {
        let function = service(self.services.descriptors_near, "descriptors_near")?;
        let mut features = Features { features: Vec::new(), error: None };
        let (receiver, receive) = ((&raw mut features).cast(), Some(take_feature as abi::FeatureReceiver));
        // SAFETY: as in `render`.
        ask(|error| unsafe { function(self.context(), &raw const point, radius_m, receiver, receive, error) })?;
        features.error.map_or(Ok(features.features), Err)
    }

    fn ground_height(&self, point: GridPoint) -> Result<Option<f64>, Error> {
        let function = service(self.services.ground_height, "ground_height")?;
        let mut height_m = f64::NAN;
        // SAFETY: as in `render`.
        ask(|error| unsafe { function(self.context(), &raw const point, &raw mut height_m, error) })?;
        Ok(height_m.is_finite().then_some(height_m))
    }

    fn grid_from_wgs84(&self, position: Wgs84) -> Result<GridPoint, Error> {
        let function = service(self.services.grid_from_wgs84, "grid_from_wgs84")?;
        let mut point = GridPoint::new(0.0, 0.0, 0.0);
        // SAFETY: as in `render`.
        ask(|error| unsafe { function(self.context(), &raw const position, &raw mut point, error) })?;
        Ok(point)
    }

    fn wgs84_from_grid(&self, point: GridPoint) -> Result<Wgs84, Error> {
        let function = service(self.services.wgs84_from_grid, "wgs84_from_grid")?;
        let mut position = Wgs84 { latitude_deg: 0.0, longitude_deg: 0.0, ellipsoidal_height_m: 0.0 };
        // SAFETY: as in `render`.
        ask(|error| unsafe { function(self.context(), &raw const point, &raw mut position, error) })?;
        Ok(position)
    }

    fn parallel_for(&self, count: usize, task: &(dyn Fn(usize) + Sync)) -> Result<(), Error> {
        let function = service(self.services.parallel_for, "parallel_for")?;
        let state = Loop { task, panic: Mutex::new(None) };
        let pointer = (&raw const state).cast_mut().cast();
        // SAFETY: as in `render`; the task may run on any thread because it is `Sync`.
        ask(|error| unsafe { function(self.context(), count, pointer, Some(run_task), error) })?;
        match state.panic.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some(text) => forward(text),
            None => Ok(()),
        }
    }

    fn log(&self, level: Level, text: &str) {
        let level = match level {
            Level::Warning => 0,
            Level::Info => 1,
            Level::Debug => 2,
        };
        if let Some(function) = self.services.log {
            // SAFETY: as in `render`.
            unsafe { function(self.context(), level, Text::of(text)) };
        }
    }

    fn progress(&self, fraction: f64) {
        if let Some(function) = self.services.progress {
            // SAFETY: as in `render`.
            unsafe { function(self.context(), fraction) };
        }
    }

    fn cancelled(&self) -> bool {
        // SAFETY: as in `render`.
        self.services.cancelled.is_some_and(|function| unsafe { function(self.context()) } != 0)
    }
}
