//! The linear mixed model of contour residuals: r = J·δ + Z·d + ε. The pose is off by δ, each part of the map by a shift
//! d of its own (normal, 1σ the same for all), each contour sample by ε.
//!
//! Laird & Ware 1982; the variances by restricted maximum likelihood. Walls that stand a little off the map are the
//! errors that do not average out over thousands of samples, so they, not the pixels, say how sure a pose is.

use crate::parts::Part;
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};
use std::collections::BTreeMap;

/// Degrees of freedom of ε's Student distribution: labels are wrong in blobs.
const TAILS: f64 = 3.0;
/// 1σ of the map's shifts that are tried, metres, with their prior weights: city models are good to a few decimetres, and
/// some to centimetres. The first stands for a map without errors.
const SHIFTS_M: [[f64; 2]; 8] =
    [[0.003, 0.02], [0.02, 0.05], [0.05, 0.1], [0.1, 0.2], [0.15, 0.2], [0.2, 0.2], [0.3, 0.15], [0.4, 0.08]];
/// Parts also stretch and tilt, and neighbours move together, so that fewer shifts are independent than there are parts:
/// what shifts add to the covariance counts this many times (found on generated captures, `docs/accuracy.md`).
const TOGETHER: f64 = 6.0;
/// 1σ of ε stays above this, pixels: half a pixel's rounding.
const LEAST_PX: f64 = 0.3;
/// Rounds of weights, variances and solution.
const ROUNDS: usize = 4;

/// One contour sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Part of the map that it belongs to.
    pub part: Part,
    /// How far the photo's contour lies from the view's along the normal, pixels.
    pub residual_px: f64,
    /// What a move of the camera does to the view's contour: per metre right, forward, up and radian yaw, pitch, roll.
    pub by_move: Vector6<f64>,
    /// What a shift of its part of the map does to it, per 1σ of the shift along each of the part's own axes times metre.
    pub by_shift: Vector3<f64>,
    /// How many independent observations it stands for.
    pub share: f64,
}

/// What the samples say.
#[derive(Clone, Copy, Debug)]
pub struct Solution {
    /// The move of the camera.
    pub step: Vector6<f64>,
    /// Its covariance.
    pub covariance: Matrix6<f64>,
    /// 1σ of the map's shifts, metres.
    pub map_sigma_m: f64,
    /// 1σ of ε, pixels.
    pub label_sigma_px: f64,
}

/// Normal equations of one part of the map.
struct Sums {
    moves: Matrix6<f64>,
    cross: SMatrix<f64, 6, 3>,
    shifts: Matrix3<f64>,
    by_move: Vector6<f64>,
    by_shift: Vector3<f64>,
}

/// The move that is to be expected, given `prior` information that the move `to_prior` leads to the prior; `None` when
/// samples and prior leave it open.
pub fn solve(samples: &[Sample], prior: &Matrix6<f64>, to_prior: &Vector6<f64>) -> Option<Solution> {
    let mut left: Vec<f64> = samples.iter().map(|sample| sample.residual_px).collect();
    let mut solution = None;
    for _ in 0..ROUNDS {
        let label_sigma_px = scale(&left);
        let parts = parts(samples, &left, label_sigma_px);
        let found: Vec<Found> =
            SHIFTS_M.iter().filter_map(|&[sigma_m, _]| at(&parts, sigma_m, prior, to_prior)).collect();
        if found.len() < SHIFTS_M.len() {
            return None;
        }
        let best = found.iter().max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood))?;
        for (left, sample) in left.iter_mut().zip(samples) {
            let shift = best.shifts.get(&sample.part).copied().unwrap_or_default();
            *left = sample.residual_px - sample.by_move.dot(&best.step) - sample.by_shift.dot(&shift);
        }
        solution = Some(Solution { label_sigma_px, ..averaged(&found, best.log_likelihood) });
    }
    solution
}

/// The mean over all sizes of the map's shifts, each as likely as it is.
fn averaged(found: &[Found], highest: f64) -> Solution {
    let weight = |found: &Found, prior: f64| prior * (found.log_likelihood - highest).exp();
    let weights: Vec<f64> = found.iter().zip(SHIFTS_M).map(|(found, [_, prior])| weight(found, prior)).collect();
    let sum: f64 = weights.iter().sum();
    let weighted = || found.iter().zip(weights.iter().map(|weight| weight / sum));
    let step: Vector6<f64> = weighted().map(|(found, weight)| found.step * weight).sum();
    let without_shifts = found.first().map_or_else(Matrix6::zeros, |found| found.covariance);
    let covariance = weighted().map(|(found, weight)| {
        let off = found.step - step;
        let by_shifts = found.covariance - without_shifts;
        (without_shifts + by_shifts * TOGETHER + off * off.transpose()) * weight
    });
    let map_variance_m2: f64 =
        SHIFTS_M.iter().zip(&weights).map(|([sigma_m, _], weight)| sigma_m.powi(2) * weight / sum).sum();
    Solution { step, covariance: covariance.sum(), map_sigma_m: map_variance_m2.sqrt(), label_sigma_px: 0.0 }
}

/// Robust 1σ: the median absolute residual of a normal distribution is 0.6745 σ.
fn scale(left: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = left.iter().map(|value| value.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    (sizes.get(sizes.len() / 2).copied().unwrap_or(0.0) / 0.6745).max(LEAST_PX)
}

fn parts(samples: &[Sample], left: &[f64], sigma_px: f64) -> BTreeMap<Part, Sums> {
    let mut parts = BTreeMap::new();
    for (sample, left) in samples.iter().zip(left) {
        let part = parts.entry(sample.part).or_insert_with(|| Sums {
            moves: Matrix6::zeros(),
            cross: SMatrix::zeros(),
            shifts: Matrix3::zeros(),
            by_move: Vector6::zeros(),
            by_shift: Vector3::zeros(),
        });
        let weight = sample.share * (TAILS + 1.0) / (TAILS + (left / sigma_px).powi(2)) / sigma_px.powi(2);
        let (moves, shift) = (sample.by_move, sample.by_shift);
        part.moves += weight * moves * moves.transpose();
        part.cross += weight * moves * shift.transpose();
        part.shifts += weight * shift * shift.transpose();
        part.by_move += weight * sample.residual_px * moves;
        part.by_shift += weight * sample.residual_px * shift;
    }
    parts
}

struct Found {
    step: Vector6<f64>,
    covariance: Matrix6<f64>,
    shifts: BTreeMap<Part, Vector3<f64>>,
    log_likelihood: f64,
}

/// The solution for one 1σ of the shifts, with its restricted log likelihood up to a constant.
fn at(parts: &BTreeMap<Part, Sums>, sigma_m: f64, prior: &Matrix6<f64>, to_prior: &Vector6<f64>) -> Option<Found> {
    let stiffness = Matrix3::identity() / sigma_m.powi(2);
    let (mut information, mut gradient) = (*prior, prior * to_prior);
    let mut log_determinants = 0.0;
    let mut explained = 0.0;
    let mut inverses = Vec::with_capacity(parts.len());
    for part in parts.values() {
        let inverse = (part.shifts + stiffness).try_inverse()?;
        information += part.moves - part.cross * inverse * part.cross.transpose();
        gradient += part.by_move - part.cross * inverse * part.by_shift;
        log_determinants += (Matrix3::identity() + part.shifts * sigma_m.powi(2)).determinant().max(1e-300).ln();
        explained += part.by_shift.dot(&(inverse * part.by_shift));
        inverses.push(inverse);
    }
    let covariance = information.try_inverse()?;
    let step = covariance * gradient;
    explained += gradient.dot(&step);
    let shifts = parts
        .iter()
        .zip(&inverses)
        .map(|((key, part), inverse)| (*key, inverse * (part.by_shift - part.cross.transpose() * step)))
        .collect();
    let log_likelihood = 0.5 * (explained - log_determinants - information.determinant().max(1e-300).ln());
    Some(Found { step, covariance, shifts, log_likelihood })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contours of `parts` walls around a camera; wall k is `shifts[k]` metres off along its normal, and the camera
    /// `step` off.
    fn walls(shifts: &[f64], step: [f64; 6]) -> Vec<Sample> {
        let mut samples = Vec::new();
        for (wall, shift) in shifts.iter().enumerate() {
            for index in 0..60 {
                let turn = wall as f64 * 1.1;
                let (along, up) = (f64::from(index % 12) - 6.0, f64::from(index / 12) - 2.0);
                let (sin, cos) = turn.sin_cos();
                // Derivatives of a pixel at a wall 10 m off: 35 px a metre, 350 px a radian.
                let by_move = if index % 2 == 0 {
                    Vector6::new(-35.0 * cos, 35.0 * sin + 3.0 * along, 0.0, -350.0, 10.0 * along, 30.0 * up)
                } else {
                    Vector6::new(0.0, 4.0 * up, 35.0, 3.0 * along, -350.0 - up, 30.0 * along)
                };
                let by_shift = Vector3::new(-by_move[0], -by_move[1], -by_move[2]);
                let residual_px = by_move.dot(&Vector6::from(step)) + by_shift.x * shift;
                samples.push(Sample { part: [wall as i32, 0, 0, 0], residual_px, by_move, by_shift, share: 1.0 });
            }
        }
        samples
    }

    fn weak() -> Matrix6<f64> {
        Matrix6::identity() * 1e-4
    }

    #[test]
    fn an_exact_map_gives_back_the_move_with_a_small_spread() {
        let step = [0.2, -0.1, 0.05, 0.01, -0.005, 0.002];
        let found = solve(&walls(&[0.0; 6], step), &weak(), &Vector6::zeros()).unwrap();
        assert!((found.step - Vector6::from(step)).norm() < 1e-3, "{}", found.step);
        assert!(found.covariance[(0, 0)].sqrt() < 0.05);
    }

    #[test]
    fn walls_that_stand_elsewhere_widen_the_spread() {
        let exact = solve(&walls(&[0.0; 6], [0.0; 6]), &weak(), &Vector6::zeros()).unwrap();
        let off = [0.3, -0.2, 0.25, -0.3, 0.2, -0.1];
        let moved = solve(&walls(&off, [0.0; 6]), &weak(), &Vector6::zeros()).unwrap();
        let sigma = |solution: &Solution| solution.covariance[(0, 0)].sqrt();
        assert!(sigma(&moved) > 4.0 * sigma(&exact), "{} and {}", sigma(&moved), sigma(&exact));
        assert!(moved.step[0].abs() < 2.0 * sigma(&moved));
    }

    #[test]
    fn without_samples_the_prior_is_the_answer() {
        let to_prior = Vector6::new(1.0, 2.0, 3.0, 0.1, 0.2, 0.3);
        let found = solve(&[], &Matrix6::identity(), &to_prior).unwrap();
        assert!((found.step - to_prior).norm() < 1e-9);
        assert!((found.covariance - Matrix6::identity()).norm() < 1e-9);
    }
}
