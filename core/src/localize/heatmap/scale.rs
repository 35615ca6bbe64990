//! Round numbers: the range of scores that the colours span, and the length of the scale bar.

use super::canvas::Colour;
use super::colours::viridis;

/// Least span of the colours, so that noise on equal scores does not look like a peak.
const LEAST_SPAN: f64 = 0.02;

/// Parts that the colour bar is divided into, at most.
const PARTS: f64 = 6.0;

/// Which score has which colour.
pub(super) struct ScoreScale {
    low: f64,
    high: f64,
}

impl ScoreScale {
    /// The scale from the least to the greatest of `scores` (0–1); 0 to 1 when there are none.
    pub(super) fn new(scores: impl Iterator<Item = f64>) -> Self {
        let (low, high) = scores.fold((1.0_f64, 0.0_f64), |(low, high), score| (low.min(score), high.max(score)));
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        let spare = (LEAST_SPAN - (high - low)).max(0.0) / 2.0;
        Self { low: low - spare, high: high + spare }
    }

    /// Where `score` is in the range, 0–1.
    pub(super) fn share(&self, score: f64) -> f64 {
        ((score - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }

    pub(super) fn colour(&self, score: f64) -> Colour {
        viridis(self.share(score))
    }

    /// The round scores in the range, rising, as numbers and as text.
    pub(super) fn ticks(&self) -> impl Iterator<Item = (f64, String)> {
        let step = round_above((self.high - self.low) / PARTS);
        let decimals = (-step.log10()).ceil().clamp(1.0, 6.0) as usize;
        // A bound that is a round number but for the last bits keeps its tick.
        let (first, last) = ((self.low / step - 1e-9).ceil() as i64, (self.high / step + 1e-9).floor() as i64);
        (first.max(0)..=last)
            .map(move |tick| tick as f64 * step)
            .filter(|score| *score < 1.0 + 1e-9)
            .map(move |score| (score, format!("{score:.decimals$}")))
    }
}

/// The least of 1, 2, 5 times a power of ten that is not below `value`.
fn round_above(value: f64) -> f64 {
    let power = 10_f64.powf(value.max(1e-9).log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|round| *round >= value * (1.0 - 1e-9))
        .unwrap_or(value)
}

/// The greatest of 1, 2, 5 times a power of ten that is not above `value`.
pub(super) fn round_below(value: f64) -> f64 {
    let power = 10_f64.powf(value.max(1e-9).log10().floor());
    [5.0, 2.0, 1.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|round| *round <= value * (1.0 + 1e-9))
        .unwrap_or(power)
}
