//! What something near uncovers: a pillar that stands a little elsewhere than on the map lets the photo see what the view
//! has hidden behind it. That is no change of the pillar's surface.

use crate::raster::Rasters;
use crate::tolerance::Tolerance;
use resurvey_plugin::schema::{ClassId, GridPoint, Pose};
use resurvey_plugin::{Comparison, Error, Host};

/// Pixels of a region looked at, at most.
const SAMPLES: usize = 96;
/// Share of them that must show what is behind.
const MIN_SHARE: f64 = 0.6;
/// Surfaces behind the nearest that are looked at: its own back, another object's front and back, the wall.
const LAYERS: usize = 4;
/// Farthest surface behind, metres.
const LIMIT_M: f64 = 500.0;
/// How far behind a surface the next one is looked for, metres.
const SKIP_M: f64 = 0.02;
/// A step of the range between neighbouring pixels is an edge from this many metres and this share of the range on.
const STEP_M: f64 = 0.3;
const STEP_SHARE: f64 = 0.1;

/// Whether the region of `pixels`, which show `class` in the photo, is what the map has behind a surface that ends within
/// its tolerance.
pub fn is_uncovered(
    host: &dyn Host,
    comparison: &Comparison<'_>,
    rasters: &Rasters,
    tolerance: &Tolerance,
    pixels: &[usize],
    class: ClassId,
) -> Result<bool, Error> {
    let samples: Vec<usize> = pixels.iter().copied().step_by(pixels.len().div_ceil(SAMPLES).max(1)).collect();
    let near_end: Vec<usize> = samples.iter().copied().filter(|pixel| ends_near(rasters, tolerance, *pixel)).collect();
    let enough = (MIN_SHARE * samples.len() as f64).ceil() as usize;
    if near_end.len() < enough.max(1) {
        return Ok(false);
    }
    let pose = comparison.estimate.pose;
    let centre = |pixel: &usize| [(pixel % rasters.width) as f64 + 0.5, (pixel / rasters.width) as f64 + 0.5];
    let centres: Vec<[f64; 2]> = near_end.iter().map(centre).collect();
    let rays = host.pixel_rays(&pose, &centres)?;
    let mut behind = 0;
    for (pixel, ray) in near_end.iter().zip(rays) {
        behind += usize::from(has_behind(host, &pose, ray, f64::from(rasters.range_m[*pixel]), class)?);
    }
    Ok(behind >= enough)
}

/// Whether the map has `class` on one of the surfaces behind the first, which is `range_m` away, along the unit `ray`.
pub fn has_behind(host: &dyn Host, pose: &Pose, ray: [f64; 3], range_m: f64, class: ClassId) -> Result<bool, Error> {
    let mut gone_m = range_m + SKIP_M;
    for _ in 0..LAYERS {
        let GridPoint { easting_m, northing_m, height_m } = pose.position;
        let [e, n, h] = ray.map(|part| part * gone_m);
        let origin = GridPoint::new(easting_m + e, northing_m + n, height_m + h);
        match host.cast_rays(origin, &[ray], LIMIT_M, false)?.into_iter().next().flatten() {
            Some(hit) if hit.class == class => return Ok(true),
            Some(hit) => gone_m += hit.range_m + SKIP_M,
            None => return Ok(false),
        }
    }
    Ok(false)
}

/// Whether the surface at `pixel` ends within its tolerance and something farther begins: to either side, above or below.
fn ends_near(rasters: &Rasters, tolerance: &Tolerance, pixel: usize) -> bool {
    let (width, height) = (rasters.width as i64, rasters.height as i64);
    let (u, v) = (pixel as i64 % width, pixel as i64 / width);
    let range_m = f64::from(rasters.range_m[pixel]);
    if !range_m.is_finite() {
        return false;
    }
    let reach_px = tolerance.at_px(range_m).ceil() as i64;
    [[1, 0], [-1, 0], [0, 1], [0, -1]].into_iter().any(|[right, down]| {
        let mut last_m = range_m;
        for step in 1..=reach_px {
            let (u, v) = (u + right * step, v + down * step);
            if !(0..width).contains(&u) || !(0..height).contains(&v) {
                return true;
            }
            let here_m = f64::from(rasters.range_m[(v * width + u) as usize]);
            let gap_m = STEP_M.max(STEP_SHARE * last_m);
            if here_m > last_m + gap_m {
                return true;
            }
            if here_m < last_m - gap_m {
                return false;
            }
            last_m = here_m;
        }
        false
    })
}
