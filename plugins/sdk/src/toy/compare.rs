//! What the host counts when it compares a view with the photo, by its definition and without haste.

use resurvey_schema::ClassId;
use resurvey_schema::service::{ClassCounts, CompareRequest, ViewCounts};

/// Counts of the classes `0..slots` over two label images of one size, every `request.stride`-th pixel of the photo.
///
/// Overlap is over the pixels where neither class is void or ignored, boundaries over those where the photo's is not. A
/// boundary pixel has a neighbour by its side, inside the image, of another class.
pub(super) fn counts(photo: &[u8], view: &[u8], width: usize, slots: usize, request: &CompareRequest) -> ViewCounts {
    let takes_part = |photo: u8| photo != ClassId::VOID.0 && !request.ignored_in_photo.contains(ClassId(photo));
    let is_known = |class: u8| usize::from(class) < slots;
    let compared: Vec<(u8, u8)> = photo
        .iter()
        .zip(view)
        .map(|(photo, view)| (*photo, *view))
        .filter(|&(photo, view)| takes_part(photo) && is_known(photo) && is_known(view))
        .filter(|&(_, view)| !request.ignored_in_view.contains(ClassId(view)))
        .collect();
    let tolerance_px = request.boundary_tolerance_px / f64::from(request.stride.max(1));
    let number = |pick: &dyn Fn(u8, u8) -> bool| compared.iter().filter(|(a, b)| pick(*a, *b)).count() as u32;
    let class = |class: u8| {
        let mut counts = ClassCounts {
            photo: number(&|photo, _| photo == class),
            view: number(&|_, view| view == class),
            both: number(&|photo, view| photo == class && view == class),
            ..ClassCounts::default()
        };
        if tolerance_px > 0.0 {
            let where_compared = |index: &usize| takes_part(photo[*index]);
            let in_photo: Vec<usize> = boundary(photo, width, class).filter(where_compared).collect();
            let in_view: Vec<usize> = boundary(view, width, class).filter(where_compared).collect();
            (counts.photo_boundary, counts.view_boundary) = (in_photo.len() as u32, in_view.len() as u32);
            counts.photo_boundary_matched = near(&in_photo, &in_view, width, tolerance_px);
            counts.view_boundary_matched = near(&in_view, &in_photo, width, tolerance_px);
        }
        counts
    };
    (0..slots.min(usize::from(ClassId::VOID.0))).map(|index| class(index as u8)).collect()
}

fn boundary(labels: &[u8], width: usize, class: u8) -> impl Iterator<Item = usize> + '_ {
    let is_other =
        move |index: Option<usize>| index.and_then(|index| labels.get(index)).is_some_and(|other| *other != class);
    (0..labels.len()).filter(move |&index| {
        let column = index % width;
        labels[index] == class
            && (is_other((column > 0).then(|| index - 1))
                || is_other((column + 1 < width).then_some(index + 1))
                || is_other(index.checked_sub(width))
                || is_other(Some(index + width)))
    })
}

/// How many of `pixels` have one of `others` within `tolerance_px`.
fn near(pixels: &[usize], others: &[usize], width: usize, tolerance_px: f64) -> u32 {
    let at = |index: usize| ((index % width) as f64, (index / width) as f64);
    let is_near = |pixel: &&usize| {
        let (u, v) = at(**pixel);
        others.iter().map(|other| at(*other)).any(|(x, y)| (x - u).powi(2) + (y - v).powi(2) <= tolerance_px.powi(2))
    };
    pixels.iter().filter(is_near).count() as u32
}
