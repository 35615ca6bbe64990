//! The matchers in `score` form that judge the views of one search: one, or several that the host combines.

use super::mixture::Mixture;
use crate::image::LabelImage;
use crate::plugin::{MakeView, Matcher, PluginError};

/// Matchers with what each counts for.
pub(super) struct Panel<'m> {
    members: Vec<(&'m mut Matcher, f64)>,
    sigma_floor: f64,
}

impl<'m> Panel<'m> {
    /// One matcher, whose scores stay as they are.
    pub fn of_one(matcher: &'m mut Matcher) -> Self {
        Self::of_many([(matcher, 1.0)], 0.0)
    }

    /// Several, with their weights.
    pub fn of_many(members: impl IntoIterator<Item = (&'m mut Matcher, f64)>, sigma_floor: f64) -> Self {
        Self { members: members.into_iter().collect(), sigma_floor }
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Their names.
    pub fn name(&self) -> String {
        let names: Vec<&str> = self.members.iter().map(|(matcher, _)| matcher.info().name.as_str()).collect();
        names.join(" + ")
    }

    /// What each says of `count` views, view by view, unless it is cancelled; `view` hands view `index` to its second
    /// argument.
    pub fn scores(
        &mut self,
        photo: &LabelImage,
        count: usize,
        view: &mut MakeView<'_>,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<f64>, PluginError> {
        let members = self.members.len();
        let mut scores = vec![f64::NAN; count * members];
        for (member, (matcher, _)) in self.members.iter_mut().enumerate() {
            for (index, score) in matcher.score_each(photo, count, view, cancelled)?.into_iter().enumerate() {
                scores[index * members + member] = score;
            }
        }
        Ok(scores)
    }

    /// How their scores become one, as their `scores` of all candidates of the photo, candidate by candidate, say.
    pub fn mixture(&self, scores: &[f64]) -> Mixture {
        let weights: Vec<f64> = self.members.iter().map(|(_, weight)| *weight).collect();
        Mixture::standardised(&weights, scores, self.sigma_floor)
    }
}
