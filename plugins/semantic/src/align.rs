//! The pose at which the contours of view and photo coincide: weighted least squares over six degrees of freedom, and
//! how far it can be trusted.

use crate::edges::{Edge, Facing, contours, displacement};
use crate::likeness::Compared;
use crate::mode::angle_between;
use crate::refine::{Move, moved};
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector6};
use crate::mixed::{Sample, solve};
use resurvey_plugin::schema::{ClassId, Pose};
use resurvey_plugin::{Error, Host, Photo, Prior};

/// Contour samples of one view.
const SAMPLES: usize = 1500;
/// Stride of the views, and 1σ that a contour is expected off: of the labels and the pose (full-size pixels), and of the
/// map (metres), iteration by iteration.
const ROUNDS: [(u32, [f64; 2]); 7] = [
    (4, [12.0, 0.3]),
    (4, [8.0, 0.3]),
    (2, [5.0, 0.3]),
    (2, [5.0, 0.3]),
    (2, [5.0, 0.3]),
    (1, [5.0, 0.3]),
    (1, [5.0, 0.3]),
];
/// Steps of the numeric derivatives: metres, radians.
const DERIVATIVE: [f64; 6] = [0.02, 0.02, 0.02, 1e-3, 1e-3, 1e-3];
/// Fewer samples than this determine nothing.
const FEWEST: usize = 30;
/// Contours wander together over about this far, pixels.
const CORRELATION_PX: f64 = 30.0;
/// Side of the cells in plan whose contours are taken to be off together, metres: about a building's front.
const PART_M: f64 = 15.0;

/// An aligned pose.
#[derive(Clone, Copy, Debug)]
pub struct Aligned {
    /// The pose.
    pub pose: Pose,
    /// Covariance over easting (m), northing (m), yaw (rad).
    pub covariance: [[f64; 3]; 3],
    /// 1σ of a contour's place from labels, pixels, and from the map, metres.
    pub noise: [f64; 2],
    /// Share of the contour samples that found their counterpart.
    pub matched: f64,
}

/// Aligns `start`; `None` when too few contours find their counterpart.
pub fn align(
    host: &dyn Host,
    photo: &Photo<'_>,
    compared: &Compared,
    use_prior: bool,
    start: &Pose,
) -> Result<Option<Aligned>, Error> {
    let mut pose = *start;
    let mut last = None;
    for (stride, expected) in ROUNDS {
        if host.cancelled() {
            return Err(Error("cancelled".to_owned()));
        }
        let Some((rows, matched)) = rows(host, photo, compared, &pose, stride, expected)? else { return Ok(None) };
        let prior = if use_prior { prior_information(&photo.prior) } else { free(&photo.prior) };
        let Some(solution) = solve(&rows, &prior, &prior_offset(&photo.prior, &pose)) else { return Ok(None) };
        let longest = solution.step.fixed_rows::<3>(0).norm();
        // A solution far from where it was linearised may overshoot.
        let step = solution.step * (1.0_f64).min(1.0 / longest.max(f64::MIN_POSITIVE));
        pose = moved(&pose, &step.into());
        last = Some((solution, matched));
    }
    let Some((solution, matched)) = last else { return Ok(None) };
    let covariance = in_grid(&solution.covariance, pose.yaw_rad);
    Ok(Some(Aligned { pose, covariance, noise: [solution.label_sigma_px, solution.map_sigma_m], matched }))
}

fn rows(
    host: &dyn Host,
    photo: &Photo<'_>,
    compared: &Compared,
    pose: &Pose,
    stride: u32,
    expected: [f64; 2],
) -> Result<Option<(Vec<Sample>, f64)>, Error> {
    let views = host.render(stride, true, &[*pose])?;
    let Some(view) = views.first() else { return Ok(None) };
    let all = contours(view, stride, 1, compared);
    let edges: Vec<Edge> = all.iter().step_by((all.len() / SAMPLES).max(1)).copied().collect();
    let focal = 0.5 * (photo.camera.fx + photo.camera.fy);
    let scale = |edge: &Edge| focal / edge.range_m.max(0.5);
    let displaced = |edge: &Edge| {
        let sigma_px = variance(expected, scale(edge)).sqrt();
        Some((*edge, displacement(&photo.labels, edge, sigma_px, compared)?))
    };
    let found: Vec<(Edge, f64)> = edges.iter().filter_map(displaced).collect();
    if found.len() < FEWEST {
        return Ok(None);
    }
    let matched = found.len() as f64 / edges.len() as f64;
    let points: Vec<_> = found.iter().map(|(edge, _)| edge.point).collect();
    let mut derivatives = vec![Some(Vector6::zeros()); found.len()];
    for axis in 0..6 {
        let shifted = |sign: f64| {
            let mut step: Move = [0.0; 6];
            step[axis] = sign * DERIVATIVE[axis];
            host.project(&moved(pose, &step), &points)
        };
        let (ahead, behind) = (shifted(1.0)?, shifted(-1.0)?);
        for ((derivative, (edge, _)), (ahead, behind)) in
            derivatives.iter_mut().zip(&found).zip(ahead.iter().zip(&behind))
        {
            match (derivative.as_mut(), ahead, behind) {
                (Some(derivative), Some(ahead), Some(behind)) => {
                    let along = |axis: usize| (ahead[axis] - behind[axis]) * edge.normal[axis];
                    derivative[axis] = (along(0) + along(1)) / (2.0 * DERIVATIVE[axis]);
                }
                _ => *derivative = None,
            }
        }
    }
    let pixels_a_row = all.len() as f64 * f64::from(stride) / edges.len().max(1) as f64;
    let share = (pixels_a_row / CORRELATION_PX).min(1.0);
    let sky = host.classes().by_name("sky").map_or(ClassId::VOID.0, |class| class.index.0);
    let rows = found.iter().zip(derivatives).filter_map(|((edge, residual_px), derivative)| {
        let cell = |metres: f64| (metres / PART_M).floor() as i32;
        let rim = i32::from(edge.to == sky || edge.from == sky);
        let facing = match edge.facing {
            Facing::Flat => 0,
            Facing::Upright(quarter) => 1 + quarter,
        };
        let part = [cell(edge.point.easting_m), cell(edge.point.northing_m), 2 * facing + rim];
        Some(Sample { part, residual_px: *residual_px, by_move: derivative?, share })
    });
    Ok(Some((rows.collect(), matched)))
}

fn variance([pixels, metres]: [f64; 2], scale: f64) -> f64 {
    pixels.powi(2) + (metres * scale).powi(2)
}

/// Information of the prior in the camera's own axes.
fn prior_information(prior: &Prior) -> Matrix6<f64> {
    let sigmas = [
        prior.position_sigma_m,
        prior.position_sigma_m,
        prior.height_sigma_m,
        prior.yaw_sigma_rad,
        prior.tilt_sigma_rad,
        prior.tilt_sigma_rad,
    ];
    Matrix6::from_diagonal(&Vector6::from_iterator(sigmas.map(|sigma| 1.0 / sigma.max(1e-4).powi(2))))
}

/// No information on position and heading; height and tilt that are known exactly stay.
fn free(prior: &Prior) -> Matrix6<f64> {
    let held = |sigma: f64| if sigma > 0.0 { 1e-6 } else { 1e12 };
    Matrix6::from_diagonal(&Vector6::new(
        1e-6,
        1e-6,
        held(prior.height_sigma_m),
        1e-6,
        held(prior.tilt_sigma_rad),
        held(prior.tilt_sigma_rad),
    ))
}

/// The move that leads from `pose` to the prior.
fn prior_offset(prior: &Prior, pose: &Pose) -> Vector6<f64> {
    let (sin, cos) = pose.yaw_rad.sin_cos();
    let east = prior.pose.position.easting_m - pose.position.easting_m;
    let north = prior.pose.position.northing_m - pose.position.northing_m;
    Vector6::new(
        east * cos - north * sin,
        east * sin + north * cos,
        prior.pose.position.height_m - pose.position.height_m,
        angle_between(prior.pose.yaw_rad, pose.yaw_rad),
        prior.pose.pitch_rad - pose.pitch_rad,
        prior.pose.roll_rad - pose.roll_rad,
    )
}

fn in_grid(covariance: &Matrix6<f64>, yaw_rad: f64) -> [[f64; 3]; 3] {
    let (sin, cos) = yaw_rad.sin_cos();
    let mut to_grid = SMatrix::<f64, 3, 6>::zeros();
    (to_grid[(0, 0)], to_grid[(0, 1)]) = (cos, sin);
    (to_grid[(1, 0)], to_grid[(1, 1)]) = (-sin, cos);
    to_grid[(2, 3)] = 1.0;
    let in_grid: Matrix3<f64> = to_grid * covariance * to_grid.transpose();
    std::array::from_fn(|row| std::array::from_fn(|column| in_grid[(row, column)]))
}
