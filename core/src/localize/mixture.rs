//! One score from those of several matchers, each standardised over the candidates of the same photo.

/// What each matcher's score counts for; the sum is 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mixture(Vec<f64>);

impl Mixture {
    /// The mixture of matchers with `weights` whose `scores` of all candidates, candidate by candidate, are known.
    ///
    /// Σ wᵢ (sᵢ − μᵢ)/σᵢ, the weighted sum of standard scores, ranks candidates as Σ (wᵢ/σᵢ) sᵢ does; divided by
    /// Σ wᵢ/σᵢ that is a mean of the scores, within 0–1 and 1 for a view that all find perfect. A matcher that says much
    /// the same of every candidate, the skyline in a hall, would be blown up: σᵢ/(σᵢ² + `sigma_floor`²) stands for 1/σᵢ.
    pub fn standardised(weights: &[f64], scores: &[f64], sigma_floor: f64) -> Self {
        let of = |member: usize| scores.iter().skip(member).step_by(weights.len()).copied();
        let counts = |(member, weight): (usize, &f64)| {
            let count = (scores.len() / weights.len()).max(1) as f64;
            let mean = of(member).sum::<f64>() / count;
            let variance = of(member).map(|score| (score - mean).powi(2)).sum::<f64>() / count;
            let damped = variance + sigma_floor.powi(2);
            if damped > 0.0 { weight * variance.sqrt() / damped } else { 0.0 }
        };
        let counts: Vec<f64> = weights.iter().enumerate().map(counts).collect();
        // Where no matcher tells candidates apart the weights are all there is.
        let counts = if counts.iter().sum::<f64>() > 0.0 { counts } else { weights.to_vec() };
        let sum: f64 = counts.iter().sum();
        Self(counts.into_iter().map(|count| count / sum).collect())
    }

    /// The score of a view from what each matcher says of it, 0–1.
    pub fn score(&self, scores: &[f64]) -> f64 {
        self.0.iter().zip(scores).map(|(count, score)| count * score).sum::<f64>().clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two matchers on four candidates: the first spreads over 0.4 with σ = √0.02, the second over 0.04 with a tenth.
    const SCORES: [f64; 8] = [0.3, 0.92, 0.5, 0.90, 0.5, 0.94, 0.7, 0.92];

    #[test]
    fn candidates_rank_as_the_weighted_sum_of_standard_scores_does() {
        let mixture = Mixture::standardised(&[1.0, 2.0], &SCORES, 0.0);
        let (sigma_a, sigma_b) = (0.02_f64.sqrt(), 0.0002_f64.sqrt());
        let standard = |pair: &[f64]| (pair[0] - 0.5) / sigma_a + 2.0 * (pair[1] - 0.92) / sigma_b;
        let pairs: Vec<&[f64]> = SCORES.chunks(2).collect();
        for (a, b) in pairs.iter().flat_map(|a| pairs.iter().map(move |b| (a, b))) {
            let (mixed, expected) = (mixture.score(a) - mixture.score(b), standard(a) - standard(b));
            // 1/σ and 2/σ of the two sum to 1/0.1414 + 2/0.01414 = 148.49.
            assert!((mixed - expected / 148.4924).abs() < 1e-6, "{a:?} {b:?}");
        }
    }

    #[test]
    fn a_view_that_all_find_perfect_scores_one_and_one_alone_keeps_its_scores() {
        assert!((Mixture::standardised(&[1.0, 2.0], &SCORES, 0.02).score(&[1.0, 1.0]) - 1.0).abs() < 1e-12);
        let alone = Mixture::standardised(&[3.0], &[0.2, 0.4, 0.9], 0.0);
        assert!((alone.score(&[0.4]) - 0.4).abs() < 1e-12);
        let constant = Mixture::standardised(&[1.0], &[0.5, 0.5], 0.0);
        assert!((constant.score(&[0.5]) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_matcher_that_says_the_same_of_every_candidate_takes_no_part() {
        let scores = [0.3, 1.0, 0.5, 1.0, 0.7, 1.0];
        let mixture = Mixture::standardised(&[1.0, 5.0], &scores, 0.02);
        assert!((mixture.score(&[0.7, 1.0]) - 0.7).abs() < 1e-12);
        // Unless all do.
        let equal = Mixture::standardised(&[1.0, 3.0], &[0.4, 0.8, 0.4, 0.8], 0.02);
        assert!((equal.score(&[0.4, 0.8]) - 0.7).abs() < 1e-12);
    }

    #[test]
    fn a_matcher_that_hardly_varies_counts_less_than_its_weight() {
        // σ of the second is 0.001 or so, a twentieth of the floor.
        let scores = [0.3, 0.899, 0.5, 0.9, 0.7, 0.901];
        let mixture = Mixture::standardised(&[1.0, 1.0], &scores, 0.02);
        let [first, second] = [mixture.score(&[1.0, 0.0]), mixture.score(&[0.0, 1.0])];
        assert!(second < first && (first + second - 1.0).abs() < 1e-12, "{first} {second}");
    }

    #[test]
    fn no_candidates_leave_the_weights() {
        assert!((Mixture::standardised(&[1.0, 3.0], &[], 0.02).score(&[0.0, 1.0]) - 0.75).abs() < 1e-12);
    }
}
