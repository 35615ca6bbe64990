//! The ground that a person stands on near a place whose height is not known.

use crate::render::{RayCaster, Scene};
use resurvey_schema::GridPoint;

/// Distance between the places that are looked at, metres.
const STEP_M: f64 = 5.0;
/// How far from the place ground is looked for, metres.
const REACH_M: f64 = 40.0;
/// What is this far above the street is a roof, metres: a storey.
const STOREY_M: f64 = 4.0;
/// Share of the places that may lie below the street: ramps, stairs and yards.
const BELOW_STREET: f64 = 0.1;

/// Ground near a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ground {
    /// Above the map's vertical datum, metres.
    pub height_m: f64,
    /// How much the ground around the place goes up and down, metres, 1σ.
    pub spread_m: f64,
}

/// The ground of `base`, a scene without descriptors, nearest in plan to `place` and within `sigma_m` or 10 m of it,
/// whichever is more; the height of `place` does not matter. A position that is off by a street's width lies in a
/// building as often as not, so what is a storey above the street around is a roof and no ground.
pub(super) fn ground_near(base: &Scene, place: GridPoint, sigma_m: f64) -> Option<Ground> {
    let heights = base.positions().iter().flatten().map(|corner| f64::from(corner[2]));
    let top_m = heights.fold(f64::NEG_INFINITY, f64::max) + base.origin().height_m + 1.0;
    if !top_m.is_finite() {
        return None;
    }
    let rays = RayCaster::new(base);
    let mut seen: Vec<(f64, f64)> = around(sigma_m.clamp(10.0, REACH_M))
        .filter_map(|[east_m, north_m]| {
            let above = GridPoint::new(place.easting_m + east_m, place.northing_m + north_m, top_m);
            Some((east_m.hypot(north_m), rays.ground_below(above)?.point.height_m))
        })
        .collect();
    seen.sort_by(|a, b| a.1.total_cmp(&b.1));
    let street_m = seen.get((seen.len() as f64 * BELOW_STREET) as usize)?.1;
    seen.retain(|(_, height_m)| (height_m - street_m).abs() < STOREY_M);
    let nearest = seen.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let mean_m = seen.iter().map(|(_, height_m)| height_m).sum::<f64>() / seen.len() as f64;
    let variance = seen.iter().map(|(_, height_m)| (height_m - mean_m).powi(2)).sum::<f64>() / seen.len() as f64;
    Some(Ground { height_m: nearest.1, spread_m: variance.sqrt() })
}

/// East and north of the places within `reach_m`.
fn around(reach_m: f64) -> impl Iterator<Item = [f64; 2]> {
    let count = (reach_m / STEP_M) as i32;
    let steps = move || (-count..=count).map(|step| f64::from(step) * STEP_M);
    steps()
        .flat_map(move |east_m| steps().map(move |north_m| [east_m, north_m]))
        .filter(move |[e, n]| e.hypot(*n) <= reach_m)
}
