//! One matcher over many captures, in numbers.

use super::bootstrap::{Bootstrap, Estimate};
use super::change_summary::ChangeSummary;
use super::changes::ChangeScore;
use super::nees::Consistency;
use super::pose_error::{Level, PoseError};
use super::statistics::{mean, median, quantile};
use serde::Serialize;

/// A reliable answer further off than this is wrong, metres.
const WRONG_M: f64 = 5.0;

/// A pose that was found, against the true one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Its error.
    pub error: PoseError,
    /// Whether the reliability gate let it pass.
    pub is_reliable: bool,
    /// Its normalised error squared, where its covariance can be inverted.
    pub nees: Option<f64>,
}

/// One matcher on one capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Its answer; a capture without one counts as infinitely wrong.
    pub answer: Option<Answer>,
    /// How long it took.
    pub seconds: f64,
    /// What the update made of it; `None` where none was run.
    pub changes: Option<ChangeScore>,
}

impl Trial {
    /// Distance of the answer from the truth in plan, metres; infinite without an answer.
    pub fn position_m(&self) -> f64 {
        self.answer.map_or(f64::INFINITY, |answer| answer.error.position_m())
    }

    /// Absolute error of the heading, degrees; infinite without an answer.
    pub fn yaw_deg(&self) -> f64 {
        self.answer.map_or(f64::INFINITY, |answer| answer.error.yaw_deg().abs())
    }

    /// Whether there is an answer within `level`.
    pub fn is_within(&self, level: Level) -> bool {
        self.answer.is_some_and(|answer| answer.error.is_within(level))
    }

    /// Whether there is an answer that may change the map.
    pub fn is_reliable(&self) -> bool {
        self.answer.is_some_and(|answer| answer.is_reliable)
    }

    /// Whether an answer that may change the map is more than 5 m off.
    pub fn is_wrong_but_reliable(&self) -> bool {
        self.is_reliable() && self.position_m() > WRONG_M
    }
}

/// One matcher over captures. Intervals are 95 %, by bootstrap over captures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Number of captures.
    pub captures: usize,
    /// Captures with an answer.
    pub answered: usize,
    /// Share of captures within 1 m and 1°.
    pub recall_1m_1deg: Estimate,
    /// Share of captures within 2 m and 2°.
    pub recall_2m_2deg: Estimate,
    /// Share of captures within 5 m and 5°.
    pub recall_5m_5deg: Estimate,
    /// Median distance in plan over all captures, metres.
    pub median_m: Estimate,
    /// The same for the worst tenth, metres.
    pub ninth_decile_m: Estimate,
    /// Mean distance in plan over captures with an answer, metres; `None` when none has.
    pub mean_m: Option<Estimate>,
    /// Median absolute error of the heading over all captures, degrees.
    pub median_deg: Estimate,
    /// Mean absolute error of the heading over captures with an answer, degrees.
    pub mean_deg: Option<Estimate>,
    /// Share of captures with a reliable answer.
    pub coverage: Estimate,
    /// Captures within 2 m.
    pub within_2m: usize,
    /// Of those, how many answers are called reliable.
    pub within_2m_reliable: usize,
    /// Answers that are called reliable and are more than 5 m off.
    pub wrong_but_reliable: usize,
    /// How errors compare with covariances, of all answers.
    pub nees: Option<Consistency>,
    /// The same of reliable answers.
    pub nees_reliable: Option<Consistency>,
    /// Median time of an answer, seconds.
    pub median_seconds: f64,
    /// What updates came to; `None` where none was run.
    pub changes: Option<ChangeSummary>,
}

impl Summary {
    /// Of `trials`, one a capture; `None` for none.
    pub fn of(trials: &[&Trial], bootstrap: &Bootstrap) -> Option<Self> {
        let measured = Measured { trials, bootstrap };
        let [recall_1m_1deg, recall_2m_2deg, recall_5m_5deg] =
            Level::ALL.map(|level| measured.share(|trial| trial.is_within(level)));
        let within_2m = || trials.iter().filter(|trial| trial.position_m() <= 2.0);
        let seconds: Vec<f64> = trials.iter().map(|trial| trial.seconds).collect();
        Some(Self {
            captures: trials.len(),
            answered: trials.iter().filter(|trial| trial.answer.is_some()).count(),
            recall_1m_1deg: recall_1m_1deg?,
            recall_2m_2deg: recall_2m_2deg?,
            recall_5m_5deg: recall_5m_5deg?,
            median_m: measured.statistic(Trial::position_m, median)?,
            ninth_decile_m: measured.statistic(Trial::position_m, |values| quantile(values, 0.9))?,
            mean_m: measured.statistic(Trial::position_m, mean),
            median_deg: measured.statistic(Trial::yaw_deg, median)?,
            mean_deg: measured.statistic(Trial::yaw_deg, mean),
            coverage: measured.share(Trial::is_reliable)?,
            within_2m: within_2m().count(),
            within_2m_reliable: within_2m().filter(|trial| trial.is_reliable()).count(),
            wrong_but_reliable: trials.iter().filter(|trial| trial.is_wrong_but_reliable()).count(),
            nees: measured.consistency(|_| true),
            nees_reliable: measured.consistency(|answer| answer.is_reliable),
            median_seconds: median(&seconds)?,
            changes: ChangeSummary::of(trials, bootstrap),
        })
    }
}

struct Measured<'a> {
    trials: &'a [&'a Trial],
    bootstrap: &'a Bootstrap,
}

impl Measured<'_> {
    fn share(&self, holds: impl Fn(&Trial) -> bool) -> Option<Estimate> {
        self.statistic(|trial| f64::from(u8::from(holds(trial))), mean)
    }

    fn statistic(&self, of: impl Fn(&Trial) -> f64, over: impl Fn(&[f64]) -> Option<f64>) -> Option<Estimate> {
        let values: Vec<f64> = self.trials.iter().map(|trial| of(trial)).collect();
        let mut drawn = Vec::with_capacity(values.len());
        self.bootstrap.estimate(values.len(), |sample| {
            drawn.clear();
            drawn.extend(sample.iter().map(|&index| values[index]));
            over(&drawn).unwrap_or(f64::NAN)
        })
    }

    fn consistency(&self, counts: impl Fn(&Answer) -> bool) -> Option<Consistency> {
        let answers = self.trials.iter().filter_map(|trial| trial.answer).filter(counts);
        Consistency::of(&answers.filter_map(|answer| answer.nees).collect::<Vec<_>>())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// An answer `east_m` and `yaw_deg` off.
    pub fn answered(east_m: f64, yaw_deg: f64, is_reliable: bool) -> Trial {
        let error = PoseError { east_m, north_m: 0.0, up_m: 0.0, yaw_rad: yaw_deg.to_radians() };
        Trial { answer: Some(Answer { error, is_reliable, nees: Some(3.0) }), seconds: 2.0, changes: None }
    }

    /// No answer.
    pub fn silent() -> Trial {
        Trial { answer: None, seconds: 4.0, changes: None }
    }

    fn summary(trials: &[Trial]) -> Summary {
        Summary::of(&trials.iter().collect::<Vec<_>>(), &Bootstrap::default()).unwrap()
    }

    #[test]
    fn a_capture_without_an_answer_is_infinitely_wrong() {
        let found = summary(&[answered(0.1, 0.1, true), silent()]);
        assert_eq!((found.captures, found.answered), (2, 1));
        assert!(found.median_m.value.is_infinite() && found.median_deg.value.is_infinite());
        assert!((found.mean_m.unwrap().value - 0.1).abs() < 1e-12);
        assert!((found.recall_5m_5deg.value - 0.5).abs() < 1e-12);
        assert!(!found.median_m.low.is_nan() && !found.median_m.high.is_nan());
        let document = serde_json::to_value(&found).unwrap();
        assert!(document["median_m"]["value"].is_null() && document["mean_m"]["value"].is_number());
    }

    #[test]
    fn a_matcher_that_never_answers_has_no_mean_and_no_recall() {
        let found = summary(&[silent(), silent()]);
        assert_eq!((found.answered, found.mean_m, found.nees), (0, None, None));
        assert!(found.recall_5m_5deg.high.abs() < 1e-12 && found.ninth_decile_m.low.is_infinite());
        assert_eq!(Summary::of(&[], &Bootstrap::default()), None);
    }

    #[test]
    fn recall_needs_position_and_heading_and_coverage_the_gate() {
        let trials =
            [answered(0.5, 0.5, true), answered(1.5, 0.5, false), answered(0.5, -4.0, true), answered(6.0, 0.0, true)];
        let found = summary(&trials);
        let recall = [found.recall_1m_1deg, found.recall_2m_2deg, found.recall_5m_5deg].map(|share| share.value);
        assert!(recall.iter().zip([0.25, 0.5, 0.75]).all(|(a, b)| (a - b).abs() < 1e-12), "{recall:?}");
        assert!((found.coverage.value - 0.75).abs() < 1e-12);
        assert_eq!((found.within_2m, found.within_2m_reliable, found.wrong_but_reliable), (3, 2, 1));
        assert!((found.median_m.value - 1.0).abs() < 1e-12 && (found.median_seconds - 2.0).abs() < 1e-12);
        assert!((found.nees.unwrap().mean - 3.0).abs() < 1e-12 && found.nees_reliable.unwrap().answers == 3);
    }
}
