//! The linear mixed model of contour residuals: r = J·δ + Z·d + ε. The pose is off by δ, each part of the map by a shift
//! d of its own (normal, 1σ the same for all), each contour sample by ε.
//!
//! Laird & Ware 1982; the variances by restricted maximum likelihood. Walls that stand a little off the map are the
//! errors that do not average out over thousands of samples, so they, not the pixels, say how sure a pose is.

use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector6};
use std::collections::BTreeMap;

/// Degrees of freedom of ε's Student distribution: labels are wrong in blobs.
const TAILS: f64 = 3.0;
/// 1σ of the map's shifts that are tried, metres.
const SHIFTS_M: [[f64; 2]; 8] =
    [[0.003, 0.02], [0.02, 0.05], [0.05, 0.1], [0.1, 0.2], [0.15, 0.2], [0.2, 0.2], [0.3, 0.15], [0.4, 0.08]];
/// 1σ of ε stays above this, pixels: half a pixel's rounding.
const LEAST_PX: f64 = 0.3;
/// Rounds of weights, variances and solution.
const ROUNDS: usize = 4;

/// One contour sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Part of the map that it belongs to.
    pub part: [i32; 3],
    /// How far the photo's contour lies from the view's along the normal, pixels.
    pub residual_px: f64,
    /// What a move of the camera does to the view's contour: per metre right, forward, up and radian yaw, pitch, roll.
    pub by_move: Vector6<f64>,
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
    /// 1σ of ε, pixels.
    pub label_sigma_px: f64,
    /// 1σ of the map's shifts, metres.
    pub map_sigma_m: f64,
}

/// Normal equations of one part of the map.
struct Part {
    moves: Matrix6<f64>,
    cross: SMatrix<f64, 6, 3>,
    shifts: Matrix3<f64>,
    by_move: Vector6<f64>,
    by_shift: Vector3<f64>,
}

/// The most likely move, given `prior` information that the move `to_prior` leads to the prior.
pub fn solve(samples: &[Sample], prior: &Matrix6<f64>, to_prior: &Vector6<f64>) -> Option<Solution> {
    let mut left: Vec<f64> = samples.iter().map(|sample| sample.residual_px).collect();
    let mut label_sigma_px = scale(&left);
    let mut solution = None;
    for _ in 0..ROUNDS {
        let parts = parts(samples, &left, label_sigma_px);
        let found: Vec<(f64, Found)> =
            SHIFTS_M.iter().filter_map(|&[sigma_m, _]| Some((sigma_m, at(&parts, sigma_m, prior, to_prior)?))).collect();
        let highest = found.iter().map(|(_, found)| found.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = found
            .iter()
            .zip(SHIFTS_M)
            .map(|((_, found), [_, prior])| prior * (found.log_likelihood - highest).exp())
            .collect();
        let sum: f64 = weights.iter().sum();
        if sum.is_nan() || sum <= 0.0 { return None; }
        let mut step = Vector6::zeros();
        let mut map_sigma_m = 0.0;
        for ((sigma, found), weight) in found.iter().zip(&weights) {
            step += found.step * (weight / sum);
            map_sigma_m += sigma * weight / sum;
        }
        let mut covariance = Matrix6::zeros();
        for ((_, found), weight) in found.iter().zip(&weights) {
            let off = found.step - step;
            covariance += (found.covariance + off * off.transpose()) * (weight / sum);
        }
        let best = found.iter().zip(&weights).max_by(|a, b| a.1.total_cmp(b.1)).map(|((_, found), _)| found)?;
        for (left, sample) in left.iter_mut().zip(samples) {
            let shift = best.shifts.get(&sample.part).copied().unwrap_or_default();
            *left = sample.residual_px - sample.by_move.dot(&best.step) - by_shift(sample).dot(&shift);
        }
        label_sigma_px = scale(&left);
        solution = Some(Solution { step, covariance, label_sigma_px, map_sigma_m });
    }
    solution
}

/// A shift of the surface looks like the opposite shift of the camera.
fn by_shift(sample: &Sample) -> Vector3<f64> {
    -sample.by_move.fixed_rows::<3>(0).into_owned()
}

/// Robust 1σ: the median absolute residual of a normal distribution is 0.6745 σ.
fn scale(left: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = left.iter().map(|value| value.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    (sizes.get(sizes.len() / 2).copied().unwrap_or(0.0) / 0.6745).max(LEAST_PX)
}

fn parts(samples: &[Sample], left: &[f64], sigma_px: f64) -> BTreeMap<[i32; 3], Part> {
    let mut parts = BTreeMap::new();
    for (sample, left) in samples.iter().zip(left) {
        let part = parts.entry(sample.part).or_insert_with(|| Part {
            moves: Matrix6::zeros(),
            cross: SMatrix::zeros(),
            shifts: Matrix3::zeros(),
            by_move: Vector6::zeros(),
            by_shift: Vector3::zeros(),
        });
        let weight = sample.share * (TAILS + 1.0) / (TAILS + (left / sigma_px).powi(2)) / sigma_px.powi(2);
        let (moves, shift) = (sample.by_move, by_shift(sample));
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
    shifts: BTreeMap<[i32; 3], Vector3<f64>>,
    log_likelihood: f64,
}

/// The solution for one 1σ of the shifts, with its restricted log likelihood up to a constant.
fn at(
    parts: &BTreeMap<[i32; 3], Part>,
    sigma_m: f64,
    prior: &Matrix6<f64>,
    to_prior: &Vector6<f64>,
) -> Option<Found> {
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
