//! Dice, Jaccard and boundary F1 of one class, from the counts that the host's comparisons return (Lee & Hsu, Eq. 5).
//! `None` where the class is in neither image.

use resurvey_schema::service::ClassCounts;

/// 2|A∩B| / (|A| + |B|); Dice 1945.
pub fn dice(counts: &ClassCounts) -> Option<f64> {
    ratio(2.0 * f64::from(counts.both), f64::from(counts.photo) + f64::from(counts.view))
}

/// |A∩B| / |A∪B|; Jaccard 1901. Equals D / (2 − D).
pub fn jaccard(counts: &ClassCounts) -> Option<f64> {
    ratio(f64::from(counts.both), f64::from(counts.photo) + f64::from(counts.view) - f64::from(counts.both))
}

/// 2PR / (P + R), P the share of the view's boundary near the photo's, R the reverse; Csurka et al., BMVC 2013.
pub fn boundary_f1(counts: &ClassCounts) -> Option<f64> {
    if counts.photo_boundary == 0 && counts.view_boundary == 0 {
        return None;
    }
    let precision = ratio(f64::from(counts.view_boundary_matched), f64::from(counts.view_boundary)).unwrap_or(0.0);
    let recall = ratio(f64::from(counts.photo_boundary_matched), f64::from(counts.photo_boundary)).unwrap_or(0.0);
    Some(ratio(2.0 * precision * recall, precision + recall).unwrap_or(0.0))
}

fn ratio(part: f64, whole: f64) -> Option<f64> {
    (whole > 0.0).then(|| part / whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn jaccard_is_dice_over_two_minus_dice(photo in 0_u32..1000, view in 0_u32..1000, share in 0.0_f64..=1.0) {
            let both = (f64::from(photo.min(view)) * share) as u32;
            let counts = ClassCounts { photo, view, both, ..ClassCounts::default() };
            match (dice(&counts), jaccard(&counts)) {
                (Some(d), Some(j)) => prop_assert!((j - d / (2.0 - d)).abs() < 1e-12),
                (d, j) => prop_assert_eq!(d, j),
            }
        }
    }

    #[test]
    fn a_class_in_one_image_only_scores_zero_and_in_neither_is_left_out() {
        let only_photo = ClassCounts { photo: 5, photo_boundary: 4, ..ClassCounts::default() };
        assert_eq!(
            (dice(&only_photo), jaccard(&only_photo), boundary_f1(&only_photo)),
            (Some(0.0), Some(0.0), Some(0.0))
        );
        let neither = ClassCounts::default();
        assert_eq!((dice(&neither), jaccard(&neither), boundary_f1(&neither)), (None, None, None));
    }
}
