//! The candidates of the host-driven search: a coarse grid around the prior, and a close one about its best nodes.

use super::mixture::Mixture;
use super::panel::Panel;
use super::search::SearchLimits;
use super::services::SceneServices;
use super::stride::Strided;
use crate::plugin::{PluginError, Services};
use crate::render::SolidMask;
use resurvey_schema::{GridPoint, Pose};
use std::collections::BTreeSet;

/// Steps of the close grid, metres and degrees.
const CLOSE_M: f64 = 1.0;
const CLOSE_DEG: f64 = 2.0;
/// The coarse grid has every fourth and every second of them: 39 times fewer candidates than 1 m and 1°.
const COARSE: [i32; 3] = [4, 4, 2];
/// Coarse nodes about which the close grid is laid, and how many steps to either side: what lies between coarse nodes
/// need not be downhill from any of them.
const LOOKED_AROUND: usize = 48;
const AROUND: [i32; 3] = [2, 2, 1];
/// Samples along the longer side of the image.
const SAMPLES: u32 = 96;

/// A candidate: steps of the close grid east, north and clockwise from the prior.
type Node = [i32; 3];

/// All candidates with their scores.
pub(super) struct Candidates {
    /// How the matchers' scores become one.
    pub mixture: Mixture,
    /// Candidates and scores, those of the coarse grid first, position by position.
    pub scored: Vec<(Pose, f64)>,
    /// Candidates left out because they lie inside a solid.
    pub skipped: u64,
    coarse: usize,
    headings: usize,
}

impl Candidates {
    /// Those within `limits` of the prior, as the matchers of `panel` score them.
    pub fn new(
        panel: &mut Panel<'_>,
        services: &SceneServices<'_>,
        limits: &SearchLimits,
    ) -> Result<Self, PluginError> {
        let prior = services.capture().prior.pose;
        let solids = SolidMask::at_height(services.world().scene(false), prior.position.height_m);
        let is_free = |node: &Node| !solids.contains(pose(&prior, node).position);
        let headings = headings(limits.yaw_range_deg);
        let all = positions(limits.radius_m);
        let mut free: Vec<Node> = all.iter().copied().filter(is_free).collect();
        let skipped = ((all.len() - free.len()) * headings.len()) as u64;
        if free.is_empty() {
            // Every position is inside a building: the prior itself is all there is.
            free.push([0, 0, 0]);
        }
        let photo = Strided::new(services, SAMPLES);
        let (mut nodes, mut scores) = (Vec::new(), Vec::new());
        for (index, [east, north, _]) in free.iter().enumerate() {
            let there: Vec<Node> = headings.iter().map(|heading| [*east, *north, *heading]).collect();
            scores.extend(photo.scores(panel, &poses(&prior, &there))?);
            nodes.extend(there);
            services.progress(0.5 * (index + 1) as f64 / free.len() as f64);
        }
        let mixture = panel.mixture(&scores);
        let coarse = nodes.len();
        let mut scores: Vec<f64> = scores.chunks(panel.len()).map(|scores| mixture.score(scores)).collect();
        let close: Vec<Node> = around(&nodes, &scores).into_iter().filter(is_free).collect();
        let close_scores = photo.scores(panel, &poses(&prior, &close))?;
        scores.extend(close_scores.chunks(panel.len()).map(|scores| mixture.score(scores)));
        nodes.extend(close);
        services.progress(0.7);
        let scored = poses(&prior, &nodes).into_iter().zip(scores).collect();
        Ok(Self { mixture, scored, skipped, coarse, headings: headings.len() })
    }

    /// Easting, northing and the best score of each position of the coarse grid.
    pub fn heat(&self) -> Vec<[f64; 3]> {
        let best = |there: &[(Pose, f64)]| {
            let position = there[0].0.position;
            let score = there.iter().map(|(_, score)| *score).fold(f64::NEG_INFINITY, f64::max);
            [position.easting_m, position.northing_m, score]
        };
        self.scored[..self.coarse].chunks(self.headings).map(best).collect()
    }
}

/// The nodes of the close grid about the best of `nodes`, those left out.
fn around(nodes: &[Node], scores: &[f64]) -> BTreeSet<Node> {
    let mut order: Vec<usize> = (0..nodes.len()).collect();
    order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
    let steps = |axis: usize| -AROUND[axis]..=AROUND[axis];
    let mut close = BTreeSet::new();
    for [east, north, turn] in order.into_iter().take(LOOKED_AROUND).map(|index| nodes[index]) {
        for (e, n) in steps(0).flat_map(|e| steps(1).map(move |n| (e, n))) {
            close.extend(steps(2).map(|t| [east + e, north + n, turn + t]));
        }
    }
    for node in nodes {
        close.remove(node);
    }
    close
}

fn pose(prior: &Pose, [east, north, turn]: &Node) -> Pose {
    let position = GridPoint {
        easting_m: prior.position.easting_m + f64::from(*east) * CLOSE_M,
        northing_m: prior.position.northing_m + f64::from(*north) * CLOSE_M,
        ..prior.position
    };
    Pose { position, yaw_rad: prior.yaw_rad + (f64::from(*turn) * CLOSE_DEG).to_radians(), ..*prior }
}

fn poses(prior: &Pose, nodes: &[Node]) -> Vec<Pose> {
    nodes.iter().map(|node| pose(prior, node)).collect()
}

fn positions(radius_m: f64) -> Vec<Node> {
    let radius = radius_m.max(0.0) / CLOSE_M;
    let reach = |axis: usize| (radius / f64::from(COARSE[axis])).floor() as i32;
    let steps = |axis: usize| (-reach(axis)..=reach(axis)).map(move |step| step * COARSE[axis]);
    let square = steps(1).flat_map(|north| steps(0).map(move |east| [east, north, 0]));
    square.filter(|[east, north, _]| f64::from(*east).hypot(f64::from(*north)) <= radius).collect()
}

fn headings(range_deg: f64) -> Vec<i32> {
    let reach = (range_deg.clamp(0.0, 180.0) / (CLOSE_DEG * f64::from(COARSE[2]))).floor() as i32;
    (-reach..=reach).map(|step| step * COARSE[2]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coarse_grid_covers_circle_and_sector_every_four_metres_and_degrees() {
        // Whole points within a circle of radius 10: 317 (Gauss's circle problem, OEIS A000328).
        assert_eq!((positions(40.0).len(), headings(40.0).len()), (317, 21));
        assert_eq!((positions(0.0), headings(0.0)), (vec![[0, 0, 0]], vec![0]));
        assert_eq!(headings(500.0).len(), 91);
    }

    #[test]
    fn the_close_grid_lies_about_the_best_nodes_and_has_no_coarse_one() {
        let nodes: Vec<Node> = positions(40.0).into_iter().map(|[east, north, _]| [east, north, 0]).collect();
        let far = |[east, north, _]: &Node| f64::from(east - 8).hypot(f64::from(north + 4));
        let scores: Vec<f64> = nodes.iter().map(|node| -far(node)).collect();
        let close = around(&nodes, &scores);
        assert!(close.contains(&[9, -5, 1]) && close.contains(&[8, -4, -1]) && !close.contains(&[8, -4, 0]));
        // 48 whole points of a lattice of 4 m fill a circle of about 16 m.
        assert!(close.iter().all(|node| far(node) < 22.0));
    }
}
