//! One number from the counts of all classes: how alike photo and view are.

use crate::settings::{ClassWeights, Settings};
use resurvey_plugin::schema::{ClassId, ClassKind, ClassTable};
use resurvey_plugin::{ClassCounts, ClassSet, score};

/// Which classes are left out of the comparison because the map cannot know them.
pub struct Compared {
    /// Classes of the photo that are left out.
    pub ignored_in_photo: ClassSet,
    /// Classes of the view that are left out.
    pub ignored_in_view: ClassSet,
    /// One more than the largest class index.
    pub classes: usize,
}

impl Compared {
    /// The choice of `settings` for the map's class table.
    pub fn new(table: &ClassTable, settings: &Settings) -> Self {
        let mut ignored = ClassSet::default();
        for class in table.iter() {
            let foliage = class.name == "foliage" && settings.ignore_foliage;
            if foliage || (class.kind == ClassKind::Dynamic && settings.ignore_dynamic) {
                ignored.insert(class.index);
            }
        }
        let classes = table.iter().map(|class| usize::from(class.index.0) + 1).max().unwrap_or(0);
        Self { ignored_in_photo: ignored, ignored_in_view: ClassSet::default(), classes }
    }

    /// Whether a pixel of the photo with this class takes part.
    pub fn in_photo(&self, class: ClassId) -> bool {
        class != ClassId::VOID && !self.ignored_in_photo.contains(class)
    }

    /// Whether a pixel of the view with this class takes part.
    pub fn in_view(&self, class: ClassId) -> bool {
        class != ClassId::VOID && !self.ignored_in_view.contains(class)
    }
}

/// The weighted score of `settings`.
#[derive(Clone, Copy, Debug)]
pub struct Likeness {
    dice: f64,
    jaccard: f64,
    boundary_f1: f64,
    agreement: f64,
    class_weights: ClassWeights,
}

impl Likeness {
    /// The weights of `settings`; all zero means agreement alone.
    pub fn new(settings: &Settings) -> Self {
        let Settings { dice, jaccard, boundary_f1, agreement, class_weights, .. } = *settings;
        let none = dice + jaccard + boundary_f1 + agreement <= 0.0;
        Self { dice, jaccard, boundary_f1, agreement: if none { 1.0 } else { agreement }, class_weights }
    }

    /// The score of a view, 0–1; 0 when nothing could be compared.
    pub fn of_view(&self, counts: &[ClassCounts]) -> f64 {
        self.score(counts, self.boundary_f1)
    }

    /// The score of a panorama, 0–1: the same without boundaries, which panoramas do not count.
    pub fn of_panorama(&self, counts: &[ClassCounts]) -> f64 {
        self.score(counts, 0.0)
    }

    fn score(&self, counts: &[ClassCounts], boundary_f1: f64) -> f64 {
        let mut per_class = 0.0;
        let mut weight_sum = 0.0;
        let (mut equal, mut all) = (0_u64, 0_u64);
        for count in counts {
            equal += u64::from(count.both);
            all += u64::from(count.photo);
            let Some(dice) = score::dice(count) else { continue };
            let weight = match self.class_weights {
                ClassWeights::Area => f64::from(count.photo),
                ClassWeights::Equal => 1.0,
            };
            let jaccard = score::jaccard(count).unwrap_or(0.0);
            // A class without a boundary in either image fills both: they agree.
            let boundary = if boundary_f1 > 0.0 { score::boundary_f1(count).unwrap_or(1.0) } else { 0.0 };
            per_class += weight * (self.dice * dice + self.jaccard * jaccard + boundary_f1 * boundary);
            weight_sum += weight;
        }
        if weight_sum <= 0.0 || all == 0 {
            return 0.0;
        }
        let weights = self.dice + self.jaccard + boundary_f1 + self.agreement;
        if weights <= 0.0 {
            return equal as f64 / all as f64;
        }
        (per_class / weight_sum + self.agreement * equal as f64 / all as f64) / weights
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::settings::tests::defaults;

    /// Everything is compared.
    pub(crate) fn nothing_ignored() -> Compared {
        Compared { ignored_in_photo: ClassSet::default(), ignored_in_view: ClassSet::default(), classes: 9 }
    }

    fn counts(values: [(u32, u32, u32); 2]) -> Vec<ClassCounts> {
        values.map(|(photo, view, both)| ClassCounts { photo, view, both, ..ClassCounts::default() }).to_vec()
    }

    #[test]
    fn large_classes_weigh_more_than_small_ones() {
        let likeness = Likeness::new(&defaults());
        let large_right = likeness.of_view(&counts([(90, 90, 90), (10, 10, 0)]));
        let small_right = likeness.of_view(&counts([(90, 90, 0), (10, 10, 10)]));
        assert!((large_right - 0.9).abs() < 1e-12 && (small_right - 0.1).abs() < 1e-12);
    }

    #[test]
    fn nothing_to_compare_scores_zero() {
        assert!(Likeness::new(&defaults()).of_view(&counts([(0, 0, 0), (0, 0, 0)])).abs() < 1e-12);
    }
}
