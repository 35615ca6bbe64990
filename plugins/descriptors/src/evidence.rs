//! What the photo says about each place around a region: it belongs to the region, it shows what the map has, or it says
//! nothing, because something stands there that may hide what is behind.

use crate::edges::shows_map;
use crate::outline::Outline;
use crate::sight::Sight;

/// Pixels around the region that are looked at, as a share of its larger side.
const MARGIN: f64 = 0.5;
/// What the map has this high above the ground, and nearer by this much, may hide an object, metres.
const HIDING_HEIGHT_M: f64 = 0.3;
const HIDING_NEARER_M: f64 = 0.7;

/// Counts of pixels, row by row, from the left up to each column.
pub struct Evidence {
    left: i64,
    top: i64,
    columns: usize,
    rows: usize,
    image: [i64; 2],
    region: Vec<u32>,
    empty: Vec<u32>,
    /// Pixels of the region.
    pub region_px: f64,
}

/// What a place says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Says {
    /// The thing is there.
    Region,
    /// The map is seen: nothing is there.
    Empty,
    /// Anything may be there.
    Nothing,
}

impl Evidence {
    /// About `outline`, whose nearest ground contact has this plan distance and height from the camera, metres.
    pub fn new(sight: &Sight<'_>, outline: &Outline, [near_m, ground_m]: [f64; 2]) -> Self {
        let bounds = outline.bounds;
        let margin = (f64::from(bounds.width().max(bounds.height())) * MARGIN).ceil() as i64;
        let image = sight.size().map(i64::from);
        let (left, top) = ((i64::from(bounds.left) - margin).max(0), (i64::from(bounds.top) - margin).max(0));
        let (right, bottom) =
            ((i64::from(bounds.right) + margin).min(image[0]), (i64::from(bounds.bottom) + margin).min(image[1]));
        let (columns, rows) = ((right - left).max(0) as usize, (bottom - top).max(0) as usize);
        let hides = |u, v| {
            let before = |point: nalgebra::Vector3<f64>| {
                point.z > ground_m + HIDING_HEIGHT_M && point.xy().norm() < near_m - HIDING_NEARER_M
            };
            sight.point(u, v).is_some_and(before)
        };
        let mut region = Vec::with_capacity((columns + 1) * rows);
        let mut empty = Vec::with_capacity((columns + 1) * rows);
        for v in top..bottom {
            let (mut region_sum, mut empty_sum) = (0, 0);
            region.push(0);
            empty.push(0);
            for u in left..right {
                let is_region = outline.contains(u, v);
                region_sum += u32::from(is_region);
                empty_sum += u32::from(!is_region && shows_map(sight, u, v) && !hides(u, v));
                region.push(region_sum);
                empty.push(empty_sum);
            }
        }
        let region_px = outline.pixels().count() as f64;
        Self { left, top, columns, rows, image, region, empty, region_px }
    }

    /// Pixels of the region, and pixels that show the map, in columns `left..right` of row `v`.
    pub fn count(&self, v: i64, [left, right]: [i64; 2]) -> [f64; 2] {
        let (left, right) = (left.max(0), right.min(self.image[0]));
        if left >= right || !(0..self.image[1]).contains(&v) {
            return [0.0; 2];
        }
        let all = (right - left) as f64;
        let Some(row) = usize::try_from(v - self.top).ok().filter(|row| *row < self.rows) else { return [0.0, all] };
        let column = |u: i64| (u - self.left).clamp(0, self.columns as i64) as usize;
        let [from, to] = [column(left), column(right)].map(|column| row * (self.columns + 1) + column);
        let sum = |counts: &[u32]| f64::from(counts[to] - counts[from]);
        [sum(&self.region), sum(&self.empty) + all - (to - from) as f64]
    }

    /// What pixel `u`, `v` says.
    pub fn at(&self, u: i64, v: i64) -> Says {
        match self.count(v, [u, u + 1]) {
            [region, _] if region > 0.0 => Says::Region,
            [_, empty] if empty > 0.0 => Says::Empty,
            _ => Says::Nothing,
        }
    }
}
