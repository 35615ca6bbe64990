//! What the map has behind the nearest surface.

use resurvey_class_difference::raster::Rasters;
use resurvey_class_difference::uncovered;
use resurvey_plugin::schema::{ChangeRegion, ClassId};
use resurvey_plugin::{Comparison, Error, Host};

/// Pixels of a region looked at, at most.
const SAMPLES: usize = 96;
/// Share of them that lie on a surface that is not there and show what is behind it.
const MIN_SHARE: f64 = 0.5;

/// Whether `region` is what the map has behind surfaces that the photo does not show where `is_missing`: a pillar a
/// step ahead may stand beside the image instead.
pub fn is_seen_through(
    host: &dyn Host,
    comparison: &Comparison<'_>,
    rasters: &Rasters,
    is_missing: &dyn Fn(usize) -> bool,
    region: &ChangeRegion,
) -> Result<bool, Error> {
    let pixels: Vec<usize> = region_pixels(region, rasters.width);
    let samples: Vec<usize> = pixels.iter().copied().step_by(pixels.len().div_ceil(SAMPLES).max(1)).collect();
    let enough = (MIN_SHARE * samples.len() as f64).ceil() as usize;
    let missing: Vec<usize> = samples.into_iter().filter(|pixel| is_missing(*pixel)).collect();
    if missing.len() < enough.max(1) {
        return Ok(false);
    }
    let mut behind = 0;
    for pixel in missing {
        behind += usize::from(has_behind(host, comparison, rasters, pixel, region.class_after)?);
    }
    Ok(behind >= enough)
}

fn region_pixels(region: &ChangeRegion, width: usize) -> Vec<usize> {
    let bounds = &region.bounds;
    let columns = bounds.width().max(1) as usize;
    let inside = region.mask.iter().enumerate().filter(|(_, inside)| **inside != 0);
    inside.map(|(at, _)| (bounds.top as usize + at / columns) * width + bounds.left as usize + at % columns).collect()
}

/// Whether the map has `class` on one of the surfaces behind the nearest at `pixel`.
pub fn has_behind(
    host: &dyn Host,
    comparison: &Comparison<'_>,
    rasters: &Rasters,
    pixel: usize,
    class: ClassId,
) -> Result<bool, Error> {
    let pose = &comparison.estimate.pose;
    let centre = [(pixel % rasters.width) as f64 + 0.5, (pixel / rasters.width) as f64 + 0.5];
    let Some(ray) = host.pixel_rays(pose, &[centre])?.into_iter().next() else { return Ok(false) };
    uncovered::has_behind(host, pose, ray, f64::from(rasters.range_m[pixel]), class)
}
