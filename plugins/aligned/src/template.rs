//! Where the contours of a surface are: the pixels that say whether it is in its place.

use crate::surface::{SKY, Surfaces, is_similar};
use resurvey_class_difference::raster::Rasters;

/// Pixels beyond an edge of a surface that belong to its template: what it stands before moves along.
const BAND_PX: usize = 10;
/// Samples of one surface, at most.
const MAX_SAMPLES: usize = 2400;

/// A pixel of the view that a surface carries along.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The pixel.
    pub pixel: usize,
    /// Range at which it is carried, metres: the surface's own, also beside it.
    pub range_m: f32,
}

/// For every surface the pixels within `reach_px` of a contour between two classes, on it or just beside it where it
/// hides what is farther, thinned
/// evenly, and how many there were.
pub fn templates(rasters: &Rasters, surfaces: &Surfaces, reach_px: usize) -> Vec<(Vec<Place>, usize)> {
    let near_contour = near_contour(rasters, reach_px);
    let mut all = vec![Vec::new(); surfaces.count];
    for (pixel, surface) in surfaces.of.iter().enumerate() {
        if *surface != SKY && near_contour[pixel] && rasters.features[pixel] == 0 {
            all[*surface as usize].push(Place { pixel, range_m: rasters.range_m[pixel] });
        }
        if near_contour[pixel] {
            for (beside, range_m) in fronts(rasters, surfaces, pixel) {
                all[beside as usize].push(Place { pixel, range_m });
            }
        }
    }
    all.into_iter().map(|places| (thinned(&places), places.len())).collect()
}

fn thinned(places: &[Place]) -> Vec<Place> {
    let step = places.len() as f64 / MAX_SAMPLES as f64;
    if step <= 1.0 {
        return places.to_vec();
    }
    (0..MAX_SAMPLES).map(|index| places[(index as f64 * step) as usize]).collect()
}

/// Surfaces within the band around `pixel` that are nearer than it or touch it, with their range there.
fn fronts(rasters: &Rasters, surfaces: &Surfaces, pixel: usize) -> Vec<(u32, f32)> {
    let (width, height) = (rasters.width, rasters.height);
    let (column, row) = (pixel % width, pixel / width);
    let own = surfaces.of[pixel];
    let mut found: Vec<(u32, f32)> = Vec::new();
    for step in 1..=BAND_PX {
        let beside = [
            (column >= step).then(|| pixel - step),
            (column + step < width).then_some(pixel + step),
            (row >= step).then(|| pixel - step * width),
            (row + step < height).then_some(pixel + step * width),
        ];
        for near in beside.into_iter().flatten() {
            let (surface, range_m) = (surfaces.of[near], rasters.range_m[near]);
            let is_in_front = range_m <= rasters.range_m[pixel] || is_similar(range_m, rasters.range_m[pixel]);
            let is_map = surface != SKY && rasters.features[near] == 0;
            if is_map && surface != own && is_in_front && found.iter().all(|(known, _)| *known != surface) {
                found.push((surface, range_m));
            }
        }
    }
    found
}

/// Pixels within `reach_px` of a contour, in a square.
fn near_contour(rasters: &Rasters, reach_px: usize) -> Vec<bool> {
    let (width, height) = (rasters.width, rasters.height);
    let mut seed = vec![false; width * height];
    for pixel in 0..seed.len() {
        let right = (pixel % width + 1 < width).then_some(pixel + 1);
        let below = (pixel + width < seed.len()).then_some(pixel + width);
        for near in right.into_iter().chain(below).filter(|near| rasters.view[*near] != rasters.view[pixel]) {
            seed[pixel] = true;
            seed[near] = true;
        }
    }
    let along = widened(&seed, width, 1, height, width, reach_px);
    widened(&along, height, width, width, 1, reach_px)
}

/// `seed` widened by `reach` along lines of `len` values `step` apart, `count` lines `next` apart.
fn widened(seed: &[bool], len: usize, step: usize, count: usize, next: usize, reach: usize) -> Vec<bool> {
    let mut wide = vec![false; seed.len()];
    for line in 0..count {
        let at = |index: usize| line * next + index * step;
        let mut until = 0;
        for index in 0..len {
            if seed[at(index)] {
                let from = index.saturating_sub(reach).max(until);
                until = (index + reach + 1).min(len);
                (from..until).for_each(|index| wide[at(index)] = true);
            }
        }
    }
    wide
}
