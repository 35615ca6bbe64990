//! Where a ray meets the ground an object stands on (Lee & Hsu, Eq. 16): the ground surface, never the wall behind.

use crate::requirement::{Stop, Unmet};
use crate::sight::Sight;
use nalgebra::Vector3;

/// Farthest surface looked for, as a multiple of the range limit.
const SEARCH_FACTOR: f64 = 4.0;
/// Smallest upward part of the unit normal of ground: slopes up to 45°.
const GROUND_NORMAL: f64 = 0.7;
/// How far in front of a wall the ground at its foot is looked for, metres.
const FOOT_M: f64 = 0.3;
/// How far behind a wall a contact may seem to be, metres: the object then stands against it.
const MAX_BEHIND_WALL_M: f64 = 1.0;

/// The ground contact along the unit `direction`, offset from the camera, metres.
pub fn ground_contact(sight: &Sight<'_>, direction: &Vector3<f64>) -> Result<Vector3<f64>, Stop> {
    let none = Unmet { requirement: "ground-contact", measured: 0.0, limit: 1.0, unit: "surfaces" };
    let limit_m = sight.settings.max_range_m * SEARCH_FACTOR;
    let hits = sight.host.cast_rays(sight.pose().position, &[(*direction).into()], limit_m, false)?;
    let hit = hits.into_iter().next().flatten().ok_or(none)?;
    let point = sight.from_camera(hit.point);
    if hit.normal[2] >= GROUND_NORMAL {
        return Ok(point);
    }
    let ahead = Vector3::new(direction.x, direction.y, 0.0).try_normalize(1e-9).ok_or(none)?;
    let foot = sight.to_grid(&(point - ahead * FOOT_M));
    let ground_m = sight.host.ground_height(foot)?.ok_or(none)? - sight.pose().position.height_m;
    let times = ground_m / direction.z;
    if direction.z >= 0.0 || !times.is_finite() || times < 0.0 {
        return Err(none.into());
    }
    let behind_m = times - hit.range_m;
    if behind_m > MAX_BEHIND_WALL_M {
        return Err(Unmet { measured: behind_m, limit: MAX_BEHIND_WALL_M, unit: "m", ..none }.into());
    }
    let at = direction * times.min(hit.range_m);
    Ok(Vector3::new(at.x, at.y, ground_m))
}
