//! Dynamic descriptors: an object of predefined size where its foot meets the ground (Lee & Hsu, Eq. 16).

use crate::contact::ground_contact;
use crate::edges::shows_map_below;
use crate::outline::Outline;
use crate::quad::median;
use crate::requirement::{Stop, Unmet, at_most};
use crate::sight::Sight;
use crate::spread::nudges;
use crate::window::rays;
use nalgebra::Vector3;
use resurvey_plugin::schema::{ChangeRegion, DynamicDescriptor, Uncertainty};

/// Share of the width, about the centroid, in which the foot is looked for.
const FOOT_WIDTH: f64 = 0.5;
/// Share of the foot's columns that end above the row taken: a ragged contour has low tips.
const FOOT_ROW: f64 = 0.75;
/// Largest share of the foot's columns that something else may hide.
const MAX_FOOT_HIDDEN: f64 = 0.7;
/// The foot that is seen is the near edge of the base. Its distance from the centre, over half a side of a square base,
/// is 1 to √2, and 4/π·ln(1 + √2) on the mean over all headings.
const NEAR_EDGE: f64 = 1.122;
/// Misfit by which two objects must explain a region better than one.
const SPLIT_GAIN: f64 = 0.15;
/// Places at which a cut between two objects is tried.
const CUTS: u32 = 24;
/// Fewest columns of an object, pixels.
const MIN_WIDTH_PX: u32 = 4;
/// Cuts within cuts, at most: eight objects in a region.
const MAX_DEPTH: u32 = 3;

/// An object measured, and how well it fits its predefined size.
struct Found {
    contact: Vector3<f64>,
    position: Vector3<f64>,
    foot_px: [f64; 2],
    /// Share of the foot that something hides.
    foot_hidden: f64,
    /// Width and height over those of the predefined size.
    size_ratio: [f64; 2],
}

impl Found {
    /// How far off the shape is, and half as much the size: a wrong range changes the size, not the shape.
    fn misfit(&self) -> f64 {
        let [width, height] = self.size_ratio.map(|ratio| ratio.max(1e-3).ln());
        (width - height).abs() + height.abs() / 2.0
    }
}

/// The dynamic descriptors of `region`, one for each object in it.
pub fn measure(
    sight: &Sight<'_>,
    region: &ChangeRegion,
    outline: &Outline,
) -> Result<Vec<Result<DynamicDescriptor, Unmet>>, Stop> {
    let [width, height] = sight.size();
    at_most("captured-entirely", outline.border_pixels(width, height) as f64, 0.0, "px")?;
    let no_size = Unmet { requirement: "predefined-size", measured: 0.0, limit: 1.0, unit: "sizes" };
    let size_m = sight.host.classes().get(region.class_after).and_then(|class| class.size_m).ok_or(no_size)?;
    let mut objects = Vec::new();
    split(sight, outline, size_m, MAX_DEPTH, &mut objects)?;
    let mut answers = Vec::new();
    for object in objects {
        match object.and_then(|found| descriptor(sight, region, size_m, &found)) {
            Ok(descriptor) => answers.push(Ok(descriptor)),
            Err(Stop::Unmet(unmet)) => answers.push(Err(unmet)),
            Err(host) => return Err(host),
        }
    }
    Ok(answers)
}

/// Pushes the objects of `outline`: itself, or those on either side of a cut where two fit the predefined size clearly
/// better than one.
fn split(
    sight: &Sight<'_>,
    outline: &Outline,
    size_m: [f64; 3],
    depth: u32,
    objects: &mut Vec<Result<Found, Stop>>,
) -> Result<(), Stop> {
    let whole = find(sight, outline, size_m);
    let whole_misfit = match &whole {
        Ok(found) => found.misfit(),
        Err(Stop::Unmet(_)) => f64::INFINITY,
        Err(host) => return Err(host.clone()),
    };
    if depth > 0 && whole_misfit > SPLIT_GAIN {
        let width_px = outline.bounds.width();
        let mut best: Option<(f64, Outline, Outline)> = None;
        for cut in 1..CUTS {
            let column = outline.bounds.left + width_px * cut / CUTS;
            let (Some(left), Some(right)) =
                (outline.columns(outline.bounds.left, column), outline.columns(column, outline.bounds.right))
            else {
                continue;
            };
            if left.bounds.width() < MIN_WIDTH_PX || right.bounds.width() < MIN_WIDTH_PX {
                continue;
            }
            if let (Ok(a), Ok(b)) = (find(sight, &left, size_m), find(sight, &right, size_m)) {
                let misfit = (a.misfit() + b.misfit()) / 2.0;
                if best.as_ref().is_none_or(|(least, ..)| misfit < *least) {
                    best = Some((misfit, left, right));
                }
            }
        }
        if let Some((misfit, left, right)) = best
            && misfit + SPLIT_GAIN < whole_misfit
        {
            split(sight, &left, size_m, depth - 1, objects)?;
            return split(sight, &right, size_m, depth - 1, objects);
        }
    }
    objects.push(whole);
    Ok(())
}

/// The object that `outline` shows, taken to be one.
fn find(sight: &Sight<'_>, outline: &Outline, size_m: [f64; 3]) -> Result<Found, Stop> {
    let (foot_px, foot_hidden) = foot(sight, outline);
    let direction = rays(sight.host, sight.pose(), &[foot_px])?[0];
    let contact = ground_contact(sight, &direction)?;
    let ahead = Vector3::new(contact.x, contact.y, 0.0).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
    let position = contact + ahead * (NEAR_EDGE * (size_m[0] + size_m[1]) / 4.0);
    let corners: Vec<_> = (0..8)
        .map(|corner| {
            let side = |axis: usize| if corner >> axis & 1 == 0 { -size_m[axis] / 2.0 } else { size_m[axis] / 2.0 };
            sight.to_grid(&(position + Vector3::new(side(0), side(1), side(2) + size_m[2] / 2.0)))
        })
        .collect();
    let seen: Option<Vec<[f64; 2]>> = sight.host.project(sight.pose(), &corners)?.into_iter().collect();
    let behind = Unmet { requirement: "size", measured: 0.0, limit: 1.0, unit: "ratio" };
    let seen = seen.ok_or(behind)?;
    let reach = |axis: usize| {
        let along = |pick: fn(f64, f64) -> f64, start| seen.iter().map(|p| p[axis]).fold(start, pick);
        along(f64::max, f64::NEG_INFINITY) - along(f64::min, f64::INFINITY)
    };
    let height_px = f64::from(outline.bounds.height());
    let width_px = width_px(outline);
    Ok(Found { contact, position, foot_px, foot_hidden, size_ratio: [width_px / reach(0), height_px / reach(1)] })
}

/// The median row's pixels: contours that wander have tips, and blobs bite pieces out.
fn width_px(outline: &Outline) -> f64 {
    let mut rows = std::collections::BTreeMap::new();
    outline.pixels().for_each(|[_, v]| *rows.entry(v).or_insert(0.0) += 1.0);
    median(&rows.into_values().collect::<Vec<_>>())
}

/// Where the object meets the ground: the centroid's column, and the row where most columns about it end; and the share
/// of those columns that end at something the map has not, which may stand in front. They do not count while others do.
fn foot(sight: &Sight<'_>, outline: &Outline) -> ([f64; 2], f64) {
    let (mut sum, mut count) = (0.0, 0.0);
    let mut ends = std::collections::BTreeMap::new();
    for [u, v] in outline.pixels() {
        sum += f64::from(u) + 0.5;
        count += 1.0;
        ends.insert(u, v + 1);
    }
    let middle = sum / f64::max(count, 1.0);
    let reach = f64::from(outline.bounds.width()) * FOOT_WIDTH / 2.0;
    let near = |u: &u32| (f64::from(*u) + 0.5 - middle).abs() <= reach.max(1.0);
    let (seen, hidden): (Vec<_>, Vec<_>) =
        ends.into_iter().filter(|(u, _)| near(u)).partition(|(u, end)| shows_map_below(sight, *u, *end));
    let share = hidden.len() as f64 / (seen.len() + hidden.len()).max(1) as f64;
    let columns = if share > MAX_FOOT_HIDDEN { [seen, hidden].concat() } else { seen };
    let mut rows: Vec<u32> = columns.into_iter().map(|(_, end)| end).collect();
    rows.sort_unstable();
    let row = rows.get(((rows.len() as f64 * FOOT_ROW) as usize).min(rows.len().saturating_sub(1)));
    ([middle, f64::from(row.copied().unwrap_or(outline.bounds.bottom))], share)
}

fn descriptor(
    sight: &Sight<'_>,
    region: &ChangeRegion,
    size_m: [f64; 3],
    found: &Found,
) -> Result<DynamicDescriptor, Stop> {
    let settings = sight.settings;
    at_most("captured-entirely", found.foot_hidden, MAX_FOOT_HIDDEN, "ratio")?;
    at_most("within-range", found.contact.norm(), settings.max_range_m, "m")?;
    let factor = found.size_ratio.iter().map(|ratio| ratio.max(1.0 / ratio)).fold(1.0, f64::max);
    at_most("size", factor, settings.max_size_factor, "ratio")?;
    let position_m = position_sigma_m(sight, found)?;
    at_most("uncertain", position_m, settings.max_dynamic_sigma_m, "m")?;
    Ok(DynamicDescriptor {
        class: region.class_after,
        position: sight.to_grid(&found.position),
        size_m,
        yaw_rad: None,
        sigma: Some(Uncertainty { position_m, size_m: None, area_m2: None }),
    })
}

/// 1σ of the position, metres: the pose moved by 1σ each way, and the foot by the jitter of the labels.
fn position_sigma_m(sight: &Sight<'_>, found: &Found) -> Result<f64, Stop> {
    let ground_m = found.contact.z;
    let meet = |eye: Vector3<f64>, direction: Vector3<f64>| {
        let times = (ground_m - eye.z) / direction.z;
        if times > 0.0 && times.is_finite() { eye + direction * times } else { Vector3::repeat(f64::INFINITY) }
    };
    let [u, v] = found.foot_px;
    let jitter_px = sight.settings.label_jitter_px;
    let seen = rays(sight.host, sight.pose(), &[[u, v], [u + jitter_px, v], [u, v + jitter_px]])?;
    let mut variance = 0.0;
    for direction in &seen[1..] {
        variance += (meet(Vector3::zeros(), *direction) - found.contact).norm_squared();
    }
    let not_finite =
        Unmet { requirement: "uncertain", measured: f64::MAX, limit: sight.settings.max_dynamic_sigma_m, unit: "m" };
    for nudge in nudges(&sight.comparison.estimate).ok_or(not_finite)? {
        variance += (meet(nudge.offset, nudge.turn * seen[0]) - found.contact).norm_squared();
    }
    Ok(variance.sqrt())
}
