//! The exact search (Lee & Hsu, §3.4): every candidate's view, rendered and counted in full.

use super::compare::{Comparer, ViewPhoto};
use super::world::World;
use crate::capture::Capture;
use crate::plugin::Listener;
use crate::plugin::class_slots;
use crate::render::SolidMask;
use rayon::prelude::*;
use resurvey_schema::service::{ClassCounts, CompareRequest};
use resurvey_schema::{GridPoint, Pose};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The candidates of an exact search, and how their views are compared with the photo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExhaustiveRequest {
    /// Candidate positions lie within this distance of the prior, metres.
    pub radius_m: f64,
    /// Distance between neighbouring positions, metres.
    pub spacing_m: f64,
    /// Candidate headings lie within this angle of the prior, degrees.
    pub yaw_range_deg: f64,
    /// Angle between neighbouring headings, degrees.
    pub yaw_step_deg: f64,
    /// How each view is compared.
    pub compare: CompareRequest,
}

/// A score of a candidate from its counts by class: the more, the better.
pub type Score<'a> = &'a (dyn Fn(&[ClassCounts]) -> f64 + Sync);

/// The scores of all candidates.
#[derive(Clone, Debug, PartialEq)]
pub struct Exhaustive {
    prior: Pose,
    positions: Vec<GridPoint>,
    headings_rad: Vec<f64>,
    skipped: u64,
    scores: Vec<Vec<f64>>,
}

/// Most candidates of a search: 64 times the paper's.
const MOST_CANDIDATES: usize = 1 << 25;

/// Scores every candidate around the capture's prior that is not inside a solid with each of `scores`; the same numbers
/// whatever the number of threads. `None` when cancelled, or when there would be more than 33 million candidates.
pub fn exhaustive(
    world: &World,
    capture: &Capture,
    request: &ExhaustiveRequest,
    scores: &[Score],
    listener: &dyn Listener,
) -> Option<Exhaustive> {
    let prior = capture.prior.pose;
    let headings_rad: Vec<f64> = steps(request.yaw_range_deg.min(180.0), request.yaw_step_deg)?
        .map(|step| prior.yaw_rad + (step * request.yaw_step_deg).to_radians())
        .collect();
    let all = positions(prior.position, request)?;
    if all.len().saturating_mul(headings_rad.len()) > MOST_CANDIDATES {
        return None;
    }
    let solids = SolidMask::at_height(world.scene(false), prior.position.height_m);
    let positions: Vec<GridPoint> = all.iter().copied().filter(|position| !solids.contains(*position)).collect();
    let skipped = ((all.len() - positions.len()) * headings_rad.len()) as u64;
    let classes = class_slots(world.classes());
    let photo = ViewPhoto::new(&capture.labels, &capture.camera, classes, &request.compare);
    let done = AtomicUsize::new(0);
    let from_position = |index: usize| {
        let at = |yaw_rad: f64| Pose { position: positions[index], yaw_rad, ..prior };
        let found = (!listener.cancelled()).then(|| {
            photo.with_comparer(|comparer| scored((&photo, comparer, world), &headings_rad, at, index % 2 == 1, scores))
        });
        listener.progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / positions.len() as f64);
        found
    };
    let found: Option<Vec<Vec<f64>>> = (0..positions.len()).into_par_iter().map(from_position).collect();
    let found = found?;
    let of_all: Vec<f64> = found.into_iter().flatten().collect();
    let scores = (0..scores.len()).map(|score| of_all.iter().skip(score).step_by(scores.len()).copied().collect());
    let scores = scores.collect();
    Some(Exhaustive { prior, positions, headings_rad, skipped, scores })
}

/// All scores of one position, heading by heading; every other position is turned through backwards, so that each view
/// is like the one before.
fn scored(
    (photo, comparer, world): (&ViewPhoto, &mut Comparer, &World),
    headings_rad: &[f64],
    at: impl Fn(f64) -> Pose,
    backwards: bool,
    scores: &[Score],
) -> Vec<f64> {
    let mut found = vec![0.0; headings_rad.len() * scores.len()];
    let mut counts = vec![ClassCounts::default(); photo.classes()];
    for step in 0..headings_rad.len() {
        let heading = if backwards { headings_rad.len() - 1 - step } else { step };
        photo.compare_one(comparer, world.scene(true), &at(headings_rad[heading]), &mut counts);
        for (score, value) in scores.iter().zip(&mut found[heading * scores.len()..]) {
            *value = score(&counts);
        }
    }
    found
}

/// Whole steps within `range` to either side of 0; `None` when they are no sensible numbers.
fn steps(range: f64, step: f64) -> Option<impl Iterator<Item = f64> + Clone> {
    let reach = (range / step + 1e-9).floor();
    (range >= 0.0 && step > 0.0 && reach < 1e6).then(|| {
        let reach = reach as i32;
        (-reach..=reach).map(f64::from)
    })
}

fn positions(centre: GridPoint, request: &ExhaustiveRequest) -> Option<Vec<GridPoint>> {
    let steps = steps(request.radius_m, request.spacing_m)?;
    if steps.clone().count() > 1 << 13 {
        return None;
    }
    let offsets = steps.clone().flat_map(|north| steps.clone().map(move |east| (east, north)));
    let metres = offsets.map(|(east, north)| (east * request.spacing_m, north * request.spacing_m));
    let inside = metres.filter(|(east_m, north_m)| east_m.hypot(*north_m) <= request.radius_m + 1e-9);
    let position = |(east_m, north_m): (f64, f64)| GridPoint {
        easting_m: centre.easting_m + east_m,
        northing_m: centre.northing_m + north_m,
        ..centre
    };
    Some(inside.map(position).collect())
}

impl Exhaustive {
    /// Candidates that were scored.
    pub fn candidates(&self) -> u64 {
        (self.positions.len() * self.headings_rad.len()) as u64
    }

    /// Candidates inside solids, which were left out.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// Every candidate with its value by score number `score`, by position and then by heading; none for a score that
    /// was not asked for.
    pub fn scored(&self, score: usize) -> impl Iterator<Item = (Pose, f64)> + '_ {
        let poses = self.positions.iter().flat_map(|position| {
            self.headings_rad.iter().map(|yaw_rad| Pose { position: *position, yaw_rad: *yaw_rad, ..self.prior })
        });
        poses.zip(self.scores.get(score).into_iter().flatten().copied())
    }

    /// The best candidate by score number `score`, the first among equals; `None` when there is no candidate.
    pub fn best(&self, score: usize) -> Option<(Pose, f64)> {
        self.scored(score).reduce(|best, other| if other.1 > best.1 { other } else { best })
    }

    /// Easting, northing and the best value by score number `score` of every position that is not inside a solid.
    pub fn heat(&self, score: usize) -> Vec<[f64; 3]> {
        let values = self.scores.get(score).map_or(&[][..], Vec::as_slice).chunks(self.headings_rad.len().max(1));
        let best = values.map(|values| values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        let positions = self.positions.iter().zip(best);
        positions.map(|(position, best)| [position.easting_m, position.northing_m, best]).collect()
    }
}
