//! Joint histogram of two label images: everything that Dice and Jaccard need.

use crate::image::LabelImage;
use resurvey_schema::ClassId;
use resurvey_schema::service::{ClassCounts, ClassSet};

/// Length of a count vector that is indexed by class: one more than the largest class of `photo` and `view`, void left
/// out.
pub fn class_count(largest: ClassId) -> usize {
    usize::from(largest.0.min(254)) + 1
}

/// |A|, |B| and |A∩B| per class over the compared pixels: the photo's class is not void and not in `ignored_in_photo`,
/// the view's class not void and not in `ignored_in_view`. Both images have the same size; classes at or above
/// `classes` are not compared.
pub fn overlap_counts(
    photo: &LabelImage,
    view: &LabelImage,
    classes: usize,
    ignored_in_photo: &ClassSet,
    ignored_in_view: &ClassSet,
) -> Vec<ClassCounts> {
    let side = classes + 1;
    let mut joint = vec![0_u32; side * side];
    for (&a, &b) in photo.values().iter().zip(view.values()) {
        joint[usize::from(a).min(classes) * side + usize::from(b).min(classes)] += 1;
    }
    let compared = |set: &ClassSet, class: usize| class < classes && !set.contains(ClassId(class as u8));
    let mut counts = vec![ClassCounts::default(); classes];
    for a in (0..classes).filter(|&a| compared(ignored_in_photo, a)) {
        for b in (0..classes).filter(|&b| compared(ignored_in_view, b)) {
            let pixels = joint[a * side + b];
            counts[a].photo += pixels;
            counts[b].view += pixels;
            if a == b {
                counts[a].both += pixels;
            }
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(values: &[u8]) -> LabelImage {
        LabelImage::from_values(values.len() as u32, 1, values.to_vec()).unwrap()
    }

    #[test]
    fn void_and_ignored_pixels_are_not_compared() {
        let mut foliage = ClassSet::default();
        foliage.insert(ClassId(7));
        let counts =
            overlap_counts(&image(&[0, 0, 1, 7, 255]), &image(&[0, 1, 1, 1, 1]), 9, &foliage, &ClassSet::default());
        assert_eq!((counts[0].photo, counts[0].view, counts[0].both), (2, 1, 1));
        assert_eq!((counts[1].photo, counts[1].view, counts[1].both), (1, 2, 1));
        assert_eq!((counts[7].photo, counts[7].view), (0, 0));
    }
}
