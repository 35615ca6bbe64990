//! From changed pixels to regions: grown back to their full extent, cleaned, and described.

use crate::components::{components, fill_holes, for_neighbours, inscribed_radius_px};
use crate::raster::Rasters;
use resurvey_plugin::schema::{ChangeRegion, ClassId, PixelBox};

/// Pixels beyond its tolerance that a changed pixel may grow, so that rounding leaves no rim behind.
const GROWTH_MARGIN_PX: usize = 2;

/// The changed pixels and what they may grow into.
pub struct Growth<'a> {
    /// Pixels that are surely changed.
    pub changed: &'a [bool],
    /// Pixels that differ from the view, changed or explained.
    pub different: &'a [bool],
    /// Pixels of a descriptor of the photo's own class: what lies across them is one region.
    pub same_descriptor: &'a [bool],
}

/// Photo class of every pixel of a region: the changed pixels and those of the same class around them that lost their
/// evidence to the tolerance. The measured edges are exact again.
pub fn grow(rasters: &Rasters, tolerance_px: &[u8], growth: &Growth<'_>) -> Vec<Option<u8>> {
    let (photo, width) = (&rasters.photo, rasters.width);
    let mut budget = vec![0usize; photo.len()];
    let mut by_budget = vec![Vec::new(); usize::from(u8::MAX) + GROWTH_MARGIN_PX + 1];
    for pixel in (0..photo.len()).filter(|pixel| growth.changed[*pixel]) {
        budget[pixel] = usize::from(tolerance_px[pixel]) + GROWTH_MARGIN_PX;
        by_budget[budget[pixel]].push(pixel);
    }
    for left in (1..by_budget.len()).rev() {
        let mut next = 0;
        while let Some(&pixel) = by_budget[left].get(next) {
            next += 1;
            if budget[pixel] != left {
                continue;
            }
            for_neighbours(pixel, width, photo.len(), |near| {
                let free = growth.same_descriptor[near];
                let rest = if free { left } else { left - 1 };
                if photo[near] == photo[pixel] && (free || growth.different[near]) && rest > budget[near] {
                    budget[near] = rest;
                    by_budget[rest].push(near);
                }
            });
        }
    }
    budget.iter().zip(photo).map(|(budget, class)| (*budget > 0).then_some(*class)).collect()
}

/// Components of `grown` with at least `limit_px(class)` pixels, of which the changed ones hold at least half the limit
/// and a disk of `min_radius_px`: a pose error leaves only slivers.
pub fn sound_components(
    grown: &[Option<u8>],
    changed: &[bool],
    width: usize,
    min_radius_px: f64,
    limit_px: impl Fn(u8) -> usize,
) -> Vec<Vec<usize>> {
    let sound = |pixels: &Vec<usize>| {
        let Some(class) = grown[pixels[0]] else { return false };
        let limit_px = limit_px(class);
        let sure: Vec<usize> = pixels.iter().copied().filter(|pixel| changed[*pixel]).collect();
        if pixels.len() < limit_px || sure.len() * 2 < limit_px || sure.is_empty() {
            return false;
        }
        let bounds = bounds(&sure, width);
        let mut mask = vec![false; (bounds.width() * bounds.height()) as usize];
        sure.iter().for_each(|pixel| mask[index_in(&bounds, *pixel, width)] = true);
        inscribed_radius_px(&mask, bounds.width() as usize) >= min_radius_px
    };
    components(grown, width).into_iter().filter(sound).collect()
}

/// The region of `pixels`, never none, with holes up to `max_hole_share` of it filled. The class before is the view's
/// most frequent one.
pub fn region(rasters: &Rasters, pixels: &[usize], class_after: ClassId, max_hole_share: f64) -> ChangeRegion {
    let bounds = bounds(pixels, rasters.width);
    let mut mask = vec![0; (bounds.width() * bounds.height()) as usize];
    pixels.iter().for_each(|pixel| mask[index_in(&bounds, *pixel, rasters.width)] = 1);
    fill_holes(&mut mask, bounds.width() as usize, (max_hole_share * pixels.len() as f64) as usize);
    let before = most_frequent(pixels.iter().map(|pixel| rasters.view[*pixel]).filter(|class| *class != class_after.0));
    ChangeRegion {
        class_before: ClassId(before.unwrap_or(class_after.0)),
        class_after,
        bounds,
        pixels: mask.iter().map(|inside| u32::from(*inside)).sum(),
        mask,
    }
}

/// The value that occurs most often, the smallest of several; `None` of none.
pub fn most_frequent(values: impl Iterator<Item = u8>) -> Option<u8> {
    let mut counts = [0u32; 256];
    values.for_each(|value| counts[usize::from(value)] += 1);
    let most = counts.iter().copied().max().filter(|most| *most > 0)?;
    counts.iter().position(|count| *count == most).map(|value| value as u8)
}

fn bounds(pixels: &[usize], width: usize) -> PixelBox {
    let start = PixelBox { left: u32::MAX, top: u32::MAX, right: 0, bottom: 0 };
    pixels.iter().fold(start, |bounds, pixel| {
        let (u, v) = ((pixel % width) as u32, (pixel / width) as u32);
        PixelBox {
            left: bounds.left.min(u),
            top: bounds.top.min(v),
            right: bounds.right.max(u + 1),
            bottom: bounds.bottom.max(v + 1),
        }
    })
}

fn index_in(bounds: &PixelBox, pixel: usize, width: usize) -> usize {
    (pixel / width - bounds.top as usize) * bounds.width() as usize + pixel % width - bounds.left as usize
}
