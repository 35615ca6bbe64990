//! Whether something that the map does not have stands in front of a descriptor. A van before a chair may have the very
//! class of the ground behind the chair; what gives it away is that it goes on where the map has no such class.

use crate::raster::Rasters;
use crate::realign::explained;
use crate::removal::Seen;
use resurvey_plugin::schema::{ClassId, ClassKind, ClassTable};

/// What stands in front covers at least this many times the descriptor's pixels beside it.
const MIN_BESIDE: f64 = 0.35;

/// Where, beside descriptors, the photo has a class that is otherwise ignored, not the sky, and the view has it nowhere
/// within the tolerance.
pub fn unexplained(rasters: &Rasters, classes: &ClassTable, tolerance_px: &[u8]) -> Vec<bool> {
    let sky = classes.by_name("sky").map(|class| class.index.0);
    let may_hide: Vec<bool> = (0..=u8::MAX)
        .map(|class| {
            classes.kind(ClassId(class)) == ClassKind::Ignored && Some(class) != sky && class != ClassId::VOID.0
        })
        .collect();
    let asked: Vec<bool> = (0..rasters.photo.len())
        .map(|at| {
            // What a descriptor stood before is behind it, and nothing that hides it.
            rasters.features[at] == 0
                && may_hide[usize::from(rasters.photo[at])]
                && rasters.photo[at] != rasters.view[at]
        })
        .collect();
    let found = explained(&rasters.photo, &rasters.view, tolerance_px, rasters.width, &asked);
    asked.into_iter().zip(found).map(|(asked, found)| asked && !found).collect()
}

/// Whether beside or above `seen`, within its own size, the photo shows much that is `unexplained`.
pub fn is_hidden(rasters: &Rasters, seen: &Seen, unexplained: &[bool]) -> bool {
    let columns = || seen.pixels.iter().map(|pixel| pixel % rasters.width);
    let rows = || seen.pixels.iter().map(|pixel| pixel / rasters.width);
    let (Some(left), Some(right), Some(top), Some(bottom)) =
        (columns().min(), columns().max(), rows().min(), rows().max())
    else {
        return false;
    };
    let (wide, tall) = (right - left + 1, bottom - top + 1);
    let across = left.saturating_sub(wide / 2)..(right + 1 + wide / 2).min(rasters.width);
    let beside: usize = (top.saturating_sub(tall)..=bottom)
        .map(|row| across.clone().filter(|column| unexplained[row * rasters.width + column]).count())
        .sum();
    beside as f64 >= MIN_BESIDE * seen.pixels.len() as f64
}
