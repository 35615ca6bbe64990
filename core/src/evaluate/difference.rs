//! Whether one matcher is better than another: both on the same captures, difference by difference.

use super::bootstrap::{Bootstrap, Estimate};
use super::change_difference::ChangeDifference;
use super::pose_error::Level;
use super::summary::Trial;
use serde::Serialize;
use std::cmp::Ordering;

/// One matcher against another on the same captures. An interval that leaves out 0 (0.5 for [`nearer`](Self::nearer))
/// says that the difference is more than chance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Recall at 1 m and 1° above that of the other.
    pub recall_1m_1deg: Estimate,
    /// Recall at 2 m and 2° above that of the other.
    pub recall_2m_2deg: Estimate,
    /// Recall at 5 m and 5° above that of the other.
    pub recall_5m_5deg: Estimate,
    /// Share of captures on which the answer is nearer to the truth in plan than the other's; ties, such as two captures
    /// without an answer, count half.
    pub nearer: Estimate,
    /// What their updates differ in; `None` where none was run.
    pub changes: Option<ChangeDifference>,
}

impl Difference {
    /// Of `own` above `other`, trials of the same captures in the same order; `None` for none or of another number.
    pub fn of(own: &[&Trial], other: &[&Trial], bootstrap: &Bootstrap) -> Option<Self> {
        if own.len() != other.len() {
            return None;
        }
        let mean = |of: &dyn Fn(&Trial, &Trial) -> f64| {
            let values: Vec<f64> = own.iter().zip(other).map(|(own, other)| of(own, other)).collect();
            let mean = |sample: &[usize]| sample.iter().map(|&i| values[i]).sum::<f64>() / sample.len() as f64;
            bootstrap.estimate(values.len(), mean)
        };
        let recall = |level| {
            let hit = |trial: &Trial| f64::from(u8::from(trial.is_within(level)));
            mean(&|own, other| hit(own) - hit(other))
        };
        let [recall_1m_1deg, recall_2m_2deg, recall_5m_5deg] = Level::ALL.map(recall);
        let nearer = mean(&|own, other| match own.position_m().total_cmp(&other.position_m()) {
            Ordering::Less => 1.0,
            Ordering::Equal => 0.5,
            Ordering::Greater => 0.0,
        });
        Some(Self {
            recall_1m_1deg: recall_1m_1deg?,
            recall_2m_2deg: recall_2m_2deg?,
            recall_5m_5deg: recall_5m_5deg?,
            nearer: nearer?,
            changes: ChangeDifference::of(own, other, bootstrap),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::summary::tests::{answered, silent};
    use super::*;

    fn difference(own: &[Trial], other: &[Trial]) -> Option<Difference> {
        let lent = |trials: &[Trial]| -> Vec<&'static Trial> {
            trials.iter().map(|trial| -> &'static Trial { Box::leak(Box::new(trial.clone())) }).collect()
        };
        Difference::of(&lent(own), &lent(other), &Bootstrap::default())
    }

    #[test]
    fn pairing_finds_a_small_difference_that_two_separate_intervals_hide() {
        // Both fail on the same half; the first is within 1 m on a tenth more. Paired: 0.1 ± 1.96·√(0.09/100) = 0.059.
        let other: Vec<Trial> = (0..100).map(|i| answered(if i < 50 { 0.5 } else { 9.0 }, 0.0, true)).collect();
        let own: Vec<Trial> = (0..100).map(|i| answered(if i < 60 { 0.5 } else { 9.0 }, 0.0, true)).collect();
        let found = difference(&own, &other).unwrap();
        let Estimate { value, low, high } = found.recall_1m_1deg;
        assert!((value - 0.1).abs() < 1e-12);
        assert!((low - 0.041).abs() < 0.015 && (high - 0.159).abs() < 0.015, "{low} to {high}");
        assert!((found.nearer.value - 0.55).abs() < 1e-12 && found.nearer.low > 0.5);
    }

    #[test]
    fn a_matcher_is_no_better_than_itself_even_without_an_answer() {
        let trials = [answered(0.5, 0.0, true), silent(), answered(3.0, 8.0, false)];
        let found = difference(&trials, &trials).unwrap();
        for estimate in [found.recall_1m_1deg, found.recall_2m_2deg, found.recall_5m_5deg] {
            assert!([estimate.value, estimate.low, estimate.high].iter().all(|end| end.abs() < 1e-12));
        }
        assert!((found.nearer.value - 0.5).abs() < 1e-12 && (found.nearer.high - 0.5).abs() < 1e-12);
        assert_eq!(difference(&trials, &trials[..2]), None);
    }

    #[test]
    fn any_answer_is_nearer_than_none() {
        let found = difference(&[answered(100.0, 0.0, false)], &[silent()]).unwrap();
        assert!((found.nearer.value - 1.0).abs() < 1e-12);
    }
}
