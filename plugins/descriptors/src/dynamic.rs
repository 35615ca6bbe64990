//! Dynamic descriptors: an object of predefined size where its foot meets the ground (Lee & Hsu, Eq. 16).

use crate::contact::ground_contact;
use crate::crowd::{Search, starts};
use crate::edges::shows_map_below;
use crate::evidence::Evidence;
use crate::outline::Outline;
use crate::quad::median;
use crate::requirement::{Stop, Unmet, at_most};
use crate::sight::Sight;
use crate::silhouette::radius_m;
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
/// Columns of a region from which objects are looked for.
const COLUMNS: u32 = 7;

/// An object measured, and how well it fits its predefined size.
struct Found {
    contact: Vector3<f64>,
    position: Vector3<f64>,
    /// 1σ of the position from the labels alone, metres.
    labels_m: f64,
    /// Share of the foot that something hides.
    foot_hidden: f64,
    /// Width or height over that of the predefined size, or the inverse, whichever is most.
    size_factor: f64,
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
    let objects = match several(sight, outline, size_m)? {
        Some(several) => several,
        None => vec![find(sight, outline, size_m)],
    };
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

/// The objects of `outline` where several explain it clearly better than one.
fn several(sight: &Sight<'_>, outline: &Outline, size_m: [f64; 3]) -> Result<Option<Vec<Result<Found, Stop>>>, Stop> {
    let ends = column_ends(outline);
    let pixels: Vec<[f64; 2]> = ends.iter().flatten().copied().collect();
    let directions = rays(sight.host, sight.pose(), &pixels)?;
    let (mut lows, mut highs) = (Vec::new(), Vec::new());
    for ends in directions.chunks(2) {
        highs.push(ends[0]);
        match ground_contact(sight, &ends[1]) {
            Ok(contact) => lows.push(contact),
            Err(Stop::Unmet(_)) => {}
            Err(host) => return Err(host),
        }
    }
    let Some(nearest) = lows.iter().min_by(|a, b| a.norm().total_cmp(&b.norm())) else { return Ok(None) };
    let evidence = Evidence::new(sight, outline, [nearest.xy().norm(), nearest.z]);
    let search = Search { sight, evidence: &evidence, size_m };
    let Some(members) = search.objects(&starts(size_m, &lows, &highs))? else { return Ok(None) };
    let found = (0..members.len()).map(|index| {
        let position = members[index].foot;
        let ahead = Vector3::new(position.x, position.y, 0.0).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
        let front = ahead * radius_m(size_m);
        let contact = ground_contact(sight, &(position - front).normalize())?;
        // What seems to stand in the wall stands against it.
        let is_nearer = contact.norm() < (position - front).norm();
        let position = if is_nearer { contact + front } else { position };
        let labels_m = search.sigma_m(&members, index)?;
        Ok(Found { contact, position, labels_m, foot_hidden: 0.0, size_factor: 1.0 })
    });
    Ok(Some(found.collect()))
}

/// Highest and lowest place of the region in some of its columns.
fn column_ends(outline: &Outline) -> Vec<[[f64; 2]; 2]> {
    let bounds = outline.bounds;
    let column = |number: u32| {
        let share = f64::from(2 * number + 1) / f64::from(2 * COLUMNS);
        let u = bounds.left + (f64::from(bounds.width()) * share) as u32;
        let mut rows = (bounds.top..bounds.bottom).filter(|v| outline.contains(i64::from(u), i64::from(*v)));
        let top = rows.next()?;
        let bottom = rows.next_back().unwrap_or(top) + 1;
        Some([top, bottom].map(|v| [f64::from(u) + 0.5, f64::from(v)]))
    };
    (0..COLUMNS).filter_map(column).collect()
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
    let ratios = [width_px(outline) / reach(0), f64::from(outline.bounds.height()) / reach(1)];
    Ok(Found {
        contact,
        position,
        labels_m: foot_sigma_m(sight, &contact, foot_px)?,
        foot_hidden,
        size_factor: ratios.into_iter().map(|ratio| ratio.max(1.0 / ratio)).fold(1.0, f64::max),
    })
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
    at_most("size", found.size_factor, settings.max_size_factor, "ratio")?;
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

/// Where a ray meets level ground at `ground_m`.
fn meet(ground_m: f64, eye: &Vector3<f64>, direction: &Vector3<f64>) -> Vector3<f64> {
    let times = (ground_m - eye.z) / direction.z;
    if times > 0.0 && times.is_finite() { eye + direction * times } else { Vector3::repeat(f64::INFINITY) }
}

/// 1σ of a contact seen at `foot_px`, metres, from the jitter of the labels.
fn foot_sigma_m(sight: &Sight<'_>, contact: &Vector3<f64>, [u, v]: [f64; 2]) -> Result<f64, Stop> {
    let jitter_px = sight.settings.label_jitter_px;
    let moved = rays(sight.host, sight.pose(), &[[u + jitter_px, v], [u, v + jitter_px]])?;
    let square_m2 = |ray: &Vector3<f64>| (meet(contact.z, &Vector3::zeros(), ray) - contact).norm_squared();
    Ok(moved.iter().map(square_m2).sum::<f64>().sqrt())
}

/// 1σ of the position, metres: that of the labels, and the pose moved by 1σ each way.
fn position_sigma_m(sight: &Sight<'_>, found: &Found) -> Result<f64, Stop> {
    let not_finite =
        Unmet { requirement: "uncertain", measured: f64::MAX, limit: sight.settings.max_dynamic_sigma_m, unit: "m" };
    let (contact, mut variance) = (found.contact, found.labels_m.powi(2));
    for nudge in nudges(&sight.comparison.estimate).ok_or(not_finite)? {
        variance += (meet(contact.z, &nudge.offset, &(nudge.turn * contact)) - contact).norm_squared();
    }
    Ok(variance.sqrt())
}
