//! The pose at which the contours of view and photo coincide: least squares over six degrees of freedom, and how far it
//! can be trusted.

use crate::doubt::SAME_PLACE_M;
use crate::edges::{Edge, contours, displacement};
use crate::likeness::Compared;
use crate::mixed::{Sample, Solution, solve};
use crate::mode::{Mode, angle_between};
use crate::parts::{by_shift, join_strays, part_of};
use crate::refine::{Move, Objective, moved};
use nalgebra::{Matrix6, Vector6};
use resurvey_plugin::schema::{Alignment as AlignmentRecord, ClassId, Pose};
use resurvey_plugin::{Error, Host, Photo, Prior};

/// Contour samples of one view.
const SAMPLES: usize = 1500;
/// Stride of the views, and 1σ that labels and pose put a contour off, full-size pixels, iteration by iteration.
const ROUNDS: [(u32, f64); 6] = [(4, 12.0), (4, 8.0), (2, 5.0), (2, 5.0), (1, 5.0), (1, 5.0)];
/// 1σ that the map puts a contour off, metres: what city models are said to be good to.
const MAP_SIGMA_M: f64 = 0.3;
/// Steps of the numeric derivatives: metres, radians.
const DERIVATIVE: [f64; 6] = [0.02, 0.02, 0.02, 1e-3, 1e-3, 1e-3];
/// Fewer samples than this determine nothing.
const FEWEST: usize = 30;
/// Contours wander together over about this far, pixels.
const CORRELATION_PX: f64 = 30.0;
/// Modes that are aligned.
const MODES: usize = 3;
/// Longest step, metres: further from where it was linearised a solution overshoots.
const LONGEST_M: f64 = 1.0;

/// What is aligned with what.
pub struct Alignment<'a, 'p> {
    /// Services of the host.
    pub host: &'a dyn Host,
    /// The photo.
    pub photo: &'a Photo<'p>,
    /// Classes that count.
    pub compared: &'a Compared,
    /// Whether the prior is an observation too.
    pub use_prior: bool,
}

/// An aligned pose.
#[derive(Clone, Copy, Debug)]
pub struct Aligned {
    /// The pose.
    pub pose: Pose,
    /// How far it can be trusted, and what was found out about map and labels.
    pub alignment: AlignmentRecord,
}

impl Alignment<'_, '_> {
    /// Aligns `start`; `None` when too few contours find their counterpart.
    pub fn align(&self, start: &Pose) -> Result<Option<Aligned>, Error> {
        let mut pose = *start;
        let mut last = None;
        for (stride, label_sigma_px) in ROUNDS {
            if self.host.cancelled() {
                return Err(Error("cancelled".to_owned()));
            }
            let Some(samples) = self.samples(&pose, stride, label_sigma_px)? else { return Ok(None) };
            let Some(solution) = self.solve(&samples, &pose) else { return Ok(None) };
            let length_m = solution.step.fixed_rows::<3>(0).norm();
            pose = moved(&pose, &(solution.step * (LONGEST_M / length_m.max(LONGEST_M))).into());
            last = Some(solution);
        }
        Ok(last.map(|solution| Aligned { pose, alignment: record(&solution, pose.yaw_rad) }))
    }

    /// Aligns the best of `modes` (sorted best first) and the best of another place, sorts `modes` anew, and returns the
    /// winner at its aligned pose with its covariance; none where it could not be aligned.
    pub fn best_of(
        &self,
        objective: &Objective<'_, '_>,
        modes: &mut [Mode],
    ) -> Result<(Mode, Option<AlignmentRecord>), Error> {
        let elsewhere = elsewhere(modes).filter(|&index| index >= MODES);
        let mut aligned = Vec::new();
        for index in (0..modes.len().min(MODES)).chain(elsewhere) {
            let found = modes[index];
            let stayed = self.align(&found.pose)?.filter(|aligned| is_near(&found.pose, &aligned.pose));
            let at_aligned = stayed.map(|aligned| objective.at(aligned.pose)).transpose()?;
            // Walls that stand elsewhere pull the likelihood's peak and the contours apart: either may speak for a mode.
            let better = at_aligned.filter(|mode| mode.log_posterior > found.log_posterior).unwrap_or(found);
            modes[index] = better;
            aligned.push((better, at_aligned, stayed));
        }
        modes.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
        let best = aligned.iter().max_by(|a, b| a.0.log_posterior.total_cmp(&b.0.log_posterior));
        let (found, at_aligned, stayed) = best.ok_or_else(|| Error("no mode to align".to_owned()))?;
        Ok((at_aligned.unwrap_or(*found), stayed.map(|aligned| aligned.alignment)))
    }

    fn solve(&self, samples: &[Sample], pose: &Pose) -> Option<Solution> {
        let prior = &self.photo.prior;
        solve(samples, &information(prior, self.use_prior), &offset(prior, pose))
    }

    /// Residuals at `pose` on views of every `stride`-th pixel; `None` when there are too few.
    fn samples(&self, pose: &Pose, stride: u32, label_sigma_px: f64) -> Result<Option<Vec<Sample>>, Error> {
        let views = self.host.render(stride, true, &[*pose])?;
        let Some(view) = views.first() else { return Ok(None) };
        let all = contours(view, pose.position, stride, self.compared);
        let every = (all.len() / SAMPLES).max(1);
        let focal_px = 0.5 * (self.photo.camera.fx + self.photo.camera.fy);
        let displaced = |edge: &Edge| {
            let sigma_px = label_sigma_px.hypot(MAP_SIGMA_M * focal_px / edge.range_m.max(0.5));
            Some((*edge, displacement(&self.photo.labels, edge, sigma_px, self.compared)?))
        };
        let found: Vec<(Edge, f64)> = all.iter().step_by(every).filter_map(displaced).collect();
        if found.len() < FEWEST {
            return Ok(None);
        }
        let sky = self.host.classes().by_name("sky").map_or(ClassId::VOID.0, |class| class.index.0);
        let share = (every as f64 * f64::from(stride) / CORRELATION_PX).min(1.0);
        let (mut samples, mut points) = (Vec::new(), Vec::new());
        for ((edge, residual_px), by_move) in found.iter().zip(self.derivatives(pose, &found)?) {
            let Some(by_move) = by_move else { continue };
            let is_rim = edge.from == sky || edge.to == sky;
            let by_shift = by_shift(edge, is_rim, &by_move, pose.yaw_rad);
            samples.push(Sample { part: part_of(edge, is_rim), residual_px: *residual_px, by_move, by_shift, share });
            points.push(edge.point);
        }
        join_strays(&mut samples, &points);
        Ok(Some(samples))
    }

    /// What a move of the camera does to each contour along its normal: pixels per metre and per radian.
    fn derivatives(&self, pose: &Pose, found: &[(Edge, f64)]) -> Result<Vec<Option<Vector6<f64>>>, Error> {
        let points: Vec<_> = found.iter().map(|(edge, _)| edge.point).collect();
        let mut derivatives = vec![Some(Vector6::zeros()); found.len()];
        for axis in 0..6 {
            let shifted = |by: f64| {
                let mut step: Move = [0.0; 6];
                step[axis] = by;
                self.host.project(&moved(pose, &step), &points)
            };
            let (ahead, behind) = (shifted(DERIVATIVE[axis])?, shifted(-DERIVATIVE[axis])?);
            let ends = ahead.iter().zip(&behind);
            for ((derivative, (edge, _)), (ahead, behind)) in derivatives.iter_mut().zip(found).zip(ends) {
                match (derivative.as_mut(), ahead, behind) {
                    (Some(derivative), Some(ahead), Some(behind)) => {
                        let along = |axis: usize| (ahead[axis] - behind[axis]) * edge.normal[axis];
                        derivative[axis] = (along(0) + along(1)) / (2.0 * DERIVATIVE[axis]);
                    }
                    _ => *derivative = None,
                }
            }
        }
        Ok(derivatives)
    }
}

/// The best mode at another place than the first.
fn elsewhere(modes: &[Mode]) -> Option<usize> {
    let first = modes.first()?.pose.position;
    modes.iter().position(|mode| mode.pose.position.plan_distance_m(&first) > SAME_PLACE_M)
}

/// Whether the alignment stayed at the place that the search found.
fn is_near(found: &Pose, aligned: &Pose) -> bool {
    let turn = angle_between(found.yaw_rad, aligned.yaw_rad).abs();
    found.position.plan_distance_m(&aligned.position) <= 2.0 * LONGEST_M && turn <= 5_f64.to_radians()
}

/// Information of the prior in the camera's own axes. What it knows exactly stays as it is; position and heading are
/// free without it.
fn information(prior: &Prior, use_prior: bool) -> Matrix6<f64> {
    const EXACT: f64 = 1e-4;
    const FREE: f64 = 1e3;
    let free = |sigma: f64| if use_prior { sigma } else { FREE };
    let held = |sigma: f64| if use_prior || sigma <= 0.0 { sigma } else { FREE };
    let sigmas = [
        free(prior.position_sigma_m),
        free(prior.position_sigma_m),
        held(prior.height_sigma_m),
        free(prior.yaw_sigma_rad),
        held(prior.tilt_sigma_rad),
        held(prior.tilt_sigma_rad),
    ];
    Matrix6::from_diagonal(&Vector6::from_iterator(sigmas.map(|sigma| sigma.max(EXACT).powi(-2))))
}

/// The move that leads from `pose` to the prior.
fn offset(prior: &Prior, pose: &Pose) -> Vector6<f64> {
    let (sin, cos) = pose.yaw_rad.sin_cos();
    let (from, to) = (&pose.position, &prior.pose.position);
    let (east, north) = (to.easting_m - from.easting_m, to.northing_m - from.northing_m);
    Vector6::new(
        east * cos - north * sin,
        east * sin + north * cos,
        to.height_m - from.height_m,
        angle_between(prior.pose.yaw_rad, pose.yaw_rad),
        prior.pose.pitch_rad - pose.pitch_rad,
        prior.pose.roll_rad - pose.roll_rad,
    )
}

/// What `solution` says, in the grid; a move is in the axes of a camera with this heading.
fn record(solution: &Solution, yaw_rad: f64) -> AlignmentRecord {
    let (sin, cos) = yaw_rad.sin_cos();
    let mut grid_from_camera = Matrix6::zeros();
    (grid_from_camera[(0, 0)], grid_from_camera[(0, 1)]) = (cos, sin);
    (grid_from_camera[(1, 0)], grid_from_camera[(1, 1)]) = (-sin, cos);
    for (grid, camera) in [(2, 3), (3, 2), (4, 4), (5, 5)] {
        grid_from_camera[(grid, camera)] = 1.0;
    }
    let in_grid = grid_from_camera * solution.covariance * grid_from_camera.transpose();
    AlignmentRecord {
        covariance: std::array::from_fn(|row| std::array::from_fn(|column| in_grid[(row, column)])),
        map_sigma_m: solution.map_sigma_m,
        label_sigma_px: solution.label_sigma_px,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::schema::GridPoint;

    fn at(position: GridPoint, yaw_rad: f64) -> Pose {
        Pose { position, yaw_rad, pitch_rad: 0.1, roll_rad: 0.0 }
    }

    #[test]
    fn the_offset_leads_back_to_the_prior() {
        let pose = at(GridPoint::new(10.0, 20.0, 5.0), 0.7);
        let prior = Prior {
            pose: Pose { pitch_rad: 0.2, ..at(GridPoint::new(13.0, 16.0, 6.0), 0.9) },
            position_sigma_m: 15.0,
            height_sigma_m: 0.5,
            yaw_sigma_rad: 0.3,
            tilt_sigma_rad: 0.02,
        };
        let back = moved(&pose, &offset(&prior, &pose).into());
        assert!(back.position.plan_distance_m(&prior.pose.position) < 1e-9);
        assert!((back.yaw_rad - 0.9).abs() < 1e-12 && (back.pitch_rad - 0.2).abs() < 1e-12);
        assert!((back.position.height_m - 6.0).abs() < 1e-12);
    }

    #[test]
    fn forward_of_a_camera_that_looks_east_is_easting() {
        let mut covariance = Matrix6::zeros();
        (covariance[(0, 0)], covariance[(1, 1)], covariance[(3, 3)]) = (1.0, 4.0, 9.0);
        let solution = Solution { step: Vector6::zeros(), covariance, map_sigma_m: 0.1, label_sigma_px: 2.0 };
        let found = record(&solution, 90_f64.to_radians()).covariance;
        assert!((found[0][0] - 4.0).abs() < 1e-12 && (found[1][1] - 1.0).abs() < 1e-12);
        assert!((found[2][2] - 9.0).abs() < 1e-12 && found[0][1].abs() < 1e-12);
    }
}
