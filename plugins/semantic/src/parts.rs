//! Contour samples by the part of the map that they lie on: what is off together.

use crate::edges::{Edge, Facing};
use crate::mixed::Sample;
use nalgebra::{Vector3, Vector6};
use resurvey_plugin::schema::GridPoint;
use std::collections::BTreeMap;

/// Length of wall, and side of the cells of level surfaces, that is taken to be off together, metres: about a building's
/// front.
const PART_M: f64 = 25.0;
/// Shifts of a wall up and of a rim up, as shares of its shift in plan: heights are known half as well.
const UP: [f64; 2] = [0.2, 2.0];
/// Shift of a level surface in plan as a share of its shift up.
const LEVEL_IN_PLAN: f64 = 0.3;
/// Parts with fewer of all samples than one in this many, or than `FEWEST`, are strays.
const STRAY_SHARE: usize = 60;
const FEWEST: usize = 8;

/// Facing, place along the surface, and whether it is a rim against the sky.
pub type Part = [i32; 4];

/// Part of the map that `edge` lies on.
pub fn part_of(edge: &Edge, is_rim: bool) -> Part {
    let cell = |metres: f64| (metres / PART_M).floor() as i32;
    let rim = i32::from(is_rim);
    match edge.facing {
        Facing::Level => [cell(edge.point.easting_m), cell(edge.point.northing_m), i32::MIN, rim],
        Facing::Upright { angle, offset } => {
            let (sin, cos) = Facing::radians(angle).sin_cos();
            [cell(edge.point.easting_m * cos - edge.point.northing_m * sin), angle, offset, rim]
        }
    }
}

/// What a shift of the part of `edge` along its own three axes does to the contour, given what a move of a camera with
/// this heading does: a shift of the surface looks like the opposite shift of the camera.
pub fn by_shift(edge: &Edge, is_rim: bool, by_move: &Vector6<f64>, yaw_rad: f64) -> Vector3<f64> {
    let (sin, cos) = yaw_rad.sin_cos();
    let by = |east: f64, north: f64, up: f64| {
        -(by_move[0] * (east * cos - north * sin) + by_move[1] * (east * sin + north * cos) + by_move[2] * up)
    };
    match edge.facing {
        Facing::Level => Vector3::new(by(LEVEL_IN_PLAN, 0.0, 0.0), by(0.0, LEVEL_IN_PLAN, 0.0), by(0.0, 0.0, 1.0)),
        Facing::Upright { angle, .. } => {
            let (sin, cos) = Facing::radians(angle).sin_cos();
            Vector3::new(by(sin, cos, 0.0), by(cos, -sin, 0.0), by(0.0, 0.0, UP[usize::from(is_rim)]))
        }
    }
}

/// Gives stray samples, whose surface was read wrongly at a corner or an edge, to the nearest large part.
pub fn join_strays(samples: &mut [Sample], points: &[GridPoint]) {
    let mut sizes: BTreeMap<Part, usize> = BTreeMap::new();
    samples.iter().for_each(|sample| *sizes.entry(sample.part).or_default() += 1);
    let least = (samples.len() / STRAY_SHARE).max(FEWEST);
    let is_large = |sample: &Sample| sizes.get(&sample.part).is_some_and(|&size| size >= least);
    let large: Vec<(GridPoint, Part)> = samples
        .iter()
        .zip(points)
        .filter(|(sample, _)| is_large(sample))
        .map(|(sample, point)| (*point, sample.part))
        .collect();
    for (sample, at) in samples.iter_mut().zip(points).filter(|(sample, _)| !is_large(sample)) {
        let distance = |(point, _): &&(GridPoint, Part)| at.plan_distance_m(point).hypot(at.height_m - point.height_m);
        if let Some((_, part)) = large.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            sample.part = *part;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strays_join_the_part_that_they_lie_on() {
        let sample =
            |part| Sample { part, residual_px: 0.0, by_move: Vector6::zeros(), by_shift: Vector3::zeros(), share: 1.0 };
        let mut samples = vec![sample([0; 4]); 20];
        samples.extend(vec![sample([1; 4]); 20]);
        samples.push(sample([2; 4]));
        let mut points = vec![GridPoint::new(0.0, 0.0, 0.0); 20];
        points.extend(vec![GridPoint::new(10.0, 0.0, 0.0); 20]);
        points.push(GridPoint::new(9.0, 0.0, 1.0));
        join_strays(&mut samples, &points);
        assert_eq!(samples[40].part, [1; 4]);
        assert_eq!(samples.iter().filter(|sample| sample.part == [0; 4]).count(), 20);
    }
}
