//! Eq. 8 of Lee & Hsu and nothing else: components of one pair (class in the view, class in the photo).

use crate::components::components;
use crate::raster::Rasters;
use crate::region::region;
use resurvey_plugin::schema::{ChangeRegion, ClassId, ClassKind, ClassTable};

/// Smallest region, share of the image (§4.1 of the paper).
pub const PAPER_SHARE: f64 = 0.05;

/// Regions of one pair of classes with at least [`PAPER_SHARE`] of the image. Classes are names: they are compared with
/// `!=`, not subtracted as printed.
pub fn pair_regions(rasters: &Rasters, classes: &ClassTable) -> Vec<ChangeRegion> {
    let limit_px = (PAPER_SHARE * rasters.photo.len() as f64).ceil() as usize;
    let pair = |pixel: usize| {
        let (before, after) = (rasters.view[pixel], rasters.photo[pixel]);
        let possible = match classes.kind(ClassId(after)) {
            // The ground behind an object of the map is no class of interest, yet it shows that the object is gone.
            ClassKind::Ignored => after != ClassId::VOID.0 && classes.kind(ClassId(before)) == ClassKind::Dynamic,
            ClassKind::Material => !rasters.is_sky(pixel),
            ClassKind::Dynamic => true,
        };
        (before != after && possible).then_some((before, after))
    };
    let pairs: Vec<Option<(u8, u8)>> = (0..rasters.photo.len()).map(pair).collect();
    components(&pairs, rasters.width)
        .iter()
        .filter(|pixels| pixels.len() >= limit_px)
        .map(|pixels| region(rasters, pixels, ClassId(rasters.photo[pixels[0]]), 0.0))
        .collect()
}
