//! Reads what the host lends: the other half of `core/src/plugin/lend.rs`.

use crate::image::{Comparison, ImageRef, View};
use crate::kinds::{Error, Photo};
use resurvey_schema::Alignment;
use resurvey_schema::abi::{self, Growing};
use resurvey_schema::service::{PoseEstimate, Prior};
use resurvey_schema::{
    CameraModel, ChangeRegion, Class, ClassId, ClassKind, ClassTable, Descriptor, DynamicDescriptor, Intrinsics,
    MaterialDescriptor, PixelBox, Uncertainty,
};

pub(crate) fn wrong<T>(text: &str) -> Result<T, Error> {
    Err(Error(text.to_owned()))
}

/// The struct at `pointer`, cut or filled with zeros to the size this plugin knows.
///
/// # Safety
/// `pointer` is null, or is aligned and starts with a `u32` that gives the readable bytes.
pub(crate) unsafe fn growing<T: Growing>(pointer: *const T) -> Result<T, Error> {
    if pointer.is_null() {
        return wrong("the host handed in null");
    }
    let mut value = T::default();
    // SAFETY: the caller promises a readable size at the start.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    let length = size.min(size_of::<T>());
    // SAFETY: `length` bytes are readable by the caller's promise and writable in `value`; every bit pattern that the
    // host may write is valid, because a `Growing` struct has only numbers, pointers and nullable functions.
    unsafe { std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut value).cast::<u8>(), length) };
    Ok(value)
}

/// Fills the host's struct at `to`, as far as the host knows it; its `size` stays.
///
/// # Safety
/// `to` is null, or is aligned and starts with a `u32` that gives the writable bytes.
pub(crate) unsafe fn fill<T: Growing>(to: *mut T, value: &T) -> Result<(), Error> {
    if to.is_null() {
        return wrong("the host handed in no place for the answer");
    }
    // SAFETY: the caller promises a readable size at the start.
    let size = unsafe { to.cast::<u32>().read() } as usize;
    let after_size = size_of::<u32>();
    let length = size.min(size_of::<T>()).saturating_sub(after_size);
    // SAFETY: both structs have at least `length` bytes behind their size.
    unsafe {
        let from = std::ptr::from_ref(value).cast::<u8>().add(after_size);
        std::ptr::copy_nonoverlapping(from, to.cast::<u8>().add(after_size), length);
    }
    Ok(())
}

/// The slice at `data`.
///
/// # Safety
/// `data` is null, or `length` values are readable there for as long as `'a`.
pub(crate) unsafe fn slice<'a, T>(data: *const T, length: usize) -> Result<&'a [T], Error> {
    if length == 0 {
        return Ok(&[]);
    }
    let possible = length.checked_mul(size_of::<T>()).is_some_and(|bytes| bytes <= isize::MAX as usize);
    if data.is_null() || !data.is_aligned() || !possible {
        return wrong("the host handed in an array that cannot be read");
    }
    // SAFETY: not null, aligned, of a possible size; readable by the caller's promise.
    Ok(unsafe { std::slice::from_raw_parts(data, length) })
}

/// The text.
///
/// # Safety
/// As [`slice`].
pub(crate) unsafe fn text<'a>(text: abi::Text) -> Result<&'a str, Error> {
    // SAFETY: the caller promises what `slice` asks.
    let bytes = unsafe { slice(text.data, text.length) }?;
    std::str::from_utf8(bytes).map_err(|error| Error(format!("the host handed in a text that is not UTF-8: {error}")))
}

/// The image.
///
/// # Safety
/// Its rows are readable values of type `T` for as long as `'a`.
pub(crate) unsafe fn image<'a, T: Copy>(image: &abi::Image) -> Result<ImageRef<'a, T>, Error> {
    let (width, height) = (image.width as usize, image.height as usize);
    let stride = image.row_bytes / size_of::<T>();
    if stride < width || !image.row_bytes.is_multiple_of(size_of::<T>()) {
        return wrong("the host handed in an image whose row step does not fit its width");
    }
    let before_last = stride.checked_mul(height.saturating_sub(1));
    let length = before_last.and_then(|length| length.checked_add(if height == 0 { 0 } else { width }));
    // SAFETY: the caller's promise.
    let data = unsafe { slice(image.data.cast::<T>(), length.unwrap_or(usize::MAX)) }?;
    ImageRef::new(data, image.width, image.height, stride).ok_or_else(|| Error("an image is too short".to_owned()))
}

/// The view.
///
/// # Safety
/// `view` is null or a view that lives as long as `'a`.
pub(crate) unsafe fn view<'a>(view: *const abi::View) -> Result<View<'a>, Error> {
    // SAFETY: the caller's promise, here and below: what a view points to lives with it.
    let view = unsafe { growing(view) }?;
    Ok(View {
        origin: view.origin.into(),
        // SAFETY: as above.
        labels: unsafe { image(&view.labels) }?,
        // SAFETY: as above.
        range_m: unsafe { image(&view.range_m) }?,
        // SAFETY: as above.
        points: unsafe { image(&view.points) }?,
        // SAFETY: as above.
        features: unsafe { image(&view.features) }?,
        // SAFETY: as above.
        feature_table: unsafe { slice(view.feature_table, view.feature_count) }?,
    })
}

/// The comparison.
///
/// # Safety
/// `comparison` is null or one that lives as long as `'a`.
pub(crate) unsafe fn comparison<'a>(comparison: *const abi::Comparison) -> Result<Comparison<'a>, Error> {
    // SAFETY: the caller's promise, here and below: what a comparison points to lives with it.
    let comparison = unsafe { growing(comparison) }?;
    // SAFETY: as above.
    let estimate = unsafe { growing(comparison.estimate) }?;
    let [a, b, c, d, e, f, g, h, i] = estimate.covariance;
    Ok(Comparison {
        // SAFETY: as above.
        photo: unsafe { image(&comparison.photo) }?,
        // SAFETY: as above.
        view: unsafe { view(comparison.view) }?,
        // SAFETY: as above.
        camera: unsafe { camera(comparison.camera) }?,
        estimate: PoseEstimate {
            pose: estimate.pose.into(),
            covariance: [[a, b, c], [d, e, f], [g, h, i]],
            height_sigma_m: estimate.height_sigma_m,
            tilt_sigma_rad: estimate.tilt_sigma_rad,
            alignment: (estimate.has_alignment != 0).then(|| {
                let (map_sigma_m, label_sigma_px) = (estimate.map_sigma_m, estimate.label_sigma_px);
                Alignment::from_lower_triangle(&estimate.alignment_covariance, map_sigma_m, label_sigma_px)
            }),
        },
    })
}

/// The photo.
///
/// # Safety
/// `photo` is null or one that lives as long as `'a`.
pub(crate) unsafe fn photo<'a>(photo: *const abi::Photo) -> Result<Photo<'a>, Error> {
    // SAFETY: the caller's promise, here and below: what a photo points to lives with it.
    let photo = unsafe { growing(photo) }?;
    // SAFETY: as above.
    let prior = unsafe { growing(photo.prior) }?;
    Ok(Photo {
        // SAFETY: as above.
        labels: unsafe { image(&photo.labels) }?,
        // SAFETY: as above.
        camera: unsafe { camera(photo.camera) }?,
        prior: Prior {
            pose: prior.pose.into(),
            position_sigma_m: prior.position_sigma_m,
            height_sigma_m: prior.height_sigma_m,
            yaw_sigma_rad: prior.yaw_sigma_rad,
            tilt_sigma_rad: prior.tilt_sigma_rad,
        },
    })
}

/// # Safety
/// `camera` is null or readable.
unsafe fn camera(camera: *const abi::Camera) -> Result<Intrinsics, Error> {
    // SAFETY: the caller's promise.
    let camera = unsafe { growing(camera) }?;
    let model = match camera.model {
        0 => CameraModel::Pinhole,
        1 => CameraModel::Brown,
        2 => CameraModel::Fisheye,
        other => return Err(Error(format!("the host uses camera model {other}, which this plugin does not know"))),
    };
    let abi::Camera { width, height, fx, fy, cx, cy, distortion, .. } = camera;
    Ok(Intrinsics { model, width, height, fx, fy, cx, cy, distortion })
}

/// The regions, `step` bytes apart.
///
/// # Safety
/// `count` regions with their masks are readable at `first`.
pub(crate) unsafe fn regions(first: *const abi::Region, count: usize, step: usize) -> Result<Vec<ChangeRegion>, Error> {
    let one = |index: usize| {
        // SAFETY: the caller promises `count` regions that many bytes apart, each with its size first.
        let region = unsafe { growing(first.byte_add(index * step)) }?;
        // SAFETY: the caller promises the masks.
        let mask = unsafe { slice(region.mask, region.mask_length) }?;
        Ok(ChangeRegion {
            class_before: ClassId(region.class_before),
            class_after: ClassId(region.class_after),
            bounds: PixelBox { left: region.left, top: region.top, right: region.right, bottom: region.bottom },
            mask: mask.to_vec(),
            pixels: region.pixels,
        })
    };
    (0..count).map(one).collect()
}

/// The class table.
///
/// # Safety
/// `count` records with their names are readable at `first`.
pub(crate) unsafe fn classes(first: *const abi::ClassRecord, count: usize) -> Result<ClassTable, Error> {
    let class = |record: &abi::ClassRecord| {
        let kind = match record.kind {
            0 => ClassKind::Material,
            1 => ClassKind::Dynamic,
            _ => ClassKind::Ignored,
        };
        Ok(Class {
            index: ClassId(record.index),
            // SAFETY: the caller promises the names.
            name: unsafe { text(record.name) }?.to_owned(),
            colour: record.colour,
            kind,
            size_m: (kind == ClassKind::Dynamic).then_some(record.size_m),
        })
    };
    // SAFETY: the caller's promise.
    let records = unsafe { slice(first, count) }?;
    let classes = records.iter().map(class).collect::<Result<_, Error>>()?;
    ClassTable::new(classes).map_err(|error| Error(format!("the host's class table is wrong: {error}")))
}

/// The descriptor.
pub(crate) fn descriptor(from: &abi::Descriptor) -> Result<Descriptor, Error> {
    let has = |bit, value| (from.has & bit != 0).then_some(value);
    let sigma = has(abi::Descriptor::HAS_SIGMA, from.sigma_position_m).map(|position_m| Uncertainty {
        position_m,
        size_m: has(abi::Descriptor::HAS_SIGMA_SIZE, from.sigma_size_m),
        area_m2: has(abi::Descriptor::HAS_SIGMA_AREA, from.sigma_area_m2),
    });
    let class = ClassId(from.class);
    match from.kind {
        abi::Descriptor::MATERIAL => Ok(Descriptor::Material(MaterialDescriptor {
            class,
            corners: from.corners.map(Into::into),
            normal: from.normal,
            sigma,
        })),
        abi::Descriptor::DYNAMIC => Ok(Descriptor::Dynamic(DynamicDescriptor {
            class,
            position: from.position.into(),
            size_m: from.size_m,
            yaw_rad: has(abi::Descriptor::HAS_YAW, from.yaw_rad),
            sigma,
        })),
        kind => Err(Error(format!("the host has descriptors of kind {kind}, which this plugin does not know"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_older_host_s_services_read_as_missing() {
        extern "C" fn nobody(_: *mut core::ffi::c_void) -> u32 {
            7
        }
        let all = abi::Services { cancelled: Some(nobody), ..abi::Services::new() };
        // SAFETY: a whole table is readable.
        assert!(unsafe { growing(&raw const all) }.unwrap().cancelled.is_some());
        let older = abi::Services { size: std::mem::offset_of!(abi::Services, cancelled) as u32, ..all };
        // SAFETY: as above.
        assert!(unsafe { growing(&raw const older) }.unwrap().cancelled.is_none());
    }

    #[test]
    fn an_answer_fills_a_place_as_far_as_the_host_knows_it() {
        let answer = abi::Localization { score: 0.5, skipped: 9, ..abi::Localization::new() };
        let size = std::mem::offset_of!(abi::Localization, skipped) as u32;
        let mut place = abi::Localization { size, skipped: 1, ..abi::Localization::default() };
        // SAFETY: a whole place is writable.
        unsafe { fill(&raw mut place, &answer) }.unwrap();
        assert_eq!((place.size, place.skipped), (size, 1));
        assert!((place.score - 0.5).abs() < 1e-12);
    }

    #[test]
    fn padded_rows_are_read_without_their_padding() {
        let data = [1_u16, 2, 99, 3, 4];
        let padded = abi::Image { data: data.as_ptr().cast(), width: 2, height: 2, row_bytes: 6 };
        // SAFETY: two rows of two values, six bytes apart, are readable.
        let image = unsafe { image::<u16>(&padded) }.unwrap();
        assert_eq!((image.row(0), image.row(1)), (&[1, 2][..], &[3, 4][..]));
    }

    #[test]
    fn an_image_that_cannot_be_is_refused() {
        let data = [0_u16; 8];
        for (width, height, row_bytes) in [(2, 2, 3), (2, 2, 2), (2, u32::MAX, usize::MAX - 1)] {
            let broken = abi::Image { data: data.as_ptr().cast(), width, height, row_bytes };
            // SAFETY: refused before anything is read.
            assert!(unsafe { image::<u16>(&broken) }.is_err(), "{width} {height} {row_bytes}");
        }
        let nothing = abi::Image::default();
        // SAFETY: an image without pixels needs no memory.
        assert_eq!(unsafe { image::<u16>(&nothing) }.unwrap().height(), 0);
    }

    #[test]
    fn regions_of_a_newer_host_are_found_at_its_own_step() {
        #[repr(C)]
        struct Longer {
            known: abi::Region,
            later: u64,
        }
        let mask = [1_u8];
        let region = |left| abi::Region {
            size: size_of::<Longer>() as u32,
            left,
            right: left + 1,
            bottom: 1,
            pixels: 1,
            mask: mask.as_ptr(),
            mask_length: 1,
            ..abi::Region::new()
        };
        let sent = [4, 8].map(|left| Longer { known: region(left), later: u64::MAX });
        // SAFETY: two regions, one `Longer` apart, with their masks.
        let read = unsafe { regions(sent.as_ptr().cast(), 2, size_of::<Longer>()) }.unwrap();
        assert_eq!(read.iter().map(|region| region.bounds.left).collect::<Vec<_>>(), [4, 8]);
        assert_eq!(sent[1].later, u64::MAX);
    }
}
