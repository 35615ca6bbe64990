//! Boundary counts of every class, with the photo's side prepared once.

use super::bits::Bits;
use crate::image::LabelImage;
use resurvey_schema::ClassId;
use resurvey_schema::service::{ClassCounts, ClassSet};

/// A photo whose class boundaries are ready to be compared with many views.
#[derive(Clone, Debug)]
pub struct BoundaryPhoto {
    tolerance_px: f64,
    /// Pixels that are compared whatever the view shows.
    compared: Bits,
    /// Per class: boundary and boundary dilated by the tolerance.
    classes: Vec<(Bits, Bits)>,
    ignored_in_view: ClassSet,
}

impl BoundaryPhoto {
    /// Prepares `photo` for classes `0..classes` with a tolerance in its own pixels.
    pub fn new(
        photo: &LabelImage,
        classes: usize,
        tolerance_px: f64,
        ignored_in_photo: &ClassSet,
        ignored_in_view: &ClassSet,
    ) -> Self {
        let width = photo.width() as usize;
        let skipped = |value: u8| value == ClassId::VOID.0 || ignored_in_photo.contains(ClassId(value));
        let compared = Bits::from_pixels(width, photo.values(), |value| !skipped(value));
        let classes = (0..classes)
            .map(|class| {
                let plane = Bits::from_pixels(width, photo.values(), |value| usize::from(value) == class);
                let boundary = plane.boundary().and(&compared);
                let near = boundary.dilated(tolerance_px);
                (boundary, near)
            })
            .collect();
        Self { tolerance_px, compared, classes, ignored_in_view: *ignored_in_view }
    }

    /// Adds the boundary counts of `view` (same size as the photo) to `counts`.
    pub fn add_counts(&self, view: &LabelImage, counts: &mut [ClassCounts]) {
        let width = view.width() as usize;
        for (class, (count, (boundary, near))) in counts.iter_mut().zip(&self.classes).enumerate() {
            let plane = Bits::from_pixels(width, view.values(), |value| usize::from(value) == class);
            if self.ignored_in_view.contains(ClassId(class as u8)) {
                continue;
            }
            let view_boundary = plane.boundary().and(&self.compared);
            count.photo_boundary = boundary.count();
            count.view_boundary = view_boundary.count();
            count.view_boundary_matched = view_boundary.count_and(near);
            if count.photo_boundary > 0 && count.view_boundary > 0 {
                count.photo_boundary_matched = boundary.count_and(&view_boundary.dilated(self.tolerance_px));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vertical edge at column `edge` of a 40 × 10 image: class 0 left, class 1 right.
    fn edge_at(edge: u32) -> LabelImage {
        let mut image = LabelImage::filled(40, 10, 0);
        for v in 0..10 {
            for u in edge..40 {
                image.set(u, v, 1);
            }
        }
        image
    }

    #[test]
    fn a_boundary_counts_as_found_up_to_the_tolerance_and_not_beyond() {
        let photo = BoundaryPhoto::new(&edge_at(20), 2, 3.0, &ClassSet::default(), &ClassSet::default());
        for (shift, matched) in [(0, 10), (3, 10), (4, 0)] {
            let mut counts = vec![ClassCounts::default(); 2];
            photo.add_counts(&edge_at(20 + shift), &mut counts);
            assert_eq!(counts[0].photo_boundary, 10, "one column of ten pixels");
            assert_eq!((counts[0].photo_boundary_matched, counts[0].view_boundary_matched), (matched, matched));
        }
    }
}
