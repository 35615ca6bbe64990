//! What a segmenter does to labels: contours that wander and patches of a wrong class. Same seed, same noise.

use resurvey_schema::ClassId;

/// Distance between the nodes of the displacement field, pixels: contours wander over about this length.
const NODE_SPACING_PX: usize = 24;

/// A small deterministic generator (SplitMix64, Steele et al., OOPSLA 2014).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A generator that starts from `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Evenly in `low..high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// About normal with mean 0 and 1σ of 1 (sum of twelve).
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.between(0.0, 1.0)).sum::<f64>() - 6.0
    }

    /// One of `choices`; panics when there is none.
    pub fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.next() % choices.len() as u64) as usize]
    }
}

/// Moves every contour of the row-major `labels` by a smooth field of 1σ `sigma_px`.
pub fn jitter(labels: &[u8], width: usize, sigma_px: f64, random: &mut Random) -> Vec<u8> {
    let height = labels.len() / width;
    let columns = width / NODE_SPACING_PX + 2;
    let nodes: Vec<[f64; 2]> = (0..columns * (height / NODE_SPACING_PX + 2))
        .map(|_| [sigma_px * random.normal(), sigma_px * random.normal()])
        .collect();
    let mut moved = Vec::with_capacity(labels.len());
    for v in 0..height {
        for u in 0..width {
            let (column, row) = (u / NODE_SPACING_PX, v / NODE_SPACING_PX);
            let part = |x: usize| (x % NODE_SPACING_PX) as f64 / NODE_SPACING_PX as f64;
            let (s, t) = (part(u), part(v));
            let blend = |axis: usize| {
                let node = |c: usize, r: usize| nodes[r * columns + c][axis];
                (node(column, row) * (1.0 - s) + node(column + 1, row) * s) * (1.0 - t)
                    + (node(column, row + 1) * (1.0 - s) + node(column + 1, row + 1) * s) * t
            };
            let from_u = (u as f64 + blend(0)).round().clamp(0.0, (width - 1) as f64) as usize;
            let from_v = (v as f64 + blend(1)).round().clamp(0.0, (height - 1) as f64) as usize;
            moved.push(labels[from_v * width + from_u]);
        }
    }
    moved
}

/// Paints ellipses of `classes`, up to `largest_px` across, until about `share` of the pixels is covered.
pub fn blobs(
    labels: &mut [u8],
    width: usize,
    (share, largest_px): (f64, f64),
    classes: &[ClassId],
    random: &mut Random,
) {
    let height = labels.len() / width;
    let mut left_px = share * labels.len() as f64;
    while left_px > 0.0 {
        let axes = [random.between(2.0, largest_px / 2.0), random.between(2.0, largest_px / 2.0)];
        let centre = [random.between(0.0, width as f64), random.between(0.0, height as f64)];
        ellipse(labels, width, (centre, axes, random.between(0.0, std::f64::consts::PI)), random.pick(classes));
        left_px -= std::f64::consts::PI * axes[0] * axes[1];
    }
}

/// Paints one ellipse: centre, half axes, pixels, and turn, radians.
pub fn ellipse(labels: &mut [u8], width: usize, shape: ([f64; 2], [f64; 2], f64), class: ClassId) {
    let (centre, axes, turn_rad) = shape;
    let (sin, cos) = turn_rad.sin_cos();
    let reach = axes[0].max(axes[1]).ceil();
    let height = labels.len() / width;
    let range = |middle: f64, end: usize| {
        ((middle - reach).max(0.0) as usize).min(end)..((middle + reach + 1.0).max(0.0) as usize).min(end)
    };
    for v in range(centre[1], height) {
        for u in range(centre[0], width) {
            let (x, y) = (u as f64 + 0.5 - centre[0], v as f64 + 0.5 - centre[1]);
            let (along, across) = ((x * cos + y * sin) / axes[0], (y * cos - x * sin) / axes[1]);
            if along * along + across * across <= 1.0 {
                labels[v * width + u] = class.0;
            }
        }
    }
}
