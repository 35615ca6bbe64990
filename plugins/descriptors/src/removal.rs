//! Removals (Lee & Hsu, Alg. 2): which descriptor of the map a region says is gone. Its class comes from the view, since
//! the photo shows what is behind.

use crate::requirement::{Stop, Unmet, at_least};
use crate::sight::Sight;
use crate::spread::pose_sigmas;
use crate::window::rays;
use resurvey_plugin::schema::{ChangeRegion, ClassKind, Descriptor, GridPoint};

/// Pixels at which the map behind a descriptor is asked for.
const SAMPLES: usize = 256;
/// Share of a region that must lie on one descriptor.
const MIN_ON_DESCRIPTOR: f64 = 0.5;
/// Share of the samples at which the photo must show what is behind.
const MIN_BEHIND: f64 = 0.5;
/// Farthest surface behind a descriptor, metres.
const BEHIND_LIMIT_M: f64 = 1000.0;
/// Pixels around a sample within which the map may have the photo's class.
const EXPLAIN_PX: f64 = 6.0;

/// A descriptor that is gone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gone {
    /// Its feature id.
    pub fid: u64,
    /// Where it stood.
    pub near: GridPoint,
    /// 1σ of that, metres.
    pub sigma_m: f64,
}

/// What a region on a descriptor means.
pub enum Verdict {
    /// The descriptor is gone.
    Gone(Gone),
    /// Nothing about a removal.
    Other,
}

/// Whether `region` says that a descriptor is gone; the photo must show what the map has behind it.
pub fn judge(sight: &Sight<'_>, region: &ChangeRegion) -> Result<Verdict, Stop> {
    let kind_of = |class| sight.host.classes().kind(class);
    let (before, after) = (kind_of(region.class_before), kind_of(region.class_after));
    if before == ClassKind::Ignored || after == ClassKind::Dynamic {
        return Ok(Verdict::Other);
    }
    let pixels = pixels(region);
    let on_descriptor = pixels.iter().filter_map(|[u, v]| feature(sight, region, *u, *v));
    let Some((feature, count)) = most_frequent(on_descriptor) else { return not_on_one(before, 0.0) };
    let share = f64::from(count) / pixels.len() as f64;
    if share < MIN_ON_DESCRIPTOR {
        return not_on_one(before, share);
    }
    let shows_behind = behind_share(sight, &pixels)?;
    if after == ClassKind::Material && before == ClassKind::Material && shows_behind < MIN_BEHIND {
        return Ok(Verdict::Other);
    }
    at_least("shows-what-is-behind", shows_behind, MIN_BEHIND, "ratio")?;
    let fid = sight.comparison.view.feature_table[feature as usize - 1].fid;
    let middle = pixels[pixels.len() / 2].map(i64::from);
    let seen = sight.point(middle[0], middle[1]).map(|offset| (sight.to_grid(&offset), offset.norm()));
    let lost = Unmet { requirement: "on-a-descriptor", measured: 0.0, limit: MIN_ON_DESCRIPTOR, unit: "ratio" };
    let (seen, range_m) = seen.ok_or(lost)?;
    let descriptor = find(sight, fid, seen)?;
    let own_m = descriptor.as_ref().and_then(Descriptor::sigma).map_or(0.0, |sigma| sigma.position_m);
    let near = descriptor.map_or(seen, |descriptor| descriptor.anchor());
    Ok(Verdict::Gone(Gone { fid, near, sigma_m: own_m.hypot(pose_sigma_m(sight, range_m)) }))
}

/// A dynamic class of the view that no descriptor accounts for cannot be removed; a material is the base map's.
fn not_on_one(before: ClassKind, share: f64) -> Result<Verdict, Stop> {
    if before == ClassKind::Dynamic {
        at_least("on-a-descriptor", share, MIN_ON_DESCRIPTOR, "ratio")?;
    }
    Ok(Verdict::Other)
}

fn pixels(region: &ChangeRegion) -> Vec<[u32; 2]> {
    let width = region.bounds.width().max(1);
    let inside = region.mask.iter().enumerate().filter(|(_, inside)| **inside != 0);
    inside.map(|(at, _)| [region.bounds.left + at as u32 % width, region.bounds.top + at as u32 / width]).collect()
}

/// The feature at a pixel when it is a descriptor of the region's class in the view.
fn feature(sight: &Sight<'_>, region: &ChangeRegion, u: u32, v: u32) -> Option<u32> {
    let view = &sight.comparison.view;
    let feature = view.features.at(u, v);
    let entry = view.feature_table.get((feature as usize).checked_sub(1)?)?;
    (entry.class == region.class_before).then_some(feature)
}

fn most_frequent(values: impl Iterator<Item = u32>) -> Option<(u32, u32)> {
    let mut counts = std::collections::BTreeMap::new();
    values.for_each(|value| *counts.entry(value).or_insert(0) += 1);
    counts.into_iter().max_by_key(|(_, count)| *count)
}

/// Share of sampled pixels at which the photo has a class that the map without descriptors has there or close by.
fn behind_share(sight: &Sight<'_>, pixels: &[[u32; 2]]) -> Result<f64, Stop> {
    let samples: Vec<[u32; 2]> = pixels.iter().copied().step_by(pixels.len().div_ceil(SAMPLES).max(1)).collect();
    let around = [[0.0, 0.0], [-EXPLAIN_PX, 0.0], [EXPLAIN_PX, 0.0], [0.0, -EXPLAIN_PX], [0.0, EXPLAIN_PX]];
    let places: Vec<[f64; 2]> = samples
        .iter()
        .flat_map(|[u, v]| around.map(|[right, down]| [f64::from(*u) + 0.5 + right, f64::from(*v) + 0.5 + down]))
        .collect();
    let directions: Vec<[f64; 3]> = rays(sight.host, sight.pose(), &places)?.into_iter().map(Into::into).collect();
    let hits = sight.host.cast_rays(sight.pose().position, &directions, BEHIND_LIMIT_M, false)?;
    let agrees = |([u, v], hits): (&[u32; 2], &[Option<_>])| {
        let photo = sight.photo(i64::from(*u), i64::from(*v));
        let class = |hit: &Option<resurvey_plugin::RayHit>| hit.map_or(sight.sky, |hit| Some(hit.class));
        hits.iter().any(|hit| class(hit) == photo)
    };
    let agreeing = samples.iter().zip(hits.chunks(around.len())).filter(|pair| agrees(*pair)).count();
    Ok(agreeing as f64 / samples.len().max(1) as f64)
}

/// The descriptor `fid`, which is seen at `seen`: its anchor may be a few metres away.
fn find(sight: &Sight<'_>, fid: u64, seen: GridPoint) -> Result<Option<Descriptor>, Stop> {
    for radius_m in [5.0, 50.0, 500.0] {
        let near = sight.host.descriptors_near(seen, radius_m)?;
        if let Some((_, descriptor)) = near.into_iter().find(|(own, _)| *own == fid) {
            return Ok(Some(descriptor));
        }
    }
    Ok(None)
}

/// 1σ of where something `range_m` away seems to be, metres.
fn pose_sigma_m(sight: &Sight<'_>, range_m: f64) -> f64 {
    let (position_m, angle_rad) = pose_sigmas(&sight.comparison.estimate);
    let sigma_m = position_m.hypot(range_m * angle_rad);
    if sigma_m.is_finite() { sigma_m } else { 0.0 }
}
