//! Turns the host's values into those of the plugin line, and reads structs that may be longer or shorter than ours.
#![allow(unsafe_code)]

use super::input::{ComparisonInput, ViewImages};
use crate::image::{LabelImage, Raster};
use resurvey_schema::abi::{self, Growing};
use resurvey_schema::service::{PoseEstimate, Prior, RayHit};
use resurvey_schema::{CameraModel, ChangeRegion, ClassKind, ClassTable, Descriptor, Intrinsics};

/// The struct at `pointer`, cut or filled with zeros to the size this host knows; `None` when null.
///
/// # Safety
/// `pointer` is null, or is aligned and starts with a `u32` that gives the readable bytes.
pub(super) unsafe fn read_growing<T: Growing>(pointer: *const T) -> Option<T> {
    if pointer.is_null() {
        return None;
    }
    let mut value = T::default();
    // SAFETY: the caller promises a readable size at the start.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    let length = size.min(size_of::<T>());
    // SAFETY: `length` bytes are readable by the caller's promise and writable in `value`; every bit pattern that the
    // other side may write is valid, because a `Growing` struct has only numbers, pointers and nullable functions.
    unsafe { std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut value).cast::<u8>(), length) };
    Some(value)
}

/// The slice at `data`; `None` when null and not empty, or longer than memory can be.
///
/// # Safety
/// `data` is null, or `length` values are readable there for as long as `'a`.
pub(super) unsafe fn slice<'a, T>(data: *const T, length: usize) -> Option<&'a [T]> {
    if length == 0 {
        return Some(&[]);
    }
    let possible = length.checked_mul(size_of::<T>()).is_some_and(|bytes| bytes <= isize::MAX as usize);
    if data.is_null() || !data.is_aligned() || !possible {
        return None;
    }
    // SAFETY: not null, aligned, of a possible size; readable by the caller's promise.
    Some(unsafe { std::slice::from_raw_parts(data, length) })
}

/// The slice to fill at `data`; as [`slice`].
///
/// # Safety
/// `data` is null, or `length` initialised values are writable there, and nobody else uses them as long as `'a`.
pub(super) unsafe fn slice_mut<'a, T>(data: *mut T, length: usize) -> Option<&'a mut [T]> {
    if length == 0 {
        return Some(&mut []);
    }
    let possible = length.checked_mul(size_of::<T>()).is_some_and(|bytes| bytes <= isize::MAX as usize);
    if data.is_null() || !data.is_aligned() || !possible {
        return None;
    }
    // SAFETY: not null, aligned, of a possible size; writable by the caller's promise.
    Some(unsafe { std::slice::from_raw_parts_mut(data, length) })
}

/// The text, when it is UTF-8.
///
/// # Safety
/// As [`slice`].
pub(super) unsafe fn text<'a>(text: abi::Text) -> Option<&'a str> {
    // SAFETY: the caller promises what `slice` asks.
    let bytes = unsafe { slice(text.data, text.length) }?;
    std::str::from_utf8(bytes).ok()
}

pub(super) fn image<T: Copy>(raster: &Raster<T>) -> abi::Image {
    abi::Image {
        data: raster.values().as_ptr().cast(),
        width: raster.width(),
        height: raster.height(),
        row_bytes: raster.width() as usize * size_of::<T>(),
    }
}

pub(super) fn view(view: &ViewImages<'_>) -> abi::View {
    abi::View {
        origin: view.origin.into(),
        labels: image(view.labels),
        range_m: image(view.range_m),
        points: image(view.points),
        features: image(view.features),
        feature_table: view.feature_table.as_ptr(),
        feature_count: view.feature_table.len(),
        ..abi::View::new()
    }
}

/// What a comparison points to.
pub(super) struct LentComparison {
    pub photo: abi::Image,
    pub view: abi::View,
    pub camera: abi::Camera,
    pub estimate: abi::PoseEstimate,
}

impl LentComparison {
    /// Points to the rasters of `input`.
    pub(super) fn new(input: &ComparisonInput<'_>) -> Self {
        Self {
            photo: image(input.photo),
            view: view(&input.view),
            camera: camera(input.camera),
            estimate: estimate(input.estimate),
        }
    }

    /// The comparison, valid as long as `self` is not moved or dropped.
    pub(super) fn record(&self) -> abi::Comparison {
        abi::Comparison {
            photo: self.photo,
            view: &raw const self.view,
            camera: &raw const self.camera,
            estimate: &raw const self.estimate,
            ..abi::Comparison::new()
        }
    }
}

/// What keeps the rasters of `input` from being one comparison.
pub(super) fn size_conflict(input: &ComparisonInput<'_>) -> Option<String> {
    let photo = (input.photo.width(), input.photo.height());
    let camera = (input.camera.width, input.camera.height);
    if camera != photo {
        return Some(format!("photo is {}×{}, its camera {}×{}", photo.0, photo.1, camera.0, camera.1));
    }
    view_conflict(photo, &input.view)
}

/// What keeps `view` from being of `size`, or its rasters of one size.
pub(super) fn view_conflict((width, height): (u32, u32), view: &ViewImages<'_>) -> Option<String> {
    let sizes = [
        ("labels", view.labels.width(), view.labels.height()),
        ("range", view.range_m.width(), view.range_m.height()),
        ("points", view.points.width(), view.points.height()),
        ("features", view.features.width(), view.features.height()),
    ];
    let other = sizes.into_iter().find(|(_, w, h)| (*w, *h) != (width, height));
    other.map(|(name, w, h)| format!("photo is {width}×{height}, {name} of the view {w}×{h}"))
}

/// A place for a class per pixel.
pub(super) fn labels(raster: &mut LabelImage) -> abi::Labels {
    let (width, height) = (raster.width(), raster.height());
    abi::Labels { data: raster.values_mut().as_mut_ptr(), width, height, row_bytes: width as usize }
}

pub(super) fn camera(camera: &Intrinsics) -> abi::Camera {
    abi::Camera {
        model: match camera.model {
            CameraModel::Pinhole => 0,
            CameraModel::Brown => 1,
            CameraModel::Fisheye => 2,
        },
        width: camera.width,
        height: camera.height,
        fx: camera.fx,
        fy: camera.fy,
        cx: camera.cx,
        cy: camera.cy,
        distortion: camera.distortion,
        ..abi::Camera::new()
    }
}

pub(super) fn prior(prior: &Prior) -> abi::Prior {
    abi::Prior {
        pose: prior.pose.into(),
        position_sigma_m: prior.position_sigma_m,
        height_sigma_m: prior.height_sigma_m,
        yaw_sigma_rad: prior.yaw_sigma_rad,
        tilt_sigma_rad: prior.tilt_sigma_rad,
        ..abi::Prior::new()
    }
}

pub(super) fn estimate(estimate: &PoseEstimate) -> abi::PoseEstimate {
    let [[a, b, c], [d, e, f], [g, h, i]] = estimate.covariance;
    abi::PoseEstimate {
        pose: estimate.pose.into(),
        covariance: [a, b, c, d, e, f, g, h, i],
        height_sigma_m: estimate.height_sigma_m,
        tilt_sigma_rad: estimate.tilt_sigma_rad,
        has_alignment: u32::from(estimate.alignment.is_some()),
        alignment_covariance: estimate.alignment.map_or([0.0; 21], |alignment| alignment.lower_triangle()),
        map_sigma_m: estimate.alignment.map_or(0.0, |alignment| alignment.map_sigma_m),
        label_sigma_px: estimate.alignment.map_or(0.0, |alignment| alignment.label_sigma_px),
        ..abi::PoseEstimate::new()
    }
}

pub(super) fn classes(classes: &ClassTable) -> Vec<abi::ClassRecord> {
    let record = |class: &resurvey_schema::Class| abi::ClassRecord {
        name: abi::Text::of(&class.name),
        size_m: class.size_m.unwrap_or_default(),
        index: class.index.0,
        kind: match class.kind {
            ClassKind::Material => 0,
            ClassKind::Dynamic => 1,
            ClassKind::Ignored => 2,
        },
        colour: class.colour,
        reserved: [0; 3],
    };
    classes.iter().map(record).collect()
}

pub(super) fn region(region: &ChangeRegion) -> abi::Region {
    abi::Region {
        class_before: region.class_before.0,
        class_after: region.class_after.0,
        left: region.bounds.left,
        top: region.bounds.top,
        right: region.bounds.right,
        bottom: region.bounds.bottom,
        pixels: region.pixels,
        mask: region.mask.as_ptr(),
        mask_length: region.mask.len(),
        ..abi::Region::new()
    }
}

pub(super) fn ray_hit(hit: &RayHit) -> abi::RayHit {
    abi::RayHit {
        point: hit.point,
        range_m: hit.range_m,
        normal: hit.normal,
        fid: hit.fid.unwrap_or_default(),
        hit: 1,
        has_fid: u8::from(hit.fid.is_some()),
        class: hit.class.0,
        reserved: [0; 5],
    }
}

pub(super) fn descriptor(descriptor: &Descriptor) -> abi::Descriptor {
    let mut out = abi::Descriptor { class: descriptor.class().0, ..abi::Descriptor::new() };
    match descriptor {
        Descriptor::Material(material) => {
            out.kind = abi::Descriptor::MATERIAL;
            out.corners = material.corners.map(Into::into);
            out.normal = material.normal;
        }
        Descriptor::Dynamic(dynamic) => {
            out.kind = abi::Descriptor::DYNAMIC;
            out.position = dynamic.position.into();
            out.size_m = dynamic.size_m;
            if let Some(yaw_rad) = dynamic.yaw_rad {
                out.has |= abi::Descriptor::HAS_YAW;
                out.yaw_rad = yaw_rad;
            }
        }
    }
    if let Some(sigma) = descriptor.sigma() {
        out.has |= abi::Descriptor::HAS_SIGMA;
        out.sigma_position_m = sigma.position_m;
        if let Some(size_m) = sigma.size_m {
            out.has |= abi::Descriptor::HAS_SIGMA_SIZE;
            out.sigma_size_m = size_m;
        }
        if let Some(area_m2) = sigma.area_m2 {
            out.has |= abi::Descriptor::HAS_SIGMA_AREA;
            out.sigma_area_m2 = area_m2;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shorter_struct_reads_as_zero_where_it_ends() {
        let sent = abi::Region { size: 16, left: 3, top: 5, right: 7, ..abi::Region::new() };
        // SAFETY: a whole region is readable, more than its size says.
        let read = unsafe { read_growing(&raw const sent) }.unwrap();
        assert_eq!((read.left, read.top, read.right), (3, 5, 0));
    }

    #[test]
    fn a_longer_struct_is_read_as_far_as_it_is_known() {
        #[repr(C)]
        struct Longer {
            known: abi::RenderRequest,
            later: [u64; 4],
        }
        let known = abi::RenderRequest { size: size_of::<Longer>() as u32, stride: 4, ..abi::RenderRequest::new() };
        let sent = Longer { known, later: [u64::MAX; 4] };
        // SAFETY: the size that the struct says is readable.
        let read = unsafe { read_growing((&raw const sent).cast::<abi::RenderRequest>()) }.unwrap();
        assert_eq!((read.stride, read.with_descriptors, read.reserved), (4, 0, 0));
        assert_eq!(sent.later[3], u64::MAX);
    }

    #[test]
    fn null_and_impossible_arrays_are_none() {
        let numbers = [1_u32, 2, 3];
        // SAFETY: null, or never read because the length is impossible, or three readable numbers.
        unsafe {
            assert!(read_growing(std::ptr::null::<abi::Region>()).is_none());
            assert!(slice(std::ptr::null::<u32>(), 1).is_none());
            assert!(slice(numbers.as_ptr(), usize::MAX).is_none());
            assert!(slice(numbers.as_ptr().byte_add(1), 1).is_none());
            assert_eq!(slice(numbers.as_ptr(), 3), Some(&numbers[..]));
            assert_eq!(slice(std::ptr::null::<u32>(), 0), Some(&[][..]));
        }
    }

    #[test]
    fn a_text_that_is_not_utf_8_is_none() {
        let bytes = [0xff_u8, b'a'];
        // SAFETY: two readable bytes.
        assert!(unsafe { text(abi::Text { data: bytes.as_ptr(), length: 2 }) }.is_none());
    }
}
