//! The services of a call as a table of C functions.
#![allow(unsafe_code)]

use super::lend::{self, read_growing, slice, slice_mut};
use super::services::{
    SERVICE_PANICKED, ServiceError, Services, class_slots, finite, finite_points, finite_poses, some_columns,
    some_stride,
};
use resurvey_schema::abi::{
    self, ErrorText, FeatureReceiver, Growing, STATUS_FAILED, STATUS_OK, Status, Task, Text, ViewReceiver,
};
use resurvey_schema::service::{ClassCounts, ClassSet, CompareRequest, Level, PanoramaRequest};
use resurvey_schema::{GridPoint, Pose, Wgs84};
use std::ffi::c_void;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What the context of the table points to.
pub(super) struct ServiceTable<'a> {
    services: &'a dyn Services,
    classes: Vec<abi::ClassRecord>,
    class_slots: usize,
}

impl<'a> ServiceTable<'a> {
    pub(super) fn new(services: &'a dyn Services) -> Self {
        let classes = services.classes();
        Self { services, classes: lend::classes(classes), class_slots: class_slots(classes) }
    }

    /// The table, valid as long as `self` is not moved or dropped.
    pub(super) fn table(&self) -> abi::Services {
        abi::Services {
            class_slots: self.class_slots as u32,
            context: std::ptr::from_ref(self).cast_mut().cast(),
            classes: self.classes.as_ptr(),
            class_count: self.classes.len(),
            render: Some(render),
            compare_views: Some(compare_views),
            compare_panoramas: Some(compare_panoramas),
            inside_solid: Some(inside_solid),
            pixel_rays: Some(pixel_rays),
            project: Some(project),
            cast_rays: Some(cast_rays),
            descriptors_near: Some(descriptors_near),
            ground_height: Some(ground_height),
            grid_from_wgs84: Some(grid_from_wgs84),
            wgs84_from_grid: Some(wgs84_from_grid),
            parallel_for: Some(parallel_for),
            log: Some(log),
            progress: Some(progress),
            cancelled: Some(cancelled),
            ..abi::Services::new()
        }
    }
}

type Served = Result<(), ServiceError>;

fn wrong<T>(what: &str) -> Result<T, ServiceError> {
    Err(ServiceError(what.to_owned()))
}

/// Runs a service; an error or a panic becomes a status and a text, because neither may cross the line.
///
/// # Safety
/// `context` is the one of a living [`ServiceTable`]; `error` is null or a buffer of the plugin.
unsafe fn serve(context: *mut c_void, error: *mut ErrorText, body: impl FnOnce(&ServiceTable<'_>) -> Served) -> Status {
    // SAFETY: the caller's promise.
    let table = unsafe { &*context.cast_const().cast::<ServiceTable<'_>>() };
    let text = match catch_unwind(AssertUnwindSafe(|| body(table))) {
        Ok(Ok(())) => return STATUS_OK,
        Ok(Err(ServiceError(text))) => text,
        Err(_) => SERVICE_PANICKED.to_owned(),
    };
    // SAFETY: the caller's promise.
    unsafe { write_error(error, &text) };
    STATUS_FAILED
}

/// # Safety
/// `error` is null or points to an [`ErrorText`] of the plugin with a writable buffer.
unsafe fn write_error(error: *mut ErrorText, text: &str) {
    // SAFETY: the caller's promise.
    let Some(buffer) = (unsafe { read_growing(error) }) else { return };
    // SAFETY: the caller's promise.
    let Some(bytes) = (unsafe { slice_mut(buffer.data, buffer.capacity as usize) }) else { return };
    let end = |length: &usize| text.is_char_boundary(*length);
    let length = (0..=bytes.len().min(text.len())).rev().find(end).unwrap_or(0);
    bytes[..length].copy_from_slice(&text.as_bytes()[..length]);
    // SAFETY: `length` was there in the first version of the struct.
    unsafe { (&raw mut (*error).length).write(length as u32) };
}

/// Reads one value that the plugin lends.
///
/// # Safety
/// `pointer` is null or readable.
unsafe fn one<T: Copy>(pointer: *const T) -> Result<T, ServiceError> {
    // SAFETY: the caller's promise.
    unsafe { slice(pointer, 1) }.map(|values| values[0]).ok_or_else(|| ServiceError("an argument is null".to_owned()))
}

/// Reads many.
///
/// # Safety
/// `pointer` is null or `count` values are readable.
unsafe fn many<'a, T>(pointer: *const T, count: usize) -> Result<&'a [T], ServiceError> {
    // SAFETY: the caller's promise.
    unsafe { slice(pointer, count) }.ok_or_else(|| ServiceError(format!("{count} values are not readable")))
}

/// Reads a request.
///
/// # Safety
/// `pointer` is null or starts with its size.
unsafe fn request<T: Growing>(pointer: *const T) -> Result<T, ServiceError> {
    // SAFETY: the caller's promise.
    unsafe { read_growing(pointer) }.ok_or_else(|| ServiceError("the request is null".to_owned()))
}

/// Copies `values` to where the plugin wants `count` of them.
///
/// # Safety
/// `pointer` is null or `count` values are writable.
unsafe fn give<T: Copy>(pointer: *mut T, count: usize, values: impl ExactSizeIterator<Item = T>) -> Served {
    if values.len() != count {
        return wrong("the host has a bug: it answered with another number of values");
    }
    if count > 0 && (pointer.is_null() || !pointer.is_aligned()) {
        return wrong("there is no place for the answer");
    }
    for (index, value) in values.enumerate() {
        // SAFETY: `index < count`, and the caller promises that `count` values are writable.
        unsafe { pointer.add(index).write(value) };
    }
    Ok(())
}

unsafe extern "C" fn render(
    context: *mut c_void,
    how: *const abi::RenderRequest,
    poses: *const Pose,
    count: usize,
    receiver: *mut c_void,
    receive: Option<ViewReceiver>,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: the plugin passes its table's context, lends its arguments, and its receiver takes what it is given: the
    // header asks for all of it, here and in every service below.
    unsafe {
        serve(context, error, |table| {
            let (how, poses) = (request(how)?, many(poses, count)?);
            some_stride(how.stride)?;
            finite_poses(poses)?;
            let Some(receive) = receive else { return wrong("there is no receiver for the views") };
            let mut index = 0;
            table.services.render(how.stride, how.with_descriptors != 0, poses, &mut |images| {
                let view = lend::view(images);
                receive(receiver, index, &raw const view);
                index += 1;
            })?;
            if index == count { Ok(()) } else { wrong("the host has a bug: it rendered another number of views") }
        })
    }
}

unsafe extern "C" fn compare_views(
    context: *mut c_void,
    how: *const abi::CompareRequest,
    poses: *const Pose,
    count: usize,
    counts: *mut ClassCounts,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`; `counts` has room for `count × class_slots`.
    unsafe {
        serve(context, error, |table| {
            let (how, poses) = (request(how)?, many(poses, count)?);
            some_stride(how.stride)?;
            finite_poses(poses)?;
            finite(&[how.boundary_tolerance_px])?;
            let request = CompareRequest {
                stride: how.stride,
                ignored_in_photo: ClassSet(how.ignored_in_photo),
                ignored_in_view: ClassSet(how.ignored_in_view),
                boundary_tolerance_px: how.boundary_tolerance_px,
            };
            let counts = count.checked_mul(table.class_slots).and_then(|length| slice_mut(counts, length));
            let Some(counts) = counts else { return wrong("there is no place for the counts") };
            table.services.compare_views(&request, poses, counts)
        })
    }
}

unsafe extern "C" fn compare_panoramas(
    context: *mut c_void,
    how: *const abi::PanoramaRequest,
    positions: *const GridPoint,
    count: usize,
    counts: *mut ClassCounts,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`; `counts` has room for `count × yaw_count × class_slots`.
    unsafe {
        serve(context, error, |table| {
            let (how, positions) = (request(how)?, many(positions, count)?);
            finite_points(positions)?;
            finite(&[how.first_yaw_rad, how.pitch_rad, how.roll_rad])?;
            some_columns(how.columns)?;
            let request = PanoramaRequest {
                pitch_rad: how.pitch_rad,
                roll_rad: how.roll_rad,
                first_yaw_rad: how.first_yaw_rad,
                yaw_step_columns: how.yaw_step_columns,
                yaw_count: how.yaw_count,
                columns: how.columns,
                ignored_in_photo: ClassSet(how.ignored_in_photo),
                ignored_in_view: ClassSet(how.ignored_in_view),
            };
            let length =
                count.checked_mul(how.yaw_count as usize).and_then(|length| length.checked_mul(table.class_slots));
            let counts = length.and_then(|length| slice_mut(counts, length));
            let Some(counts) = counts else { return wrong("there is no place for the counts") };
            table.services.compare_panoramas(&request, positions, counts)
        })
    }
}

unsafe extern "C" fn inside_solid(
    context: *mut c_void,
    positions: *const GridPoint,
    count: usize,
    inside: *mut u8,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let positions = many(positions, count)?;
            finite_points(positions)?;
            give(inside, count, table.services.inside_solid(positions)?.into_iter().map(u8::from))
        })
    }
}

unsafe extern "C" fn pixel_rays(
    context: *mut c_void,
    pose: *const Pose,
    pixels: *const [f64; 2],
    count: usize,
    directions: *mut [f64; 3],
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let (pose, pixels) = (one(pose)?, many(pixels, count)?);
            finite_poses(&[pose])?;
            finite(pixels.as_flattened())?;
            give(directions, count, table.services.pixel_rays(&pose, pixels)?.into_iter())
        })
    }
}

unsafe extern "C" fn project(
    context: *mut c_void,
    pose: *const Pose,
    points: *const GridPoint,
    count: usize,
    pixels: *mut [f64; 2],
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let (pose, points) = (one(pose)?, many(points, count)?);
            finite_poses(&[pose])?;
            finite_points(points)?;
            let found = table.services.project(&pose, points)?;
            give(pixels, count, found.into_iter().map(|pixel| pixel.unwrap_or([f64::NAN; 2])))
        })
    }
}

unsafe extern "C" fn cast_rays(
    context: *mut c_void,
    origin: *const GridPoint,
    directions: *const [f64; 3],
    count: usize,
    limit_m: f64,
    with_descriptors: u32,
    hits: *mut abi::RayHit,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let (origin, directions) = (one(origin)?, many(directions, count)?);
            finite_points(&[origin])?;
            finite(directions.as_flattened())?;
            if limit_m.is_nan() {
                return wrong("the limit of the rays is not a number");
            }
            let found = table.services.cast_rays(origin, directions, limit_m, with_descriptors != 0)?;
            give(hits, count, found.into_iter().map(|hit| hit.as_ref().map_or(abi::RayHit::MISS, lend::ray_hit)))
        })
    }
}

unsafe extern "C" fn descriptors_near(
    context: *mut c_void,
    point: *const GridPoint,
    radius_m: f64,
    receiver: *mut c_void,
    receive: Option<FeatureReceiver>,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let point = one(point)?;
            finite_points(&[point])?;
            finite(&[radius_m])?;
            let Some(receive) = receive else { return wrong("there is no receiver for the descriptors") };
            for (fid, descriptor) in table.services.descriptors_near(point, radius_m)? {
                let descriptor = lend::descriptor(&descriptor);
                receive(receiver, fid, &raw const descriptor);
            }
            Ok(())
        })
    }
}

unsafe extern "C" fn ground_height(
    context: *mut c_void,
    point: *const GridPoint,
    height_m: *mut f64,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let point = one(point)?;
            finite_points(&[point])?;
            give(height_m, 1, [table.services.ground_height(point)?.unwrap_or(f64::NAN)].into_iter())
        })
    }
}

unsafe extern "C" fn grid_from_wgs84(
    context: *mut c_void,
    position: *const Wgs84,
    point: *mut GridPoint,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let position = one(position)?;
            finite(&[position.latitude_deg, position.longitude_deg, position.ellipsoidal_height_m])?;
            give(point, 1, [table.services.grid_from_wgs84(position)?].into_iter())
        })
    }
}

unsafe extern "C" fn wgs84_from_grid(
    context: *mut c_void,
    point: *const GridPoint,
    position: *mut Wgs84,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let point = one(point)?;
            finite_points(&[point])?;
            give(position, 1, [table.services.wgs84_from_grid(point)?].into_iter())
        })
    }
}

/// The plugin's own pointer, handed to the threads of the loop.
struct TaskPointer(*mut c_void);

// SAFETY: the header asks of a task that it may run on any thread, several at once.
unsafe impl Sync for TaskPointer {}

unsafe extern "C" fn parallel_for(
    context: *mut c_void,
    count: usize,
    task: *mut c_void,
    run: Option<Task>,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, error, |table| {
            let Some(run) = run else { return wrong("there is no task to run") };
            let task = TaskPointer(task);
            let task = &task;
            table.services.parallel_for(count, &|index| run(task.0, index))
        })
    }
}

unsafe extern "C" fn log(context: *mut c_void, level: u32, text: Text) {
    let level = match level {
        0 => Level::Warning,
        1 => Level::Info,
        _ => Level::Debug,
    };
    // SAFETY: as in `render`.
    unsafe {
        let text = String::from_utf8_lossy(slice(text.data, text.length).unwrap_or_default());
        serve(context, std::ptr::null_mut(), |table| {
            table.services.log(level, &text);
            Ok(())
        });
    }
}

unsafe extern "C" fn progress(context: *mut c_void, fraction: f64) {
    // SAFETY: as in `render`.
    unsafe {
        serve(context, std::ptr::null_mut(), |table| {
            if !fraction.is_nan() {
                table.services.progress(fraction.clamp(0.0, 1.0));
            }
            Ok(())
        });
    }
}

unsafe extern "C" fn cancelled(context: *mut c_void) -> u32 {
    let mut cancelled = 0;
    // SAFETY: as in `render`.
    unsafe {
        serve(context, std::ptr::null_mut(), |table| {
            cancelled = u32::from(table.services.cancelled());
            Ok(())
        });
    }
    cancelled
}
