//! Finer than the grid: a compass search over position, heading, pitch, roll and height on perspective views.

use crate::candidates::Sweep;
use crate::doubt;
use crate::likeness::{Compared, Likeness};
use crate::mode::{Mode, log_prior};
use crate::settings::Settings;
use resurvey_plugin::schema::Pose;
use resurvey_plugin::{CompareRequest, Error, Host, Photo};

/// What is maximised.
pub struct Objective<'a, 'p> {
    /// Services of the host.
    pub host: &'a dyn Host,
    /// The photo.
    pub photo: &'a Photo<'p>,
    /// Settings.
    pub settings: &'a Settings,
    /// Classes that count.
    pub compared: &'a Compared,
    /// The score.
    pub likeness: Likeness,
}

/// One level of the pyramid: image size and step sizes.
struct Level {
    /// Samples along the longer side of the image.
    samples: u32,
    /// First step as a share of `STEP_M` and `STEP_RAD`.
    first_step: f64,
    /// Last step.
    last_step: f64,
    /// Modes that go on to this level.
    modes: usize,
}

const LEVELS: [Level; 2] = [
    Level { samples: 120, first_step: 1.0, last_step: 0.2, modes: usize::MAX },
    Level { samples: 240, first_step: 0.5, last_step: 0.08, modes: 6 },
];
/// Samples of the view that gives the final score.
const FINEST: u32 = 480;
/// Full step of position and height, metres.
const STEP_M: f64 = 0.5;
/// Full step of heading, pitch and roll, radians.
const STEP_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
/// A turn and a shift that keep what is this far away in place are nearly the same to the eye, metres.
const PIVOTS_M: [f64; 2] = [8.0, 30.0];
/// Steps of one mode at one level; a search that needs more is climbing noise.
const MAX_ROUNDS: usize = 60;

/// Candidates of the grid that climb to their neighbours.
const CLIMBERS: usize = 4;

/// A move in the camera's own axes: right, forward, up in metres; yaw, pitch, roll in radians.
pub type Move = [f64; 6];

impl Objective<'_, '_> {
    /// Refines `modes` in place and sorts them best first.
    pub fn refine(&self, modes: &mut [Mode]) -> Result<(), Error> {
        for (index, level) in LEVELS.iter().enumerate() {
            let stride = self.stride(level.samples);
            for mode in modes.iter_mut().take(level.modes) {
                if self.host.cancelled() {
                    return Err(Error("cancelled".to_owned()));
                }
                *mode = self.climb(*mode, stride, level)?;
            }
            modes.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
            self.host.progress(0.6 + 0.4 * (index + 1) as f64 / LEVELS.len() as f64);
        }
        Ok(())
    }

    /// Scores `modes` as they stand on views of the photo's full size, lets the best of them climb over the candidates
    /// next to them, sorts all best first, and returns the first.
    pub fn rescore(&self, modes: &mut [Mode], sweep: &Sweep<'_, '_>) -> Result<Mode, Error> {
        let poses: Vec<Pose> = modes.iter().map(|mode| mode.pose).collect();
        modes.copy_from_slice(&self.evaluate(1, &poses)?);
        let best_first = |a: &Mode, b: &Mode| b.log_posterior.total_cmp(&a.log_posterior);
        modes.sort_by(best_first);
        for mode in modes.iter_mut().take(CLIMBERS) {
            for _ in 0..MAX_ROUNDS {
                let neighbours = self.evaluate(1, &sweep.neighbours(&mode.pose)?)?;
                match neighbours.iter().min_by(|a, b| best_first(a, b)) {
                    Some(better) if better.log_posterior > mode.log_posterior => *mode = *better,
                    _ => break,
                }
            }
        }
        modes.sort_by(best_first);
        Ok(modes[0])
    }

    /// Score and log posterior of `pose` on a fine view.
    pub fn at(&self, pose: Pose) -> Result<Mode, Error> {
        let scored = self.evaluate(self.stride(FINEST), &[pose])?;
        scored.first().copied().ok_or_else(|| Error("the host compared no view".to_owned()))
    }

    /// Spread of the likelihood around `best`.
    pub fn covariance(&self, best: &Mode) -> Result<[[f64; 3]; 3], Error> {
        let stride = self.stride(LEVELS[1].samples);
        doubt::covariance(best, |poses| self.evaluate(stride, poses))
    }

    fn stride(&self, samples: u32) -> u32 {
        let longer = self.photo.labels.width().max(self.photo.labels.height());
        (longer / samples).max(1)
    }

    fn climb(&self, start: Mode, stride: u32, level: &Level) -> Result<Mode, Error> {
        let mut best = self.evaluate(stride, &[start.pose])?[0];
        let mut step = level.first_step;
        for _ in 0..MAX_ROUNDS {
            let moves = self.moves(step);
            let poses: Vec<Pose> = moves.iter().map(|step| moved(&best.pose, step)).collect();
            let tried = self.evaluate(stride, &poses)?;
            let gains: Vec<f64> = tried.iter().map(|mode| mode.log_posterior - best.log_posterior).collect();
            let together = self.evaluate(stride, &[moved(&best.pose, &sum_of_gains(&moves, &gains))])?;
            let winner = tried.iter().chain(&together).max_by(|a, b| a.log_posterior.total_cmp(&b.log_posterior));
            match winner {
                Some(mode) if mode.log_posterior > best.log_posterior => best = *mode,
                _ if step / 2.0 < level.last_step => break,
                _ => step /= 2.0,
            }
        }
        Ok(best)
    }

    /// Both directions along each axis, and along the two pairs of axes that look alike.
    fn moves(&self, step: f64) -> Vec<Move> {
        let (shift, turn) = (step * STEP_M, step * STEP_RAD);
        let prior = &self.photo.prior;
        let mut moves: Vec<Move> =
            vec![[shift, 0., 0., 0., 0., 0.], [0., shift, 0., 0., 0., 0.], [0., 0., 0., turn, 0., 0.]];
        for pivot_m in PIVOTS_M {
            moves.push([shift, 0., 0., -shift / pivot_m, 0., 0.]);
        }
        if prior.height_sigma_m > 0.0 {
            moves.push([0., 0., shift / 2.0, 0., 0., 0.]);
        }
        if prior.tilt_sigma_rad > 0.0 {
            moves.extend([[0., 0., 0., 0., turn, 0.], [0., 0., 0., 0., 0., turn]]);
            if prior.height_sigma_m > 0.0 {
                moves.push([0., 0., shift / 2.0, 0., -shift / 2.0 / PIVOTS_M[0], 0.]);
            }
        }
        let reversed: Vec<Move> = moves.iter().map(|step| step.map(|value| -value)).collect();
        moves.into_iter().chain(reversed).collect()
    }

    /// Score and log posterior of each pose.
    fn evaluate(&self, stride: u32, poses: &[Pose]) -> Result<Vec<Mode>, Error> {
        let request = CompareRequest {
            stride,
            ignored_in_photo: self.compared.ignored_in_photo,
            ignored_in_view: self.compared.ignored_in_view,
            boundary_tolerance_px: self.settings.tolerance_px(),
        };
        let counts = self.host.compare_views(&request, poses)?;
        let modes = poses.iter().zip(&counts).map(|(pose, counts)| {
            let score = self.likeness.of_view(counts);
            let prior = if self.settings.use_prior { log_prior(&self.photo.prior, pose) } else { 0.0 };
            Mode { pose: *pose, score, log_posterior: self.settings.evidence * score + prior }
        });
        Ok(modes.collect())
    }
}

/// The sum of the better of each pair of opposite moves, where that gains anything.
fn sum_of_gains(moves: &[Move], gains: &[f64]) -> Move {
    let mut sum = [0.0; 6];
    let half = moves.len() / 2;
    for index in 0..half {
        let better = if gains[index] >= gains[index + half] { index } else { index + half };
        if gains[better] > 0.0 {
            for (total, value) in sum.iter_mut().zip(moves[better]) {
                *total += value;
            }
        }
    }
    sum
}

/// `pose` after a move in the camera's own axes, with right and forward level.
pub fn moved(pose: &Pose, [right_m, forward_m, up_m, yaw_rad, pitch_rad, roll_rad]: &Move) -> Pose {
    let (sin, cos) = pose.yaw_rad.sin_cos();
    let mut moved = *pose;
    moved.position.easting_m += right_m * cos + forward_m * sin;
    moved.position.northing_m += -right_m * sin + forward_m * cos;
    moved.position.height_m += up_m;
    moved.yaw_rad += yaw_rad;
    moved.pitch_rad += pitch_rad;
    moved.roll_rad += roll_rad;
    moved
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::schema::GridPoint;

    #[test]
    fn right_of_a_camera_that_looks_east_is_south() {
        let east = Pose {
            position: GridPoint::new(0.0, 0.0, 0.0),
            yaw_rad: 90_f64.to_radians(),
            pitch_rad: 0.0,
            roll_rad: 0.0,
        };
        let moved = moved(&east, &[1.0, 2.0, 3.0, 0.0, 0.0, 0.0]);
        assert!((moved.position.easting_m - 2.0).abs() < 1e-12);
        assert!((moved.position.northing_m + 1.0).abs() < 1e-12);
        assert!((moved.position.height_m - 3.0).abs() < 1e-12);
    }

    #[test]
    fn only_gains_are_added_up() {
        let moves: Vec<Move> = vec![
            [1., 0., 0., 0., 0., 0.],
            [0., 1., 0., 0., 0., 0.],
            [-1., 0., 0., 0., 0., 0.],
            [0., -1., 0., 0., 0., 0.],
        ];
        let sum = sum_of_gains(&moves, &[-1.0, -2.0, 3.0, -0.5]);
        assert!((sum[0] + 1.0).abs() < 1e-12 && sum[1..].iter().all(|value| value.abs() < 1e-12));
    }
}
