//! Percentile bootstrap (Efron, 1979): how much a number would differ on another sample of as many captures.

use super::statistics::quantile;
use serde::Serialize;

/// A range that holds the true value in about 95 of 100 samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end; may be infinite.
    pub high: f64,
}

/// A number over captures with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// The number on all captures; may be infinite, which JSON has as null.
    pub value: f64,
    /// 2.5 % of the resamples are below.
    pub low: f64,
    /// 2.5 % of the resamples are above.
    pub high: f64,
}

/// Resampling of captures, the same for the same seed and number of captures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bootstrap {
    /// Number of resamples.
    pub resamples: usize,
    /// Everything random follows from it.
    pub seed: u64,
}

impl Default for Bootstrap {
    /// 2000 resamples: the ends of a 95 % interval then rest on 50 each.
    fn default() -> Self {
        Self { resamples: 2000, seed: 1 }
    }
}

impl Bootstrap {
    /// `statistic` of all of `count` captures and its 95 % interval. `statistic` takes the indices of captures, some of
    /// them more than once; resamples on which it is no number are left out. `None` when it is none on all captures.
    pub fn estimate(&self, count: usize, mut statistic: impl FnMut(&[usize]) -> f64) -> Option<Estimate> {
        let mut sample: Vec<usize> = (0..count).collect();
        let value = statistic(&sample);
        if count == 0 || value.is_nan() {
            return None;
        }
        let mut random = SplitMix64(self.seed);
        let mut values = Vec::with_capacity(self.resamples);
        for _ in 0..self.resamples {
            for index in &mut sample {
                *index = random.below(count);
            }
            let value = statistic(&sample);
            if !value.is_nan() {
                values.push(value);
            }
        }
        let end = |share| quantile(&values, share).unwrap_or(value);
        Some(Estimate { value, low: end(0.025), high: end(0.975) })
    }
}

/// Generator of Steele, Lea & Flood (OOPSLA 2014): small, and the same everywhere.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A whole number below `end`: the high word of the product, whose bias is below `end` in 2⁶⁴.
    fn below(&mut self, end: usize) -> usize {
        ((u128::from(self.next()) * end as u128) >> 64) as usize
    }
}

/// Wilson's 95 % interval of a share (1927) of which `hits` of `count` were seen. Where all captures agree the bootstrap
/// has no width, and this has.
pub fn wilson_95(hits: usize, count: usize) -> Option<Interval> {
    const Z: f64 = 1.959_963_984_540_054;
    if count == 0 {
        return None;
    }
    let (n, share) = (count as f64, hits as f64 / count as f64);
    let middle = share + Z * Z / (2.0 * n);
    let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z * Z / n;
    Some(Interval { low: ((middle - half) / scale).max(0.0), high: ((middle + half) / scale).min(1.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share_of(values: &[f64]) -> Estimate {
        let mean = |sample: &[usize]| sample.iter().map(|&index| values[index]).sum::<f64>() / sample.len() as f64;
        Bootstrap::default().estimate(values.len(), mean).unwrap()
    }

    #[test]
    fn the_interval_of_a_share_is_that_of_the_binomial_distribution() {
        // 60 of 200: √(0.3·0.7/200) = 0.0324, so 0.3 ± 0.0635; Wilson: 0.2407 to 0.3668.
        let values: Vec<f64> = (0..200).map(|index| f64::from(u8::from(index % 10 < 3))).collect();
        let Estimate { value, low, high } = share_of(&values);
        assert!((value - 0.3).abs() < 1e-12);
        assert!((low - 0.2365).abs() < 0.01 && (high - 0.3635).abs() < 0.01, "{low} to {high}");
        let wilson = wilson_95(60, 200).unwrap();
        assert!((wilson.low - 0.2407).abs() < 1e-4 && (wilson.high - 0.3668).abs() < 1e-4, "{wilson:?}");
        assert!((wilson.low - low).abs() < 0.01 && (wilson.high - high).abs() < 0.01);
    }

    #[test]
    fn the_interval_of_a_mean_is_two_standard_errors_wide() {
        // 0, 1, …, 399: standard deviation 115.47, standard error 5.7735, so 199.5 ± 11.32.
        let values: Vec<f64> = (0..400).map(f64::from).collect();
        let Estimate { value, low, high } = share_of(&values);
        assert!((value - 199.5).abs() < 1e-9);
        assert!((low - 188.18).abs() < 1.0 && (high - 210.82).abs() < 1.0, "{low} to {high}");
    }

    #[test]
    fn where_all_agree_the_bootstrap_has_no_width_and_wilson_has() {
        let all = share_of(&[1.0; 13]);
        assert!((all.low - 1.0).abs() < 1e-12 && (all.high - 1.0).abs() < 1e-12);
        // z²/(n + z²) for no hit of n: 3.8415/16.8415.
        let wilson = wilson_95(13, 13).unwrap();
        assert!((1.0 - wilson.low - 0.228_097).abs() < 1e-5 && (wilson.high - 1.0).abs() < 1e-12, "{wilson:?}");
        assert_eq!(wilson_95(0, 0), None);
    }

    #[test]
    fn the_same_seed_gives_the_same_interval_and_another_one_another() {
        let values: Vec<f64> = (0..50).map(|index| f64::from(index * index % 17)).collect();
        let of = |seed| {
            let mean = |sample: &[usize]| sample.iter().map(|&index| values[index]).sum::<f64>();
            Bootstrap { resamples: 200, seed }.estimate(50, mean).unwrap()
        };
        assert_eq!(of(3), of(3));
        assert_ne!(of(3), of(4));
    }

    #[test]
    fn the_generator_is_the_published_one() {
        // First outputs of the reference splitmix64.c with state 1234567.
        let mut random = SplitMix64(1_234_567);
        let expected = [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!([random.next(), random.next(), random.next()], expected);
    }

    #[test]
    fn a_statistic_that_is_no_number_has_no_estimate_and_is_left_out_of_the_interval() {
        assert_eq!(Bootstrap::default().estimate(3, |_| f64::NAN), None);
        assert_eq!(Bootstrap::default().estimate(0, |_| 1.0), None);
        let only_all = Bootstrap::default().estimate(3, |sample| if sample == [0, 1, 2] { 7.0 } else { f64::NAN });
        let Estimate { value, low, high } = only_all.unwrap();
        assert!([value, low, high].iter().all(|end| (end - 7.0).abs() < 1e-12));
    }
}
