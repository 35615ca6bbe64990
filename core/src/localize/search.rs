//! The search that the host drives for matchers in `score` form: a coarse grid, then a compass search from its best
//! modes. (A matcher in `search` form brings its own.)

use super::compare::every;
use super::services::SceneServices;
use crate::image::LabelImage;
use crate::plugin::{Matcher, PluginError, Services, ViewImages};
use crate::render::{SolidMask, view};
use resurvey_schema::{GridPoint, Localization, Pose, RunnerUp};

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

/// Spacing of the coarse grid, metres and degrees: 39 times fewer candidates than 1 m and 1°.
const COARSE_M: f64 = 4.0;
const COARSE_DEG: f64 = 4.0;
/// Samples along the longer side of the image in the coarse and the fine search.
const COARSE_SAMPLES: u32 = 96;
const FINE_SAMPLES: u32 = 192;
/// Coarse candidates that are refined.
const MODES: usize = 12;
/// The compass search ends below this step, metres (and the same number of degrees).
const LAST_STEP: f64 = 0.06;
/// Log likelihood lost when the score drops by one: the number of independent label patches, not of pixels.
const EVIDENCE: f64 = 150.0;
/// Modes closer than this are the same answer, metres.
const SAME_PLACE_M: f64 = 5.0;
/// Half-width of the lattice that the covariance is taken over, in steps of a metre and a degree.
const SPREAD_STEPS: i32 = 3;
/// The search ends on a grid this fine, so that no answer is surer: metres and radians.
const FLOOR: [f64; 3] = [0.1, 0.1, 0.002];

#[derive(Clone, Copy)]
struct Mode {
    pose: Pose,
    score: f64,
}

/// One stride of the photo and the plugin that scores it.
struct Scorer<'a, 's> {
    matcher: &'a mut Matcher,
    services: &'a SceneServices<'s>,
    photo: LabelImage,
    stride: u32,
    scored: u64,
}

/// The best pose around the prior, as `matcher` scores views.
pub(super) fn search(
    matcher: &mut Matcher,
    services: &SceneServices<'_>,
    limits: &SearchLimits,
) -> Result<Localization, PluginError> {
    let prior = services.capture().prior.pose;
    let solids = SolidMask::at_height(services.world().scene(false), prior.position.height_m);
    let headings = headings(prior.yaw_rad, limits.yaw_range_deg);
    let all = positions(prior.position, limits.radius_m);
    let free: Vec<GridPoint> = all.iter().copied().filter(|position| !solids.contains(*position)).collect();
    let skipped = ((all.len() - free.len()) * headings.len()) as u64;
    let mut scorer = Scorer::new(matcher, services, COARSE_SAMPLES);
    let (mut best, mut heat) = (Vec::new(), Vec::new());
    let turned = |position: &GridPoint| {
        let position = *position;
        headings.iter().map(move |yaw_rad| Pose { position, yaw_rad: *yaw_rad, ..prior })
    };
    let poses: Vec<Pose> = free.iter().flat_map(turned).collect();
    let scores = scorer.scores(&poses, &|done| services.progress(0.7 * done))?;
    for (poses, scores) in poses.chunks(headings.len()).zip(scores.chunks(headings.len())) {
        let mode = best_of(poses, scores);
        heat.push([mode.pose.position.easting_m, mode.pose.position.northing_m, mode.score]);
        best.push(mode);
    }
    best.sort_by(|a, b| b.score.total_cmp(&a.score));
    best.truncate(MODES);
    let mut scorer = Scorer { scored: scorer.scored, ..Scorer::new(scorer.matcher, services, FINE_SAMPLES) };
    // Where every free position is inside a building the prior itself is all there is.
    let mut modes = if best.is_empty() { vec![scorer.best_of(&[prior])?] } else { best };
    for mode in &mut modes {
        *mode = scorer.climb(*mode)?;
    }
    modes.sort_by(|a, b| b.score.total_cmp(&a.score));
    let covariance = scorer.covariance(&modes[0])?;
    let (pose, score) = (modes[0].pose, modes[0].score);
    Ok(Localization {
        pose,
        score,
        covariance,
        alignment: None,
        runner_up: runner_up(&modes),
        candidates: scorer.scored,
        skipped,
        heat,
    })
}

/// The best of `poses`, the first among equals; `poses` is not empty.
fn best_of(poses: &[Pose], scores: &[f64]) -> Mode {
    let mut best = Mode { pose: poses[0], score: f64::NEG_INFINITY };
    for (pose, score) in poses.iter().zip(scores) {
        if *score > best.score {
            best = Mode { pose: *pose, score: *score };
        }
    }
    best
}

fn positions(centre: GridPoint, radius_m: f64) -> Vec<GridPoint> {
    let reach = (radius_m.max(0.0) / COARSE_M).floor() as i32;
    let offsets = (-reach..=reach).flat_map(|north| (-reach..=reach).map(move |east| (east, north)));
    offsets
        .map(|(east, north)| (f64::from(east) * COARSE_M, f64::from(north) * COARSE_M))
        .filter(|(east_m, north_m)| east_m.hypot(*north_m) <= radius_m)
        .map(|(east_m, north_m)| GridPoint {
            easting_m: centre.easting_m + east_m,
            northing_m: centre.northing_m + north_m,
            ..centre
        })
        .collect()
}

fn headings(centre_rad: f64, range_deg: f64) -> Vec<f64> {
    let steps = (range_deg.clamp(0.0, 180.0) / COARSE_DEG).floor() as i32;
    (-steps..=steps).map(|step| centre_rad + (f64::from(step) * COARSE_DEG).to_radians()).collect()
}

fn runner_up(modes: &[Mode]) -> Option<RunnerUp> {
    let distance_m = |mode: &Mode| mode.pose.position.plan_distance_m(&modes[0].pose.position);
    let other = modes.iter().find(|mode| distance_m(mode) > SAME_PLACE_M)?;
    let score_ratio = (EVIDENCE * (other.score - modes[0].score)).exp().clamp(0.0, 1.0);
    Some(RunnerUp { distance_m: distance_m(other), score_ratio })
}

impl<'a, 's> Scorer<'a, 's> {
    fn new(matcher: &'a mut Matcher, services: &'a SceneServices<'s>, samples: u32) -> Self {
        let labels = &services.capture().labels;
        let stride = (labels.width().max(labels.height()) / samples).max(1);
        Self { matcher, services, photo: every(labels, stride), stride, scored: 0 }
    }

    /// The score of every pose; `progress` hears which share of them is rendered.
    fn scores(&mut self, poses: &[Pose], progress: &dyn Fn(f64)) -> Result<Vec<f64>, PluginError> {
        let scene = self.services.world().scene(true);
        let camera = self.services.capture().camera.subsampled(self.stride);
        self.scored += poses.len() as u64;
        self.matcher.score_each(&self.photo, poses.len(), &mut |index, take| {
            let view = view(scene, &camera, &poses[index]);
            take(&ViewImages {
                origin: view.origin,
                labels: &view.labels,
                range_m: &view.range_m,
                points: &view.points,
                features: &view.features,
                feature_table: scene.feature_table(),
            });
            progress((index + 1) as f64 / poses.len() as f64);
        })
    }

    /// The best of `poses`, the first among equals; `poses` is not empty.
    fn best_of(&mut self, poses: &[Pose]) -> Result<Mode, PluginError> {
        let scores = self.scores(poses, &|_| {})?;
        Ok(best_of(poses, &scores))
    }

    fn climb(&mut self, start: Mode) -> Result<Mode, PluginError> {
        let mut best = self.best_of(&[start.pose])?;
        let mut step = COARSE_M / 2.0;
        while step >= LAST_STEP {
            let around = [
                [1.0, 0.0, 0.0],
                [-1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, -1.0, 0.0],
                [0.0, 0.0, 1.0],
                [0.0, 0.0, -1.0],
            ];
            let poses: Vec<Pose> =
                around.iter().map(|direction| shifted(&best.pose, direction.map(|unit| unit * step))).collect();
            let next = self.best_of(&poses)?;
            if next.score > best.score {
                best = next;
            } else {
                step /= 2.0;
            }
        }
        Ok(best)
    }

    /// Second moments of the likelihood about `best`, over a lattice.
    fn covariance(&mut self, best: &Mode) -> Result<[[f64; 3]; 3], PluginError> {
        let (mut sum, mut moments) = (0.0, [[0.0; 3]; 3]);
        let steps = || (-SPREAD_STEPS..=SPREAD_STEPS).map(f64::from);
        let offsets: Vec<[f64; 3]> =
            steps().flat_map(|e| steps().flat_map(move |n| steps().map(move |t| [e, n, t]))).collect();
        let poses: Vec<Pose> = offsets.iter().map(|offset| shifted(&best.pose, *offset)).collect();
        let scores = self.scores(&poses, &|_| {})?;
        for ([east, north, turn], score) in offsets.into_iter().zip(scores) {
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

/// `pose` moved by metres east and north and turned by degrees.
fn shifted(pose: &Pose, [east_m, north_m, turn_deg]: [f64; 3]) -> Pose {
    let mut shifted = *pose;
    shifted.position.easting_m += east_m;
    shifted.position.northing_m += north_m;
    shifted.yaw_rad += turn_deg.to_radians();
    shifted
}
