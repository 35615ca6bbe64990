//! Order statistics of errors, some of which are infinite: a capture without an answer is infinitely wrong.

/// The quantile at `share` (0–1) of `values`, linear between order statistics; infinite as soon as an infinite value has
/// any weight in it. `None` for no values. Takes linear time.
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let (index, weight) = (place.floor() as usize, place.fract());
    let (_, low, above) = sorted.select_nth_unstable_by(index, f64::total_cmp);
    let low = *low;
    // The product of nothing and infinity is no number.
    if weight <= 0.0 || low.is_infinite() {
        return Some(low);
    }
    let high = above.iter().copied().min_by(f64::total_cmp)?;
    Some(low + weight * (high - low))
}

/// The median; with an even number of values the mean of the middle two, infinite when one of them is.
pub fn median(values: &[f64]) -> Option<f64> {
    quantile(values, 0.5)
}

/// The mean of the finite ones of `values`; `None` when there is none.
pub fn mean(values: &[f64]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0_usize);
    for value in values.iter().filter(|value| value.is_finite()) {
        sum += value;
        count += 1;
    }
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const INF: f64 = f64::INFINITY;

    fn is(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|found| (found - expected).abs() < 1e-12 || found.total_cmp(&expected).is_eq())
    }

    #[test]
    fn quantiles_lie_linearly_between_order_statistics() {
        // numpy.quantile([3, 1, 2, 10], [0, .25, .5, .9, 1]) = 1, 1.75, 2.5, 7.9, 10.
        let values = [3.0, 1.0, 2.0, 10.0];
        for (share, expected) in [(0.0, 1.0), (0.25, 1.75), (0.5, 2.5), (0.9, 7.9), (1.0, 10.0)] {
            assert!(is(quantile(&values, share), expected), "{share}");
        }
        assert!(is(median(&[5.0, 1.0, 2.0]), 2.0));
        assert_eq!((median(&[]), mean(&[])), (None, None));
    }

    #[test]
    fn a_median_with_an_infinite_middle_is_infinite_and_never_no_number() {
        assert!(is(median(&[0.1, INF]), INF));
        assert!(is(median(&[INF, INF]), INF));
        assert!(is(median(&[INF, 0.1, 0.3]), 0.3));
        assert!(is(quantile(&[0.1, INF, 0.2], 0.5), 0.2));
        assert!(is(quantile(&[1.0, INF], 0.0), 1.0));
    }

    #[test]
    fn the_mean_is_over_the_captures_with_an_answer() {
        assert!(is(mean(&[1.0, INF, 3.0]), 2.0));
        assert_eq!(mean(&[INF]), None);
    }
}
