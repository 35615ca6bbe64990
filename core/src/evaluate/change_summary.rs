//! Changes over many captures: found, false, off, made again, and how honest the stated 1σ is.

use super::bootstrap::{Bootstrap, Estimate};
use super::changes::{ChangeScore, ExpectedChange, FoundChange, Replacement};
use super::second_photo::SecondPhoto;
use super::share::Share;
use super::statistics::median;
use super::summary::Trial;
use resurvey_schema::changes::Op;
use serde::Serialize;
use std::collections::BTreeMap;

/// From this share on that nothing hides a change is expected to be found.
pub(super) const VISIBLE_SHARE: f64 = 0.8;
/// Up to this distance in plan a pose is near enough to ask how well a descriptor was placed, metres.
const GOOD_POSE_M: f64 = 1.0;
/// Multiple of 1σ within which 95 % of errors are expected.
const SIGMAS: f64 = 2.0;

/// Found of expected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ChangeTally {
    /// Changes that were found.
    pub found: usize,
    /// Changes that should have been.
    pub expected: usize,
}

impl ChangeTally {
    fn of<'a>(changes: impl IntoIterator<Item = &'a ExpectedChange>) -> Self {
        changes.into_iter().fold(Self::default(), |sum, change| Self {
            found: sum.found + usize::from(change.found.is_some()),
            expected: sum.expected + 1,
        })
    }
}

/// Median and worst of some absolute errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// How many there are.
    pub count: usize,
    /// Median.
    pub median: f64,
    /// Largest.
    pub worst: f64,
}

impl Spread {
    /// Of the absolute values of `errors`; `None` of none.
    pub fn of(errors: impl IntoIterator<Item = f64>) -> Option<Self> {
        let errors: Vec<f64> = errors.into_iter().map(f64::abs).collect();
        let worst = errors.iter().copied().max_by(f64::total_cmp)?;
        Some(Self { count: errors.len(), median: median(&errors)?, worst })
    }
}

/// Second photos of changed places, all together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SecondPhotos {
    /// Photos.
    pub photos: usize,
    /// Those with a reliable pose; the others change nothing.
    pub reliable: usize,
    /// Photos that changed again what had been found.
    pub changed_again: usize,
    /// Changes of them all.
    pub changes: usize,
    /// Changes of what had been found already.
    pub duplicates: usize,
    /// Changes of what never happened.
    pub false_updates: usize,
    /// Changes that the first photo had missed.
    pub newly_found: usize,
    /// Changes that took back what the first photo made up.
    pub corrected: usize,
}

impl SecondPhotos {
    /// The sum of `photos`; `None` of none.
    pub fn of<'a>(photos: impl IntoIterator<Item = &'a SecondPhoto>) -> Option<Self> {
        let sum = photos.into_iter().fold(Self::default(), |sum, photo| Self {
            photos: sum.photos + 1,
            reliable: sum.reliable + usize::from(photo.reliable),
            changed_again: sum.changed_again + usize::from(photo.duplicates > 0),
            changes: sum.changes + photo.changes,
            duplicates: sum.duplicates + photo.duplicates,
            false_updates: sum.false_updates + photo.false_updates,
            newly_found: sum.newly_found + photo.newly_found,
            corrected: sum.corrected + photo.corrected,
        });
        (sum.photos > 0).then_some(sum)
    }
}

/// Changes over many captures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChangeSummary {
    /// Material changes of captures in which at least 80 % of what changed can be seen.
    pub material: ChangeTally,
    /// Dynamic ones.
    pub dynamic: ChangeTally,
    /// Material ones that came.
    pub material_added: ChangeTally,
    /// Material ones that went.
    pub material_removed: ChangeTally,
    /// Dynamic ones that came.
    pub dynamic_added: ChangeTally,
    /// Dynamic ones that went.
    pub dynamic_removed: ChangeTally,
    /// Share of all of these that was found; `None` when none was expected.
    pub found: Option<Estimate>,
    /// Of these, why those that were missed were, and how many.
    pub missed: BTreeMap<String, usize>,
    /// Changes that were made, true and false.
    pub committed: usize,
    /// Changes that never happened.
    pub false_updates: usize,
    /// Those of the changes that were made, with Wilson's interval.
    pub false_of_committed: Option<Share>,
    /// Captures with a false update, of all captures.
    pub false_captures: Option<Share>,
    /// Captures without a true addition or removal.
    pub captures_without_change: usize,
    /// False updates per 100 of those.
    pub false_per_100_without_change: Option<Estimate>,
    /// Captures with a false update, of those.
    pub false_captures_without_change: Option<Share>,
    /// Median distance in plan of what was placed from where it is, metres.
    pub position_off_median_m: Option<f64>,
    /// The same with the worst, metres.
    pub position_off_m: Option<Spread>,
    /// The same where the pose is within 1 m in plan, metres.
    pub position_off_good_pose_m: Option<Spread>,
    /// Median of the absolute area errors of what was placed, per cent.
    pub area_error_median_pct: Option<f64>,
    /// The same with the worst, per cent.
    pub area_error_pct: Option<Spread>,
    /// Descriptors whose error in 3D is within two of the 1σ that they state; 0.95 is expected.
    pub position_within_2_sigma: Option<Share>,
    /// The same of the area.
    pub area_within_2_sigma: Option<Share>,
    /// Of the changes that replace what the map knew, at least 80 % visible, those that modified it.
    pub replaced_in_place: ChangeTally,
    /// Changes that left on the map what they replace.
    pub replaced_beside: usize,
    /// Captures that changed the map a second time, or failed to.
    pub not_idempotent: usize,
    /// Captures whose second run failed or was not reached.
    pub second_run_failed: usize,
    /// Other photos of the same places; `None` when there are none.
    pub second_photos: Option<SecondPhotos>,
}

impl ChangeSummary {
    /// Of the updates of `trials`, one a capture; `None` where none was run.
    pub fn of(trials: &[&Trial], bootstrap: &Bootstrap) -> Option<Self> {
        let scored =
            Scored { all: trials.iter().filter_map(|trial| Some((*trial, trial.changes.as_ref()?))).collect() };
        if scored.all.is_empty() {
            return None;
        }
        let tally = |picks: fn(&ExpectedChange) -> bool| ChangeTally::of(scored.visible().filter(|one| picks(one)));
        let false_updates = scored.scores().map(|score| score.false_updates.len()).sum();
        let committed = scored.found(f64::INFINITY).count() + false_updates;
        let is_false = |score: &ChangeScore| !score.false_updates.is_empty();
        let position_off_m = |pose_m| Spread::of(scored.found(pose_m).filter_map(|found| found.position_off_m));
        let area_error_pct = Spread::of(scored.found(f64::INFINITY).filter_map(|found| found.area_error_pct));
        let within = |of: fn(&FoundChange) -> Option<f64>| {
            Share::among(scored.found(f64::INFINITY).filter_map(|found| of(&found)).map(|sigmas| sigmas <= SIGMAS))
        };
        let replaced = |how: Replacement| move |found: &FoundChange| found.replacement == Some(how);
        let in_place = |change: &&ExpectedChange| change.found.as_ref().is_some_and(replaced(Replacement::InPlace));
        Some(Self {
            material: tally(|change| change.is_material),
            dynamic: tally(|change| !change.is_material),
            material_added: tally(|change| change.is_material && change.op != Op::Remove),
            material_removed: tally(|change| change.is_material && change.op == Op::Remove),
            dynamic_added: tally(|change| !change.is_material && change.op != Op::Remove),
            dynamic_removed: tally(|change| !change.is_material && change.op == Op::Remove),
            found: scored.found_share(bootstrap),
            missed: scored.missed(),
            committed,
            false_updates,
            false_of_committed: Share::new(false_updates, committed),
            false_captures: Share::among(scored.scores().map(is_false)),
            captures_without_change: scored.unchanged().count(),
            false_per_100_without_change: scored.false_per_100(bootstrap),
            false_captures_without_change: Share::among(scored.unchanged().map(is_false)),
            position_off_median_m: position_off_m(f64::INFINITY).map(|spread| spread.median),
            position_off_m: position_off_m(f64::INFINITY),
            position_off_good_pose_m: position_off_m(GOOD_POSE_M),
            area_error_median_pct: area_error_pct.map(|spread| spread.median),
            area_error_pct,
            position_within_2_sigma: within(|found| found.position_sigmas),
            area_within_2_sigma: within(|found| found.area_sigmas),
            replaced_in_place: ChangeTally {
                found: scored.visible().filter(in_place).count(),
                expected: scored.visible().filter(|change| change.is_replacement).count(),
            },
            replaced_beside: scored.found(f64::INFINITY).filter(replaced(Replacement::Beside)).count(),
            not_idempotent: scored.scores().filter(|score| score.second_run != Some(0)).count(),
            second_run_failed: scored.scores().filter(|score| score.second_run.is_none()).count(),
            second_photos: SecondPhotos::of(scored.scores().filter_map(|score| score.second_photo.as_ref())),
        })
    }
}

/// Trials with an update.
struct Scored<'a> {
    all: Vec<(&'a Trial, &'a ChangeScore)>,
}

impl<'a> Scored<'a> {
    fn scores(&self) -> impl Iterator<Item = &'a ChangeScore> {
        self.all.iter().map(|(_, score)| *score)
    }

    /// Changes that can be seen well.
    fn visible(&self) -> impl Iterator<Item = &'a ExpectedChange> {
        self.scores().filter(|score| score.visible_share >= VISIBLE_SHARE).flat_map(|score| &score.expected)
    }

    /// What was found where the pose is at most `pose_m` off; all of it for infinity.
    fn found(&self, pose_m: f64) -> impl Iterator<Item = FoundChange> {
        let near = self.all.iter().filter(move |(trial, _)| trial.position_m() <= pose_m);
        near.flat_map(|(_, score)| &score.expected).filter_map(|change| change.found)
    }

    fn unchanged(&self) -> impl Iterator<Item = &'a ChangeScore> {
        self.scores().filter(|score| score.expected.is_empty())
    }

    fn found_share(&self, bootstrap: &Bootstrap) -> Option<Estimate> {
        let tallies: Vec<ChangeTally> = self.scores().filter_map(visible_tally).collect();
        bootstrap.estimate(tallies.len(), |sample| {
            let sum = |pick: fn(&ChangeTally) -> usize| sample.iter().map(|&i| pick(&tallies[i])).sum::<usize>();
            sum(|tally| tally.found) as f64 / sum(|tally| tally.expected) as f64
        })
    }

    fn missed(&self) -> BTreeMap<String, usize> {
        let mut missed = BTreeMap::new();
        for why in self.visible().filter_map(|change| change.why_missed.as_ref()) {
            *missed.entry(why.clone()).or_default() += 1;
        }
        missed
    }

    fn false_per_100(&self, bootstrap: &Bootstrap) -> Option<Estimate> {
        let counts: Vec<f64> = self.unchanged().map(|score| score.false_updates.len() as f64).collect();
        bootstrap.estimate(counts.len(), |sample| {
            100.0 * sample.iter().map(|&i| counts[i]).sum::<f64>() / sample.len() as f64
        })
    }
}

/// Found and expected of one capture; `None` where less than 80 % of what changed can be seen.
pub(super) fn visible_tally(score: &ChangeScore) -> Option<ChangeTally> {
    (score.visible_share >= VISIBLE_SHARE).then(|| ChangeTally::of(&score.expected))
}

#[cfg(test)]
mod tests {
    use super::super::changes::tests::{ADDED, BANNER, GONE, chair, material, score, truth};
    use super::super::summary::tests::{answered, silent};
    use super::*;
    use crate::update::Change;

    fn trial(east_m: f64, changes: ChangeScore) -> Trial {
        Trial { changes: Some(changes), ..answered(east_m, 0.0, true) }
    }

    fn summary(trials: &[Trial]) -> ChangeSummary {
        ChangeSummary::of(&trials.iter().collect::<Vec<_>>(), &Bootstrap::default()).unwrap()
    }

    #[test]
    fn a_summary_counts_what_can_be_seen_and_what_never_happened() {
        let truth_of_both = truth(&[ADDED, GONE].join(","));
        let mut good = score(&truth_of_both, &[Change::Add(material(BANNER, 3.0, 0.2))]);
        good.second_run = Some(0);
        good.expected[1].why_missed = Some("uncertain".to_owned());
        let hidden = ChangeScore { visible_share: 0.71, ..score(&truth(ADDED), &[]) };
        let wrong = ChangeScore { second_run: Some(0), ..score(&truth(""), &[Change::Add(chair(3.0, 3.0))]) };
        let summary = summary(&[trial(0.1, good), trial(0.1, hidden), trial(0.1, wrong)]);
        assert_eq!(summary.material, ChangeTally { found: 1, expected: 1 });
        assert_eq!(summary.dynamic, ChangeTally { found: 0, expected: 1 });
        assert_eq!((summary.material_added, summary.dynamic_removed), (summary.material, summary.dynamic));
        assert_eq!((summary.material_removed, summary.dynamic_added), (ChangeTally::default(), ChangeTally::default()));
        assert!((summary.found.unwrap().value - 0.5).abs() < 1e-12);
        assert_eq!(summary.missed, BTreeMap::from([("uncertain".to_owned(), 1)]));
        assert_eq!((summary.committed, summary.false_updates, summary.captures_without_change), (2, 1, 1));
        assert!((summary.false_per_100_without_change.unwrap().value - 100.0).abs() < 1e-9);
        assert!((summary.position_off_median_m.unwrap() - 0.2).abs() < 1e-9);
        assert!(summary.area_error_median_pct.unwrap().abs() < 1e-9);
        assert_eq!((summary.not_idempotent, summary.second_run_failed, summary.second_photos), (1, 1, None));
        // Wilson, z² = 3.8415: 1 of 2 is 0.5 ± 1.96·√(1/8 + z²/16)/(1 + z²/2) = 0.5 ± 0.4055; 1 of 1 is from 1/(1 + z²).
        let of_committed = summary.false_of_committed.unwrap();
        assert!((of_committed.low - 0.0945).abs() < 1e-4 && (of_committed.high - 0.9055).abs() < 1e-4);
        let without_change = summary.false_captures_without_change.unwrap();
        assert!((without_change.low - 0.2065).abs() < 1e-4 && (without_change.high - 1.0).abs() < 1e-12);
        let captures = summary.false_captures.unwrap();
        assert_eq!((captures.count, captures.of), (1, 3));
    }

    #[test]
    fn how_well_a_descriptor_is_placed_is_asked_where_the_pose_is_good() {
        let placed = |east_m| score(&truth(ADDED), &[Change::Add(material(BANNER, 3.0, east_m))]);
        let summary = summary(&[trial(0.5, placed(0.2)), trial(0.9, placed(-0.4)), trial(1.5, placed(1.4))]);
        let is = |spread: Option<Spread>, (count, median, worst): (usize, f64, f64)| {
            let spread = spread.unwrap();
            assert!((spread.median - median).abs() < 1e-9 && (spread.worst - worst).abs() < 1e-9, "{spread:?}");
            assert_eq!(spread.count, count);
        };
        is(summary.position_off_m, (3, 0.4, 1.4));
        is(summary.position_off_good_pose_m, (2, 0.3, 0.4));
        assert_eq!(Spread::of([]), None);
    }

    #[test]
    fn sigmas_are_honest_when_95_of_100_errors_are_within_two_of_them() {
        let stated = |sigmas: Option<f64>| {
            let mut score = score(&truth(ADDED), &[Change::Add(material(BANNER, 3.0, 0.0))]);
            score.expected[0].found.as_mut().unwrap().position_sigmas = sigmas;
            trial(0.0, score)
        };
        let summary = summary(&[stated(Some(0.5)), stated(Some(1.9)), stated(Some(2.1)), stated(None)]);
        let within = summary.position_within_2_sigma.unwrap();
        assert_eq!((within.count, within.of, summary.area_within_2_sigma), (2, 3, None));
    }

    #[test]
    fn replacements_and_second_photos_are_summed() {
        let replaced = |how| {
            let mut score = score(&truth(ADDED), &[Change::Add(material(BANNER, 3.0, 0.0))]);
            score.expected[0].is_replacement = true;
            score.expected[0].found.as_mut().unwrap().replacement = Some(how);
            score
        };
        let mut first = replaced(Replacement::InPlace);
        let photo = SecondPhoto { reliable: true, changes: 3, duplicates: 2, newly_found: 1, ..Default::default() };
        first.second_photo = Some(photo);
        let mut second = replaced(Replacement::Beside);
        second.second_photo = Some(SecondPhoto::default());
        let summary = summary(&[trial(0.0, first), trial(0.0, second), silent()]);
        assert_eq!(summary.replaced_in_place, ChangeTally { found: 1, expected: 2 });
        assert_eq!(summary.replaced_beside, 1);
        let expected = SecondPhotos {
            photos: 2,
            reliable: 1,
            changed_again: 1,
            changes: 3,
            duplicates: 2,
            newly_found: 1,
            ..SecondPhotos::default()
        };
        assert_eq!(summary.second_photos, Some(expected));
        assert_eq!(ChangeSummary::of(&[&silent()], &Bootstrap::default()), None);
    }
}
