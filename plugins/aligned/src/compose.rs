//! The view with every surface moved to where the photo has it.

use crate::behind::has_behind;
use crate::sample::offset_from;
use crate::surface::{SKY, Surfaces};
use resurvey_class_difference::raster::Rasters;
use resurvey_plugin::schema::ClassId;
use resurvey_plugin::{Comparison, Error, Host};

/// A hole is filled from the farthest of the pixels around it that are at most this many times as far as the nearest.
const FILL_REACH: usize = 3;

/// A surface that moves by less along every axis stays, metres.
const STILL_M: f64 = 1e-6;

/// The view made anew.
pub struct Composed {
    /// Photo, and view with its surfaces moved.
    pub rasters: Rasters,
    /// For every pixel, the pixel of the view it was filled from.
    pub from: Vec<usize>,
}

/// The view of `comparison` with every surface moved by its own metres (E, N, H); the nearest wins.
pub fn compose(
    host: &dyn Host,
    comparison: &Comparison<'_>,
    rasters: &Rasters,
    surfaces: &Surfaces,
    moves_m: &[[f64; 3]],
) -> Result<Composed, Error> {
    let len = rasters.photo.len();
    let mut from = vec![usize::MAX; len];
    for (pixel, to) in targets(host, comparison, rasters, surfaces, moves_m)? {
        if from[to] == usize::MAX || rasters.range_m[pixel] < rasters.range_m[from[to]] {
            from[to] = pixel;
        }
    }
    let sky = (0..len).filter(|pixel| rasters.is_sky(*pixel));
    for pixel in sky {
        if from[pixel] == usize::MAX {
            from[pixel] = pixel;
        }
    }
    let holes: Vec<usize> = (0..len).filter(|pixel| from[*pixel] == usize::MAX).collect();
    let fills: Vec<usize> = holes.iter().map(|hole| fill(rasters, &from, *hole)).collect();
    holes.iter().zip(&fills).for_each(|(hole, fill)| from[*hole] = *fill);
    let mut moved = Rasters {
        width: rasters.width,
        height: rasters.height,
        photo: rasters.photo.clone(),
        view: from.iter().map(|from| rasters.view[*from]).collect(),
        range_m: from.iter().map(|from| rasters.range_m[*from]).collect(),
        features: from.iter().map(|from| rasters.features[*from]).collect(),
    };
    for hole in holes {
        let photo = rasters.photo[hole];
        if photo != moved.view[hole] && has_behind(host, comparison, rasters, hole, ClassId(photo))? {
            moved.view[hole] = photo;
        }
    }
    Ok(Composed { rasters: moved, from })
}

/// Pixels that hit something, each with the pixel it moves to.
fn targets(
    host: &dyn Host,
    comparison: &Comparison<'_>,
    rasters: &Rasters,
    surfaces: &Surfaces,
    moves_m: &[[f64; 3]],
) -> Result<Vec<(usize, usize)>, Error> {
    let mut targets = Vec::with_capacity(rasters.photo.len());
    let (mut pixels, mut points) = (Vec::new(), Vec::new());
    for (pixel, surface) in surfaces.of.iter().enumerate().filter(|(_, surface)| **surface != SKY) {
        let move_m = moves_m[*surface as usize];
        if move_m.iter().all(|part| part.abs() < STILL_M) {
            targets.push((pixel, pixel));
            continue;
        }
        let (u, v) = ((pixel % rasters.width) as u32, (pixel / rasters.width) as u32);
        let point = comparison.view.points.at(u, v);
        pixels.push(pixel);
        points.push(offset_from(
            comparison.view.origin,
            std::array::from_fn(|axis| f64::from(point[axis]) + move_m[axis]),
        ));
    }
    let (width, height) = (rasters.width as f64, rasters.height as f64);
    for (pixel, at) in pixels.into_iter().zip(host.project(&comparison.estimate.pose, &points)?) {
        if let Some([u, v]) = at
            && (0.0..width).contains(&u)
            && (0.0..height).contains(&v)
        {
            targets.push((pixel, v as usize * rasters.width + u as usize));
        }
    }
    Ok(targets)
}

/// The pixel of the view that fills `hole`: the farthest of those that came to lie beside it.
fn fill(rasters: &Rasters, from: &[usize], hole: usize) -> usize {
    let (width, height) = (rasters.width, rasters.height);
    let (column, row) = (hole % width, hole / width);
    // Pixels to the image's border, and the step towards it.
    let ways = [(column, -1), (width - 1 - column, 1), (row, -(width as i64)), (height - 1 - row, width as i64)];
    let mut found: Vec<(usize, usize)> = Vec::new();
    for (most, way) in ways {
        let at = |step: usize| (hole as i64 + way * step as i64) as usize;
        let filled = (1..=most).find(|step| from[at(*step)] != usize::MAX);
        found.extend(filled.map(|step| (step, from[at(step)])));
    }
    let nearest = found.iter().map(|(step, _)| *step).min().unwrap_or(0);
    let range_m = |from: usize| rasters.range_m[from];
    found
        .into_iter()
        .filter(|(step, _)| *step <= FILL_REACH * nearest)
        .max_by(|a, b| range_m(a.1).total_cmp(&range_m(b.1)).then(b.0.cmp(&a.0)))
        .map_or(hole, |(_, from)| from)
}
