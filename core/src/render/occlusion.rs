//! Which clusters what is already drawn hides (a two-level z-buffer after Greene, Kass & Miller 1993).

use super::frame::Frame;
use super::projection::{NEAR_M, Projection};
use super::scene::Cluster;
use nalgebra::Vector3;

/// Sides of a tile, pixels.
const TILE: usize = 8;

/// The smallest inverse depth in each tile of the image, at the time it was taken.
#[derive(Clone, Debug, Default)]
pub(super) struct Occlusion {
    columns: usize,
    farthest: Vec<f32>,
    /// Smallest inverse depths over columns of a row of tiles.
    band: Vec<f32>,
}

impl Occlusion {
    /// Forgets everything: nothing hides.
    pub(super) fn clear(&mut self) {
        self.farthest.clear();
    }

    /// Takes what is drawn so far.
    pub(super) fn take(&mut self, frame: &Frame) {
        let width = frame.width();
        self.columns = width.div_ceil(TILE);
        self.farthest.clear();
        for first in (0..frame.height()).step_by(TILE) {
            self.band.clear();
            self.band.extend_from_slice(frame.inverse_depths(first));
            for v in first + 1..(first + TILE).min(frame.height()) {
                for (least, inverse_depth) in self.band.iter_mut().zip(frame.inverse_depths(v)) {
                    *least = if *inverse_depth < *least { *inverse_depth } else { *least };
                }
            }
            self.farthest.extend(self.band.chunks(TILE).map(|tile| tile.iter().copied().fold(f32::INFINITY, f32::min)));
        }
    }

    /// Whether all of the box is behind what was taken, for certain.
    pub(super) fn hides(&self, projection: &Projection, cluster: &Cluster) -> bool {
        if self.farthest.is_empty() {
            return false;
        }
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { cluster.min[axis] } else { cluster.max[axis] };
            let seen = projection.project([pick(0), pick(1), pick(2)]);
            if seen.z < NEAR_M {
                return false;
            }
            let pixel = Vector3::new(seen.x / seen.z, seen.y / seen.z, seen.z);
            low = low.inf(&pixel);
            high = high.sup(&pixel);
        }
        // What is drawn is rounded to f32; a share far above that keeps the answer certain.
        let nearest = (1.0 / low.z * (1.0 + 1e-5)) as f32;
        let tile = |position: f64, size: f64| held(position, size - 1.0) as usize / TILE;
        let columns = tile(low.x - 1.0, projection.width)..=tile(high.x + 1.0, projection.width);
        (tile(low.y - 1.0, projection.height)..=tile(high.y + 1.0, projection.height)).all(|row| {
            let tiles = &self.farthest[row * self.columns..(row + 1) * self.columns];
            tiles[columns.clone()].iter().all(|farthest| *farthest > nearest)
        })
    }
}

fn held(position: f64, last: f64) -> f64 {
    position.max(0.0).min(last)
}
