//! The trials of each kind: whether the answers mean what they should, in a place where the right ones are known.

use super::super::info::Kind;
use super::answer::Answer;
use super::ask::{Asked, is_scorer};
use super::exhibit::{Exhibit, Seen};
use super::finding::Finding;
use super::stage::Place;
use super::tries::{Bench, Tried};
use resurvey_schema::{ChangeRegion, ClassId, Descriptor, GridPoint, Localization, MaterialDescriptor, Pose, Proposal};

/// Large enough that 2 % of the banner are more than two pixels.
const PHOTO: [u32; 2] = [640, 480];
/// How far a found pose may be from the true one, metres and degrees.
const POSE: [f64; 2] = [2.0, 3.0];
/// How much of a banner a detector finds at least, and how much else its region may hold, shares of the banner.
const COVERED: f64 = 0.5;
/// How exactly a banner on a wall is measured: share of width and height.
const MEASURED: f64 = 0.02;
/// How near to the banner a removal must be, metres.
const REMOVED_M: f64 = 1.0;

/// A view matches itself best; equal images give no change; a toy wall is measured within 2 %; labels are classes.
pub(super) fn sense(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    bench.at(PHOTO, |place| {
        let mut asked = bench.asked(&plugin)?;
        match plugin.info().kind {
            Kind::Matcher if is_scorer(&plugin) => itself_is_best(place, &mut asked),
            Kind::Matcher => the_pose_is_found(place, &mut asked),
            Kind::Detector => changes_are_found(place, &mut asked),
            Kind::Estimator => a_banner_is_measured(place, &mut asked),
            Kind::Segmenter => labels_are_known(place, &mut asked),
        }
    })
}

/// Which classes are right depends on what the plugin was trained on: that all are classes of the map, and as many as
/// there are pixels, the host has seen to.
fn labels_are_known(place: &Place<'_>, asked: &mut Asked<'_>) -> Tried {
    match asked.ask(&Exhibit::new(place, place.same)?)? {
        answer @ Answer::Labels(_) => Ok(Finding::passed(answer.words())),
        answer => Err(no_sense(&answer)),
    }
}

fn no_sense(answer: &Answer) -> Finding {
    Finding::failed(format!("expected an answer, found {}", answer.words()), "answer here: the photo fits the map")
}

fn itself_is_best(place: &Place<'_>, asked: &mut Asked<'_>) -> Tried {
    let poses: Vec<Pose> = std::iter::once(place.pose).chain(place.elsewhere.iter().copied()).collect();
    let mut exhibit = Exhibit::new(place, place.same)?;
    let mut least = f64::INFINITY;
    for (own, pose) in poses.iter().enumerate() {
        exhibit.photo = Seen::new(place.same.services, *pose)?.labels;
        let mut scores = Vec::new();
        for other in &poses {
            exhibit.view = Seen::new(place.same.services, *other)?;
            match asked.ask(&exhibit)? {
                Answer::Score(score) => scores.push(score),
                answer => return Err(no_sense(&answer)),
            }
        }
        let others = scores.iter().enumerate().filter(|(other, _)| *other != own).map(|(_, score)| *score);
        let best = others.fold(f64::NEG_INFINITY, f64::max);
        if best >= scores[own] {
            return Err(Finding::failed(
                format!("a photo scores {} on its own view and {best} on one of another pose", scores[own]),
                "higher is better: the score must be highest where photo and view are the same",
            ));
        }
        least = least.min(scores[own] - best);
    }
    Ok(Finding::passed(format!("itself before {} others, by {least:.3} at least", poses.len() - 1)))
}

fn the_pose_is_found(place: &Place<'_>, asked: &mut Asked<'_>) -> Tried {
    let found: Localization = match asked.ask(&Exhibit::new(place, place.same)?)? {
        Answer::Pose(found) => *found,
        answer => return Err(no_sense(&answer)),
    };
    let off_m = found.pose.position.plan_distance_m(&place.pose.position);
    let turn = (found.pose.yaw_rad - place.pose.yaw_rad + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU);
    let off_deg = (turn - std::f64::consts::PI).abs().to_degrees();
    let words = format!("{off_m:.2} m and {off_deg:.2}° from the truth");
    if off_m <= POSE[0] && off_deg <= POSE[1] {
        return Ok(Finding::passed(words));
    }
    Err(Finding::failed(
        format!("the pose is {words}; expected at most {} m and {}°", POSE[0], POSE[1]),
        "the photo is the map as seen from the true pose: the best score must be there",
    ))
}

fn changes_are_found(place: &Place<'_>, asked: &mut Asked<'_>) -> Tried {
    let mut regions = |side| match asked.ask(&Exhibit::new(place, side)?)? {
        Answer::Regions(regions) => Ok(regions),
        answer => Err(no_sense(&answer)),
    };
    let equal = regions(place.same)?;
    if !equal.is_empty() {
        return Err(Finding::failed(
            format!("equal images gave {} regions", equal.len()),
            "a region is where photo and view differ",
        ));
    }
    let expected = Exhibit::new(place, place.came)?.regions;
    let Some(banner) = expected.first() else {
        return Err(Finding::failed("the toy place shows no banner", "report this"));
    };
    let found = regions(place.came)?;
    let covered =
        found.iter().filter(|region| region.class_after == place.banner.class).map(|region| shared(region, banner));
    let share = covered.max().unwrap_or(0) as f64 / f64::from(banner.pixels);
    if share < COVERED {
        return Err(Finding::failed(
            format!("of a new banner of {} px the regions cover {:.0} %", banner.pixels, share * 100.0),
            "find regions in which the photo has another class than the view",
        ));
    }
    Ok(Finding::passed(format!("no change in equal images, {:.0} % of a new banner", share * 100.0)))
}

/// Pixels that two regions share.
fn shared(a: &ChangeRegion, b: &ChangeRegion) -> usize {
    let has = |region: &ChangeRegion, u: u32, v: u32| {
        let bounds = region.bounds;
        let inside = (bounds.left..bounds.right).contains(&u) && (bounds.top..bounds.bottom).contains(&v);
        inside && region.mask[((v - bounds.top) * bounds.width() + u - bounds.left) as usize] == 1
    };
    let pixels = (b.bounds.top..b.bounds.bottom).flat_map(|v| (b.bounds.left..b.bounds.right).map(move |u| (u, v)));
    pixels.filter(|&(u, v)| has(a, u, v) && has(b, u, v)).count()
}

fn a_banner_is_measured(place: &Place<'_>, asked: &mut Asked<'_>) -> Tried {
    let mut proposals = |side| match asked.ask(&Exhibit::new(place, side)?)? {
        Answer::Proposals(proposals) => Ok(proposals),
        answer => Err(no_sense(&answer)),
    };
    for (side, banners) in [(place.came, &[][..]), (place.went, std::slice::from_ref(place.banner))] {
        for proposal in proposals(side)? {
            if let Proposal::Remove { class, near, .. } = proposal {
                is_there(class, near, banners)?;
            }
        }
    }
    let answer = proposals(place.came)?;
    let placed = answer.iter().find_map(|proposal| match proposal {
        Proposal::Place { descriptor: Descriptor::Material(found), .. } => Some(found),
        _ => None,
    });
    let Some(found) = placed else {
        return Err(Finding::failed(
            format!("a new banner on a wall was not placed: {}", why_not(&answer)),
            "look at the named requirement: the wall is plane and the banner whole and unhidden",
        ));
    };
    let ([width, height], [true_width, true_height]) = (size_m(found), size_m(place.banner));
    let words = format!("{width:.3} m × {height:.3} m where the banner has {true_width:.3} m × {true_height:.3} m");
    let off = (width / true_width - 1.0).abs().max((height / true_height - 1.0).abs());
    if found.class != place.banner.class || off > MEASURED || off.is_nan() {
        return Err(Finding::failed(
            format!("placed a descriptor of class {} with {words}", found.class.0),
            "pixel (i, j) has its centre at (i + 0.5, j + 0.5), and points are offsets from the view's origin",
        ));
    }
    Ok(Finding::passed(words))
}

/// A removal needs something to remove.
fn is_there(class: ClassId, near: GridPoint, banners: &[MaterialDescriptor]) -> Result<(), Finding> {
    let is_near = |banner: &MaterialDescriptor| {
        let centre = Descriptor::Material(banner.clone()).anchor();
        banner.class == class && centre.plan_distance_m(&near).hypot(centre.height_m - near.height_m) <= REMOVED_M
    };
    if banners.iter().any(is_near) {
        return Ok(());
    }
    let GridPoint { easting_m, northing_m, height_m } = near;
    Err(Finding::failed(
        format!(
            "proposed to remove class {} near E {easting_m:.2} N {northing_m:.2} H {height_m:.2}, where the map has none",
            class.0
        ),
        "remove what descriptors_near or the features of the view show to be there",
    ))
}

fn why_not(proposals: &[Proposal]) -> String {
    let rejection = proposals.iter().find_map(|proposal| match proposal {
        Proposal::Reject { rejection, .. } => Some(rejection),
        _ => None,
    });
    rejection.map_or_else(
        || format!("{} proposals, none of which places a rectangle", proposals.len()),
        |one| format!("rejected as {}: {} {}, limit {}", one.requirement, one.measured, one.unit, one.limit),
    )
}

/// Width and height from the corners, metres.
fn size_m(banner: &MaterialDescriptor) -> [f64; 2] {
    let [a, b, _, d] = banner.corners;
    let length = |p: GridPoint, q: GridPoint| p.plan_distance_m(&q).hypot(p.height_m - q.height_m);
    [length(a, b), length(a, d)]
}
