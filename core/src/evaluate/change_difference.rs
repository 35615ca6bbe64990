//! Whether one contender updates better than another: both on the same captures, difference by difference.

use super::bootstrap::{Bootstrap, Estimate};
use super::change_summary::{ChangeTally, visible_tally};
use super::changes::ChangeScore;
use super::summary::Trial;
use serde::Serialize;

/// The updates of one contender against those of another. An interval that leaves out 0 says that the difference is more
/// than chance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChangeDifference {
    /// Share found of what is at least 80 % visible, above that of the other; `None` when nothing was to be found.
    pub found: Option<Estimate>,
    /// False updates a capture, above that of the other.
    pub false_per_capture: Estimate,
    /// Mean of how much further in plan a change is placed than by the other, metres, over those that both placed.
    pub position_off_m: Option<Estimate>,
}

impl ChangeDifference {
    /// Of `own` above `other`, trials of the same captures in the same order; `None` where no update was run.
    pub fn of(own: &[&Trial], other: &[&Trial], bootstrap: &Bootstrap) -> Option<Self> {
        let both =
            own.iter().zip(other).filter_map(|(own, other)| Some((own.changes.as_ref()?, other.changes.as_ref()?)));
        let both: Vec<(&ChangeScore, &ChangeScore)> = both.collect();
        let false_updates: Vec<f64> =
            both.iter().map(|(own, other)| own.false_updates.len() as f64 - other.false_updates.len() as f64).collect();
        let false_per_capture = bootstrap.estimate(false_updates.len(), |sample| {
            sample.iter().map(|&i| false_updates[i]).sum::<f64>() / sample.len() as f64
        })?;
        Some(Self {
            found: found_difference(&both, bootstrap),
            false_per_capture,
            position_off_m: position_difference(&both, bootstrap),
        })
    }
}

fn found_difference(both: &[(&ChangeScore, &ChangeScore)], bootstrap: &Bootstrap) -> Option<Estimate> {
    let tallies = both.iter().filter_map(|(own, other)| Some((visible_tally(own)?, visible_tally(other)?)));
    let tallies: Vec<(ChangeTally, ChangeTally)> = tallies.collect();
    bootstrap.estimate(tallies.len(), |sample| {
        let drawn = || sample.iter().map(|&i| &tallies[i]);
        let found = drawn().map(|(own, other)| own.found as f64 - other.found as f64).sum::<f64>();
        found / drawn().map(|(own, _)| own.expected as f64).sum::<f64>()
    })
}

fn position_difference(both: &[(&ChangeScore, &ChangeScore)], bootstrap: &Bootstrap) -> Option<Estimate> {
    // Sum and number of differences of each capture: captures are drawn, not changes.
    let of_capture = |(own, other): &(&ChangeScore, &ChangeScore)| {
        let pairs = own.expected.iter().zip(&other.expected);
        let differences =
            pairs.filter_map(|(own, other)| Some(own.found?.position_off_m? - other.found?.position_off_m?));
        differences.fold((0.0, 0.0), |(sum, count), difference| (sum + difference, count + 1.0))
    };
    let captures: Vec<(f64, f64)> = both.iter().map(of_capture).filter(|(_, count)| *count > 0.0).collect();
    bootstrap.estimate(captures.len(), |sample| {
        let (sum, count) =
            sample.iter().fold((0.0, 0.0), |(sum, count), &i| (sum + captures[i].0, count + captures[i].1));
        sum / count
    })
}

#[cfg(test)]
mod tests {
    use super::super::changes::tests::{ADDED, BANNER, chair, material, score, truth};
    use super::super::summary::tests::{answered, silent};
    use super::*;
    use crate::update::Change;

    fn trial(made: &[Change]) -> Trial {
        Trial { changes: Some(score(&truth(ADDED), made)), ..answered(0.0, 0.0, true) }
    }

    fn difference(own: &[Trial], other: &[Trial]) -> Option<ChangeDifference> {
        let lent = |trials: &'static [Trial]| trials.iter().collect::<Vec<_>>();
        let [own, other] = [own, other].map(|trials| lent(Box::leak(trials.to_vec().into_boxed_slice())));
        ChangeDifference::of(&own, &other, &Bootstrap::default())
    }

    fn banner(east_m: f64) -> Change {
        Change::Add(material(BANNER, 3.0, east_m))
    }

    #[test]
    fn what_one_finds_and_makes_up_more_than_the_other_is_counted_capture_by_capture() {
        // Own finds 3 of 4, the other 2 of 4: 0.25; own makes up one in four captures, the other none: 0.25.
        let own = [
            trial(&[banner(0.1)]),
            trial(&[banner(0.3)]),
            trial(&[banner(0.0), Change::Add(chair(40.0, 0.0))]),
            trial(&[]),
        ];
        let other = [trial(&[banner(0.2)]), trial(&[]), trial(&[banner(0.5)]), trial(&[])];
        let found = difference(&own, &other).unwrap();
        assert!((found.found.unwrap().value - 0.25).abs() < 1e-12);
        assert!((found.false_per_capture.value - 0.25).abs() < 1e-12);
        // Both placed two: 0.1 − 0.2 and 0.0 − 0.5, the mean is −0.3; either alone bounds the resamples.
        let position = found.position_off_m.unwrap();
        assert!((position.value + 0.3).abs() < 1e-9, "{position:?}");
        assert!((position.low + 0.5).abs() < 1e-9 && (position.high + 0.1).abs() < 1e-9, "{position:?}");
    }

    #[test]
    fn without_updates_there_is_nothing_to_compare() {
        assert_eq!(difference(&[silent()], &[silent()]), None);
        let same = difference(&[trial(&[])], &[trial(&[])]).unwrap();
        assert_eq!((same.position_off_m, same.found.map(|found| found.value.abs() < 1e-12)), (None, Some(true)));
    }
}
