//! Which parts of a region's contour are true edges of the thing, and which are where something else ends it.

use crate::outline::{ContourPoint, Outline};
use crate::sight::Sight;
use resurvey_plugin::schema::{ClassId, ClassKind};

/// Pixels outside the contour at which the photo is asked what is there.
const PROBE_PX: [i64; 2] = [3, 5];
/// Pixels around a probe within which the view may explain the photo's class there.
const EXPLAIN_PX: i64 = 8;

/// Whether the region ends at `point` because the thing does: not where the photo has something beside it that the map
/// has not and that may stand in front, nor where the photo's class goes on outside the region.
pub fn is_true_edge(sight: &Sight<'_>, outline: &Outline, point: &ContourPoint, class_after: ClassId) -> bool {
    let hidden = |step: i64| {
        let [u, v] = [0, 1].map(|axis| point.inside[axis] + step * point.outward[axis]);
        if outline.contains(u, v) {
            return false;
        }
        let Some(photo) = sight.photo(u, v) else { return false };
        let goes_on = photo == class_after;
        let in_front = match sight.host.classes().kind(photo) {
            ClassKind::Material => false,
            ClassKind::Dynamic => true,
            ClassKind::Ignored => Some(photo) != sight.sky,
        };
        goes_on || (in_front && !has_nearby(sight, u, v, photo))
    };
    !PROBE_PX.into_iter().all(hidden)
}

/// Whether the photo shows what the map has below column `u` of something that ends at row `end`: not where something
/// that the map has not may stand in front.
pub fn shows_map_below(sight: &Sight<'_>, u: u32, end: u32) -> bool {
    PROBE_PX.into_iter().any(|step| shows_map(sight, i64::from(u), i64::from(end) - 1 + step))
}

/// Whether the photo shows at pixel `u`, `v` what the map has there or near by.
pub fn shows_map(sight: &Sight<'_>, u: i64, v: i64) -> bool {
    sight.photo(u, v).is_some_and(|photo| sight.view(u, v) == Some(photo) || has_nearby(sight, u, v, photo))
}

fn has_nearby(sight: &Sight<'_>, u: i64, v: i64, class: ClassId) -> bool {
    let steps = [-EXPLAIN_PX, -EXPLAIN_PX / 2, 0, EXPLAIN_PX / 2, EXPLAIN_PX];
    steps.into_iter().any(|down| steps.into_iter().any(|right| sight.view(u + right, v + down) == Some(class)))
}
