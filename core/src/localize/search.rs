//! The search that the host drives for matchers in `score` form: a coarse grid, a finer one about its best candidates,
//! then a compass search (Hooke & Jeeves 1961) from the best modes. (A matcher in `search` form brings its own.)

use super::candidates::Candidates;
use super::mixture::Mixture;
use super::panel::Panel;
use super::services::SceneServices;
use super::stride::Strided;
use crate::plugin::{PluginError, Services};
use resurvey_schema::service::Prior;
use resurvey_schema::{Localization, Pose, RunnerUp};

/// What the host-driven search covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchLimits {
    /// Candidate positions lie within this distance of the prior, metres.
    pub radius_m: f64,
    /// Candidate headings lie within this angle of the prior, degrees.
    pub yaw_range_deg: f64,
}

impl Default for SearchLimits {
    /// Lee & Hsu: 40 m and ±40°.
    fn default() -> Self {
        Self { radius_m: 40.0, yaw_range_deg: 40.0 }
    }
}

/// Samples along the longer side of the image in the compass search.
const SAMPLES: u32 = 192;
/// Candidates that are refined, and how far apart they are: a neighbour on the grid would climb the same hill.
const MODES: usize = 16;
const APART_M: f64 = 2.5;
const APART_DEG: f64 = 5.0;
/// Modes that climb over height, pitch and roll too.
const FREE_MODES: usize = 4;
/// Where the compass search starts, metres (and the same number of degrees): about a step of the close grid.
const FIRST_STEP: f64 = 1.0;
/// It ends below this step, metres (and the same number of degrees).
const LAST_STEP: f64 = 0.06;
/// Where it starts over all six.
const FREE_STEP: f64 = 0.5;
/// Log likelihood lost when the score drops by one: the number of independent label patches, not of pixels. Chosen on
/// generated captures (`docs/accuracy.md`): the largest at which no place that is more than 2 m off passes the gate.
const EVIDENCE: f64 = 75.0;
/// Modes closer than this are the same answer, metres.
const SAME_PLACE_M: f64 = 5.0;
/// Half-width of the lattice that the covariance is taken over, in steps of a metre and a degree.
const SPREAD_STEPS: i32 = 3;
/// The search ends on a grid this fine, so that no answer is surer: metres and radians.
const FLOOR: [f64; 3] = [0.1, 0.1, 0.002];
/// Least 1σ of a prior's height (m) and tilt (rad): what says 0 is not known better than that.
const LEAST_SIGMA: [f64; 2] = [0.01, 0.001];

#[derive(Clone, Copy)]
struct Mode {
    pose: Pose,
    score: f64,
    /// The score less what the prior has against height and tilt.
    value: f64,
}

/// The best pose around the prior, as the matchers of `panel` score views.
pub(super) fn search(
    panel: &mut Panel<'_>,
    services: &SceneServices<'_>,
    limits: &SearchLimits,
) -> Result<Localization, PluginError> {
    let prior = services.capture().prior;
    let candidates = Candidates::new(panel, services, limits)?;
    let photo = Strided::new(services, SAMPLES);
    let mut climber = Climber { panel, photo, mixture: &candidates.mixture, prior, scored: 0 };
    let mut modes = climber.modes(&candidates.scored);
    let count = modes.len();
    for (done, mode) in modes.iter_mut().enumerate() {
        *mode = climber.climb(*mode, FIRST_STEP, &IN_PLAN)?;
        services.progress(0.7 + 0.2 * (done + 1) as f64 / count as f64);
    }
    modes.sort_by(|a, b| b.value.total_cmp(&a.value));
    for mode in modes.iter_mut().take(FREE_MODES) {
        *mode = climber.climb(*mode, FREE_STEP, &FREE)?;
    }
    modes.sort_by(|a, b| b.value.total_cmp(&a.value));
    let best = modes[0];
    Ok(Localization {
        pose: best.pose,
        score: best.score,
        covariance: climber.covariance(&best)?,
        alignment: None,
        runner_up: runner_up(&modes),
        candidates: candidates.scored.len() as u64 + climber.scored,
        skipped: candidates.skipped,
        heat: candidates.heat(),
    })
}

fn runner_up(modes: &[Mode]) -> Option<RunnerUp> {
    let distance_m = |mode: &Mode| mode.pose.position.plan_distance_m(&modes[0].pose.position);
    let other = modes.iter().find(|mode| distance_m(mode) > SAME_PLACE_M)?;
    let score_ratio = (EVIDENCE * (other.value - modes[0].value)).exp().clamp(0.0, 1.0);
    Some(RunnerUp { distance_m: distance_m(other), score_ratio })
}

/// Steps of the compass search: metres east, north and up, degrees of heading, pitch and roll.
type Step = [f64; 6];
const IN_PLAN: [Step; 3] =
    [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]];
const FREE: [Step; 6] = [
    IN_PLAN[0],
    IN_PLAN[1],
    IN_PLAN[2],
    [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
];

/// The fine search.
struct Climber<'a, 'm, 's> {
    panel: &'a mut Panel<'m>,
    photo: Strided<'a, 's>,
    mixture: &'a Mixture,
    prior: Prior,
    scored: u64,
}

impl Climber<'_, '_, '_> {
    fn scores(&mut self, poses: &[Pose]) -> Result<Vec<f64>, PluginError> {
        self.scored += poses.len() as u64;
        let scores = self.photo.scores(self.panel, poses)?;
        Ok(scores.chunks(self.panel.len()).map(|scores| self.mixture.score(scores)).collect())
    }

    fn mode(&self, pose: Pose, score: f64) -> Mode {
        let Prior { pose: prior, height_sigma_m, tilt_sigma_rad, .. } = self.prior;
        let height = (pose.position.height_m - prior.position.height_m) / height_sigma_m.max(LEAST_SIGMA[0]);
        let tilt = [pose.pitch_rad - prior.pitch_rad, pose.roll_rad - prior.roll_rad]
            .map(|off_rad| off_rad / tilt_sigma_rad.max(LEAST_SIGMA[1]));
        let against = (height.powi(2) + tilt[0].powi(2) + tilt[1].powi(2)) / 2.0;
        Mode { pose, score, value: score - against / EVIDENCE }
    }

    /// The best candidates that differ from one another by more than a few steps of the grid, the first among equals.
    fn modes(&self, candidates: &[(Pose, f64)]) -> Vec<Mode> {
        let mut order: Vec<&(Pose, f64)> = candidates.iter().collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut modes: Vec<Mode> = Vec::new();
        for (pose, score) in order {
            let near = |mode: &Mode| {
                mode.pose.position.plan_distance_m(&pose.position) < APART_M
                    && (mode.pose.yaw_rad - pose.yaw_rad).abs() < APART_DEG.to_radians()
            };
            if !modes.iter().any(near) {
                modes.push(self.mode(*pose, *score));
            }
            if modes.len() == MODES {
                break;
            }
        }
        modes
    }

    /// Uphill from `start` along `directions`, with steps from `step` on that halve where no neighbour is better.
    fn climb(&mut self, start: Mode, mut step: f64, directions: &[Step]) -> Result<Mode, PluginError> {
        let score = self.scores(&[start.pose])?[0];
        let mut best = self.mode(start.pose, score);
        while step >= LAST_STEP {
            let around = directions.iter().flat_map(|direction| [*direction, direction.map(|unit| -unit)]);
            let poses: Vec<Pose> =
                around.map(|direction| shifted(&best.pose, direction.map(|unit| unit * step))).collect();
            let scores = self.scores(&poses)?;
            let modes = poses.into_iter().zip(scores).map(|(pose, score)| self.mode(pose, score));
            // The first among equals.
            let next = modes.fold(best, |best, mode| if mode.value > best.value { mode } else { best });
            if next.value > best.value {
                best = next;
            } else {
                step /= 2.0;
            }
        }
        Ok(best)
    }

    /// Second moments of the likelihood about `best`, over a lattice.
    fn covariance(&mut self, best: &Mode) -> Result<[[f64; 3]; 3], PluginError> {
        let steps = || (-SPREAD_STEPS..=SPREAD_STEPS).map(f64::from);
        let lattice: Vec<[f64; 3]> =
            steps().flat_map(|e| steps().flat_map(move |n| steps().map(move |t| [e, n, t]))).collect();
        let poses: Vec<Pose> =
            lattice.iter().map(|[e, n, turn]| shifted(&best.pose, [*e, *n, 0.0, *turn, 0.0, 0.0])).collect();
        let (mut sum, mut moments) = (0.0, [[0.0; 3]; 3]);
        for ([east, north, turn], score) in lattice.into_iter().zip(self.scores(&poses)?) {
            let weight = (EVIDENCE * (score - best.score)).min(0.0).exp();
            let offset = [east, north, turn.to_radians()];
            for (row, a) in moments.iter_mut().zip(offset) {
                for (cell, b) in row.iter_mut().zip(offset) {
                    *cell += weight * a * b;
                }
            }
            sum += weight;
        }
        for (axis, row) in moments.iter_mut().enumerate() {
            row.iter_mut().for_each(|cell| *cell /= sum);
            row[axis] += FLOOR[axis].powi(2);
        }
        Ok(moments)
    }
}

/// `pose` moved by metres and turned by degrees.
fn shifted(pose: &Pose, [east_m, north_m, up_m, turn_deg, pitch_deg, roll_deg]: Step) -> Pose {
    let mut shifted = *pose;
    shifted.position.easting_m += east_m;
    shifted.position.northing_m += north_m;
    shifted.position.height_m += up_m;
    shifted.yaw_rad += turn_deg.to_radians();
    shifted.pitch_rad += pitch_deg.to_radians();
    shifted.roll_rad += roll_deg.to_radians();
    shifted
}
