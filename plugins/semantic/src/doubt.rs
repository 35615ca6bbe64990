//! How sure the answer is: the spread of the likelihood around it, and the strongest other place.

use crate::mode::{Mode, angle_between};
use crate::refine::moved;
use crate::settings::Settings;
use resurvey_plugin::Error;
use resurvey_plugin::schema::{Alignment, Pose, RunnerUp};

/// Over easting (m), northing (m) and yaw (rad).
pub type Covariance = [[f64; 3]; 3];

/// Modes closer than this are the same answer, metres: windows and columns of a façade repeat every three to five.
pub const SAME_PLACE_M: f64 = 2.5;
/// An answer that nothing bounds is at least this unsure, metres.
const UNBOUNDED_M: f64 = 5.0;
/// Poses drawn around the best in each round.
const SAMPLES: usize = 192;
/// Half-widths of the box that poses are drawn from, in the first round: metres and radians.
const FIRST_REACH: [f64; 3] = [2.0, 2.0, 0.035];
/// A box is small enough when at least this share of its samples carries weight.
const ENOUGH_SHARE: f64 = 0.15;
/// Each round halves the box that is too wide.
const MAX_ROUNDS: usize = 6;
/// The grid of label pixels and the model's own accuracy leave at least this: metres and radians.
const FLOOR: [f64; 3] = [0.02, 0.02, 0.0005];

/// Covariance over easting, northing (m) and yaw (rad): moments of the likelihood over poses drawn around `best`.
pub fn covariance(
    best: &Mode,
    mut evaluate: impl FnMut(&[Pose]) -> Result<Vec<Mode>, Error>,
) -> Result<Covariance, Error> {
    let mut reach = FIRST_REACH;
    let mut moments = Moments::default();
    for _ in 0..MAX_ROUNDS {
        let offsets: Vec<[f64; 3]> = (1..=SAMPLES).map(|index| halton_box(index, &reach)).collect();
        let poses: Vec<Pose> = offsets
            .iter()
            .map(|[right, forward, yaw]| moved(&best.pose, &[*right, *forward, 0.0, *yaw, 0.0, 0.0]))
            .collect();
        let modes = evaluate(&poses)?;
        moments = Moments::of(best, &modes);
        if moments.effective_share >= ENOUGH_SHARE {
            break;
        }
        reach = reach.map(|half| half * 0.6);
    }
    Ok(with_floor(moments.covariance))
}

/// `covariance` plus what the grid of label pixels leaves open.
pub fn with_floor(mut covariance: Covariance) -> Covariance {
    for (axis, floor) in FLOOR.iter().enumerate() {
        covariance[axis][axis] += floor * floor;
    }
    covariance
}

/// `alignment` with what the grid of label pixels leaves open.
pub fn with_floors(mut alignment: Alignment) -> Alignment {
    for (axis, floor) in [FLOOR[0], FLOOR[1], FLOOR[2], FLOOR[0], FLOOR[2], FLOOR[2]].into_iter().enumerate() {
        alignment.covariance[axis][axis] += floor * floor;
    }
    alignment
}

/// The covariance of `alignment` over easting, northing and yaw.
pub fn in_plan(alignment: &Alignment) -> Covariance {
    std::array::from_fn(|row| std::array::from_fn(|column| alignment.covariance[row][column]))
}

/// `covariance` of an answer that no search around it bounds: at least 5 m, or the radius searched.
pub fn unbounded(mut covariance: Covariance, searched_m: f64) -> Covariance {
    let unsure_m2 = searched_m.max(UNBOUNDED_M).powi(2);
    covariance[0][0] += unsure_m2;
    covariance[1][1] += unsure_m2;
    covariance
}

/// The best mode more than 2.5 m from the first; `modes` are sorted best first.
pub fn runner_up(modes: &[Mode], settings: &Settings) -> Option<RunnerUp> {
    let best = modes.first()?;
    let distance_m = |mode: &Mode| mode.pose.position.plan_distance_m(&best.pose.position);
    let other = modes.iter().find(|mode| distance_m(mode) > SAME_PLACE_M)?;
    let log_ratio = if settings.use_prior {
        other.log_posterior - best.log_posterior
    } else {
        settings.evidence * (other.score - best.score)
    };
    Some(RunnerUp { distance_m: distance_m(other), score_ratio: log_ratio.exp().clamp(0.0, 1.0) })
}

#[derive(Default)]
struct Moments {
    covariance: [[f64; 3]; 3],
    /// Effective number of samples over their number (Kish 1965).
    effective_share: f64,
}

impl Moments {
    /// Weighted second moments about `best`, so that a biased peak widens the answer.
    fn of(best: &Mode, modes: &[Mode]) -> Self {
        let highest = modes.iter().fold(best.log_posterior, |high, mode| high.max(mode.log_posterior));
        let mut covariance = [[0.0; 3]; 3];
        let (mut sum, mut sum_of_squares) = (0.0, 0.0);
        for mode in modes {
            let weight = (mode.log_posterior - highest).exp();
            let offset = [
                mode.pose.position.easting_m - best.pose.position.easting_m,
                mode.pose.position.northing_m - best.pose.position.northing_m,
                angle_between(mode.pose.yaw_rad, best.pose.yaw_rad),
            ];
            for (row, &a) in covariance.iter_mut().zip(&offset) {
                for (cell, &b) in row.iter_mut().zip(&offset) {
                    *cell += weight * a * b;
                }
            }
            sum += weight;
            sum_of_squares += weight * weight;
        }
        if sum <= 0.0 {
            return Self::default();
        }
        covariance.iter_mut().flatten().for_each(|cell| *cell /= sum);
        Self { covariance, effective_share: sum * sum / sum_of_squares / modes.len().max(1) as f64 }
    }
}

/// Point `index` of Halton's sequence in bases 2, 3, 5, scaled to ±`reach`.
fn halton_box(index: usize, reach: &[f64; 3]) -> [f64; 3] {
    let radical_inverse = |base: usize| {
        let (mut value, mut scale, mut rest) = (0.0, 1.0 / base as f64, index);
        while rest > 0 {
            value += (rest % base) as f64 * scale;
            rest /= base;
            scale /= base as f64;
        }
        value
    };
    let unit = [2, 3, 5].map(|base| 2.0 * radical_inverse(base) - 1.0);
    [unit[0] * reach[0], unit[1] * reach[1], unit[2] * reach[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::schema::GridPoint;

    #[test]
    fn a_normal_likelihood_gives_back_its_own_spread() {
        let pose =
            Pose { position: GridPoint::new(835_600.0, 817_800.0, 6.0), yaw_rad: 0.3, pitch_rad: 0.0, roll_rad: 0.0 };
        let best = Mode { pose, score: 0.9, log_posterior: 0.0 };
        let sigma = [0.4, 0.2, 0.006];
        let found = covariance(&best, |poses| {
            Ok(poses
                .iter()
                .map(|at| {
                    let offset = [
                        at.position.easting_m - pose.position.easting_m,
                        at.position.northing_m - pose.position.northing_m,
                        at.yaw_rad - pose.yaw_rad,
                    ];
                    let square: f64 = offset.iter().zip(&sigma).map(|(offset, sigma)| (offset / sigma).powi(2)).sum();
                    Mode { pose: *at, score: 0.9, log_posterior: -0.5 * square }
                })
                .collect())
        })
        .unwrap();
        for axis in 0..3 {
            let ratio = found[axis][axis].sqrt() / sigma[axis];
            assert!((0.7..1.3).contains(&ratio), "axis {axis}: found over true 1 sigma is {ratio:.2}");
        }
    }

    #[test]
    fn an_answer_outside_the_search_is_at_least_five_metres_unsure() {
        let widened = unbounded([[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 1e-4]], 2.0);
        assert!(widened[0][0].sqrt() >= 5.0 && widened[1][1].sqrt() >= 5.0 && widened[2][2] < 2e-4);
    }

    #[test]
    fn a_second_place_as_good_as_the_first_has_ratio_one() {
        let at = |easting_m| Pose {
            position: GridPoint::new(easting_m, 0.0, 0.0),
            yaw_rad: 0.0,
            pitch_rad: 0.0,
            roll_rad: 0.0,
        };
        let mode = |easting_m, log_posterior| Mode { pose: at(easting_m), score: 0.9, log_posterior };
        let settings = crate::settings::tests::defaults();
        let found = runner_up(&[mode(0.0, 0.0), mode(2.0, 0.0), mode(9.0, 0.0)], &settings).unwrap();
        assert!((found.distance_m - 9.0).abs() < 1e-12 && (found.score_ratio - 1.0).abs() < 1e-12);
        assert_eq!(runner_up(&[mode(0.0, 0.0), mode(2.0, 0.0)], &settings), None);
    }
}
