//! Hands the results of a call to the host.

use crate::borrow::{growing, wrong};
use crate::kinds::Error;
use resurvey_schema::abi::{self, Growing, STATUS_OK, Text};
use resurvey_schema::{ChangeRegion, Descriptor, Localization, Proposal, Rejection};

/// Delivers the cells of a heat map.
///
/// # Safety
/// `results` is that of the call in progress.
pub(crate) unsafe fn heat(results: *const abi::Results, cells: &[[f64; 3]]) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let results = unsafe { growing(results) }?;
    match results.heat {
        // SAFETY: the host's own function and context; the cells live until it returns.
        Some(take) if !cells.is_empty() => taken(unsafe { take(results.context, cells.as_ptr(), cells.len()) }),
        _ => Ok(()),
    }
}

/// Delivers regions.
///
/// # Safety
/// `results` is that of the call in progress.
pub(crate) unsafe fn regions(results: *const abi::Results, regions: &[ChangeRegion]) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let results = unsafe { growing(results) }?;
    let Some(take) = results.region else { return wrong("this host takes no regions") };
    regions.iter().try_for_each(|region| {
        let record = abi::Region {
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
        };
        // SAFETY: the host's own function and context; the record and its mask live until it returns.
        taken(unsafe { take(results.context, &raw const record) })
    })
}

/// Delivers proposals.
///
/// # Safety
/// `results` is that of the call in progress.
pub(crate) unsafe fn proposals(results: *const abi::Results, proposals: &[Proposal]) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let results = unsafe { growing(results) }?;
    let Some(take) = results.proposal else { return wrong("this host takes no proposals") };
    proposals.iter().try_for_each(|proposal| {
        let mut record = proposal_record(proposal);
        let placed = match proposal {
            Proposal::Place { descriptor, .. } => Some(descriptor_record(descriptor)),
            _ => None,
        };
        record.descriptor = placed.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
        // SAFETY: the host's own function and context; the record and what it points to live until it returns.
        taken(unsafe { take(results.context, &raw const record) })
    })
}

/// Writes labels, row by row, to the place of the host, which is `width` × `height`.
///
/// # Safety
/// `to` is null or that of the call in progress.
pub(crate) unsafe fn labels(to: *const abi::Labels, (width, height): (u32, u32), labels: &[u8]) -> Result<(), Error> {
    // SAFETY: the caller's promise; the struct is frozen.
    let Some(place) = (unsafe { to.as_ref() }) else { return wrong("the host handed in no place for the labels") };
    let (columns, rows) = (width as usize, height as usize);
    if labels.len() != columns * rows {
        return Err(Error(format!("expected {width}×{height} labels, found {}", labels.len())));
    }
    if columns == 0 || rows == 0 {
        return Ok(());
    }
    if place.data.is_null() || (place.width, place.height) != (width, height) || place.row_bytes < columns {
        return wrong("the host handed in a place for labels of another size than the photo");
    }
    for (row, values) in labels.chunks_exact(columns).enumerate() {
        // SAFETY: the host lends `height` rows of `width` writable bytes, `row_bytes` apart, to this call alone.
        unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), place.data.add(row * place.row_bytes), columns) };
    }
    Ok(())
}

fn taken(status: abi::Status) -> Result<(), Error> {
    if status == STATUS_OK { Ok(()) } else { wrong("the host did not take the answer") }
}

fn proposal_record(proposal: &Proposal) -> abi::Proposal {
    let mut record = abi::Proposal::new();
    match proposal {
        Proposal::Place { region, .. } => (record.kind, record.region) = (abi::Proposal::PLACE, *region),
        Proposal::Remove { region, class, near, sigma_m } => {
            (record.kind, record.region) = (abi::Proposal::REMOVE, *region);
            record.class = class.0;
            record.near = (*near).into();
            record.sigma_m = *sigma_m;
        }
        Proposal::Reject { region, rejection } => {
            let Rejection { class_before, class_after, pixels, requirement, measured, limit, unit } = rejection;
            (record.kind, record.region) = (abi::Proposal::REJECT, *region);
            (record.class_before, record.class_after, record.pixels) = (class_before.0, class_after.0, *pixels);
            (record.measured, record.limit) = (*measured, *limit);
            (record.requirement, record.unit) = (Text::of(requirement), Text::of(unit));
        }
    }
    record
}

fn descriptor_record(descriptor: &Descriptor) -> abi::Descriptor {
    let mut record = abi::Descriptor { class: descriptor.class().0, ..abi::Descriptor::new() };
    match descriptor {
        Descriptor::Material(material) => {
            record.kind = abi::Descriptor::MATERIAL;
            record.corners = material.corners.map(Into::into);
            record.normal = material.normal;
        }
        Descriptor::Dynamic(dynamic) => {
            record.kind = abi::Descriptor::DYNAMIC;
            record.position = dynamic.position.into();
            record.size_m = dynamic.size_m;
            record.yaw_rad = dynamic.yaw_rad.unwrap_or_default();
            record.has |= if dynamic.yaw_rad.is_some() { abi::Descriptor::HAS_YAW } else { 0 };
        }
    }
    if let Some(sigma) = descriptor.sigma() {
        record.has |= abi::Descriptor::HAS_SIGMA;
        record.sigma_position_m = sigma.position_m;
        if let Some(size_m) = sigma.size_m {
            record.has |= abi::Descriptor::HAS_SIGMA_SIZE;
            record.sigma_size_m = size_m;
        }
        if let Some(area_m2) = sigma.area_m2 {
            record.has |= abi::Descriptor::HAS_SIGMA_AREA;
            record.sigma_area_m2 = area_m2;
        }
    }
    record
}

/// The fixed part of a localization; the heat map goes its own way.
pub(crate) fn localization_record(found: &Localization) -> abi::Localization {
    let [[a, b, c], [d, e, f], [g, h, i]] = found.covariance;
    abi::Localization {
        has_runner_up: u32::from(found.runner_up.is_some()),
        pose: found.pose.into(),
        score: found.score,
        covariance: [a, b, c, d, e, f, g, h, i],
        runner_up_distance_m: found.runner_up.map_or(0.0, |runner_up| runner_up.distance_m),
        runner_up_score_ratio: found.runner_up.map_or(0.0, |runner_up| runner_up.score_ratio),
        candidates: found.candidates,
        skipped: found.skipped,
        has_alignment: u32::from(found.alignment.is_some()),
        alignment_covariance: found.alignment.map_or([0.0; 21], |alignment| alignment.lower_triangle()),
        map_sigma_m: found.alignment.map_or(0.0, |alignment| alignment.map_sigma_m),
        label_sigma_px: found.alignment.map_or(0.0, |alignment| alignment.label_sigma_px),
        ..abi::Localization::new()
    }
}
