//! A share of what was counted, with its interval.

use super::bootstrap::wilson_95;
use serde::Serialize;

/// So many of so many, with Wilson's 95 % interval of the share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// How many it holds for.
    pub count: usize,
    /// Of how many.
    pub of: usize,
    /// The share, 0–1.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Share {
    /// `count` of `of`; `None` of nothing.
    pub fn new(count: usize, of: usize) -> Option<Self> {
        let interval = wilson_95(count, of)?;
        Some(Self { count, of, value: count as f64 / of as f64, low: interval.low, high: interval.high })
    }

    /// Of `all`, those that hold; `None` of nothing.
    pub fn among(all: impl IntoIterator<Item = bool>) -> Option<Self> {
        let (mut count, mut of) = (0, 0);
        for holds in all {
            count += usize::from(holds);
            of += 1;
        }
        Self::new(count, of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_in_ten_are_likely_between_eleven_and_sixty_per_cent() {
        // Wilson's interval of 3/10 (Brown, Cai & DasGupta, 2001): 0.1078 to 0.6032.
        let share = Share::among((0..10).map(|index| index < 3)).unwrap();
        assert_eq!((share.count, share.of), (3, 10));
        assert!((share.value - 0.3).abs() < 1e-12);
        assert!((share.low - 0.1078).abs() < 1e-4 && (share.high - 0.6032).abs() < 1e-4, "{share:?}");
        assert_eq!(Share::among([]), None);
    }
}
