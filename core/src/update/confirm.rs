//! Confirmation: what several captures say of the same change becomes one change, when enough of them agree.
//!
//! Two measurements agree when they differ by less than three times the 1σ of their difference. Those that agree are
//! fused with weights 1/σ², the best linear estimate of independent measurements (Aitken 1935); where they scatter more
//! than their σ allow, that of the result grows by the Birge ratio (Birge, Phys. Rev. 40, 1932).

use super::resolve::Change;
use crate::store::{MapFile, Proposal, StoreError};
use crate::version::{Digest, FeatureState, UpdateTransaction};
use nalgebra::Vector3;
use resurvey_schema::{Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Uncertainty};
use std::collections::BTreeSet;

/// Differences up to this many 1σ are agreement.
const GATE_SIGMAS: f64 = 3.0;
/// 1σ of a measurement that does not say how sure it is, metres: the limit of the reliability gate.
const UNKNOWN_SIGMA_M: f64 = 1.0;
/// No measurement counts as surer than this, metres: a pixel's edge at 10 m.
const LEAST_SIGMA_M: f64 = 0.02;
/// Cosine of the largest angle between normals of one surface: 20°, as when a descriptor is looked for on the map.
const SAME_SURFACE_COS: f64 = 0.94;

/// What one capture says of one change.
#[derive(Clone, Debug, PartialEq)]
pub struct Testimony {
    /// Number of the proposal.
    pub proposal: u64,
    /// Digest of the photo, or of the capture where that is not known: with the same one, it is one witness.
    pub photo: Digest,
    /// Digest of the observation.
    pub observation: Digest,
    /// The change.
    pub change: Change,
}

/// A change that enough captures agree on.
#[derive(Clone, Debug, PartialEq)]
pub struct Confirmation {
    /// The change, fused from what they say.
    pub change: Change,
    /// Proposals that say so, by number.
    pub proposals: Vec<u64>,
    /// Digests of the observations it is fused from, one a capture.
    pub observations: Vec<Digest>,
}

/// What open proposals with one change and an observation say, by number.
pub fn testimonies(map: &MapFile) -> Result<Vec<Testimony>, StoreError> {
    let mut found = Vec::new();
    for proposal in map.open_proposals()? {
        let Proposal { id, transaction, observation: Some(observation), .. } = proposal else { continue };
        let (Some(change), Some(recorded)) = (change_of(&transaction), map.observation(observation)?) else { continue };
        let photo = recorded.observation.photo.unwrap_or(recorded.observation.capture);
        found.push(Testimony { proposal: id, photo, observation: recorded.digest, change });
    }
    Ok(found)
}

/// The one change of a descriptor that `transaction` makes; `None` when it makes several or another.
fn change_of(transaction: &UpdateTransaction) -> Option<Change> {
    let descriptor = |state: &FeatureState| match state {
        FeatureState::Descriptor(descriptor) => Some(descriptor.clone()),
        FeatureState::Object { .. } => None,
    };
    match (transaction.additions.as_slice(), transaction.deltas.as_slice()) {
        ([after], []) => Some(Change::Add(descriptor(after)?)),
        ([], [delta]) => {
            let (fid, before) = (delta.fid().0, descriptor(delta.before()?)?);
            Some(match delta.after() {
                Some(after) => Change::Modify { fid, before, after: descriptor(after)? },
                None => Change::Remove { fid, before },
            })
        }
        _ => None,
    }
}

/// The change of `own` fused with those of `others` that agree with it and each other, when they come from at least
/// `photos` different photos.
pub fn confirm(own: &Testimony, others: &[Testimony], photos: usize) -> Option<Confirmation> {
    // What the same photo says of something else is nearer to what others say of that.
    let siblings = || others.iter().filter(|other| other.photo == own.photo && other.proposal != own.proposal);
    let is_of_a_sibling = |other: &Testimony, off: f64| {
        siblings().filter_map(|sibling| disagreement(&sibling.change, &other.change)).any(|nearer| nearer < off)
    };
    let mut near: Vec<(f64, &Testimony)> = others
        .iter()
        .filter(|other| other.photo != own.photo)
        .filter_map(|other| Some((disagreement(&own.change, &other.change)?, other)))
        .filter(|(off, other)| !is_of_a_sibling(other, *off))
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.proposal.cmp(&b.1.proposal)));
    let mut group = vec![own];
    let mut seen = BTreeSet::from([own.photo]);
    for (_, other) in near {
        let agrees = group.iter().all(|member| disagreement(&member.change, &other.change).is_some());
        if agrees && seen.insert(other.photo) {
            group.push(other);
        }
    }
    if group.len() < photos.max(1) {
        return None;
    }
    let again = others.iter().filter(|other| group.iter().any(|member| is_repeated(member, other, others)));
    let mut proposals: Vec<u64> = group.iter().copied().chain(again).map(|member| member.proposal).collect();
    proposals.sort_unstable();
    proposals.dedup();
    let changes: Vec<&Change> = group.iter().map(|member| &member.change).collect();
    let observations = group.iter().map(|member| member.observation).collect();
    Some(Confirmation { change: fused(&changes), proposals, observations })
}

/// Whether `other` says what `member` says, of the same photo: of all that the member's observation says it is nearest.
fn is_repeated(member: &Testimony, other: &Testimony, all: &[Testimony]) -> bool {
    if member.photo != other.photo || member.proposal == other.proposal {
        return false;
    }
    let off = |said: &Testimony| disagreement(&said.change, &other.change);
    let beside = |said: &&Testimony| said.observation == member.observation && said.proposal != member.proposal;
    let Some(own) = off(member).filter(|_| member.observation != other.observation) else {
        return member.change == other.change;
    };
    all.iter().filter(beside).filter_map(off).all(|nearer| nearer >= own)
}

/// How far two changes differ, in 1σ of their difference; `None` when they do not mean the same.
fn disagreement(a: &Change, b: &Change) -> Option<f64> {
    let same = |a: &Descriptor, b: &Descriptor| {
        FeatureState::Descriptor(a.clone()).is_same_as(&FeatureState::Descriptor(b.clone()))
    };
    match (a, b) {
        (Change::Add(a), Change::Add(b)) => difference(a, b),
        (
            Change::Modify { fid, before, after },
            Change::Modify { fid: other, before: other_before, after: other_after },
        ) if fid == other && same(before, other_before) => difference(after, other_after),
        (Change::Remove { fid, before }, Change::Remove { fid: other, before: other_before })
            if fid == other && same(before, other_before) =>
        {
            Some(0.0)
        }
        _ => None,
    }
}

/// The largest difference of two descriptors in 1σ; `None` when they are not of one thing.
fn difference(a: &Descriptor, b: &Descriptor) -> Option<f64> {
    if a.class() != b.class() {
        return None;
    }
    let apart = distance_m(a.anchor(), b.anchor()) / position_sigma_m(a).hypot(position_sigma_m(b));
    let worst = match (a, b) {
        (Descriptor::Material(first), Descriptor::Material(second)) => {
            if Vector3::from(first.normal).dot(&Vector3::from(second.normal)) < SAME_SURFACE_COS {
                return None;
            }
            let sigma_m = size_sigma_m(a).hypot(size_sigma_m(b));
            let ([width, height], [other_width, other_height]) = (size_m(first), size_m(second));
            apart.max((width - other_width).abs() / sigma_m).max((height - other_height).abs() / sigma_m)
        }
        (Descriptor::Dynamic(_), Descriptor::Dynamic(_)) => apart,
        _ => return None,
    };
    (worst <= GATE_SIGMAS).then_some(worst)
}

fn position_sigma_m(descriptor: &Descriptor) -> f64 {
    descriptor.sigma().map_or(UNKNOWN_SIGMA_M, |sigma| sigma.position_m).max(LEAST_SIGMA_M)
}

/// Of width and height; as sure as the position where it is not said.
fn size_sigma_m(descriptor: &Descriptor) -> f64 {
    let own = descriptor.sigma().and_then(|sigma| sigma.size_m);
    own.unwrap_or_else(|| position_sigma_m(descriptor)).max(LEAST_SIGMA_M)
}

fn distance_m(a: GridPoint, b: GridPoint) -> f64 {
    a.plan_distance_m(&b).hypot(a.height_m - b.height_m)
}

/// Width and height: the means of opposite edges, metres.
fn size_m(material: &MaterialDescriptor) -> [f64; 2] {
    let edge = |start: usize| distance_m(material.corners[start], material.corners[(start + 1) % 4]);
    [(edge(0) + edge(2)) / 2.0, (edge(1) + edge(3)) / 2.0]
}

/// Of changes that agree; removals agree to the last bit.
fn fused(changes: &[&Change]) -> Change {
    let descriptors: Vec<&Descriptor> = changes
        .iter()
        .filter_map(|change| match change {
            Change::Add(after) | Change::Modify { after, .. } => Some(after),
            Change::Remove { .. } => None,
        })
        .collect();
    match changes[0] {
        Change::Add(first) => Change::Add(fuse(first, &descriptors)),
        Change::Modify { fid, before, after } => {
            Change::Modify { fid: *fid, before: before.clone(), after: fuse(after, &descriptors) }
        }
        removal @ Change::Remove { .. } => removal.clone(),
    }
}

/// The mean of `all` with weights 1/σ²; class and predefined size are those of `first`.
fn fuse(first: &Descriptor, all: &[&Descriptor]) -> Descriptor {
    let anchors: Vec<(f64, GridPoint)> = all.iter().map(|one| (position_sigma_m(one), one.anchor())).collect();
    let anchor = weighted(&anchors);
    let sizes: Vec<f64> = all.iter().map(|one| size_sigma_m(one)).collect();
    let scatter: f64 = anchors.iter().map(|(sigma, point)| (distance_m(*point, anchor) / sigma).powi(2)).sum();
    let birge = (scatter / (all.len().max(2) - 1) as f64).sqrt().max(1.0);
    let position_m = fused_sigma(anchors.iter().map(|(sigma, _)| *sigma)) * birge;
    match first {
        Descriptor::Dynamic(dynamic) => {
            let sigma = Some(Uncertainty { position_m, size_m: None, area_m2: None });
            let yaw_rad = mean_heading(all);
            Descriptor::Dynamic(DynamicDescriptor { position: anchor, yaw_rad, sigma, ..dynamic.clone() })
        }
        Descriptor::Material(material) => {
            let corners = [0, 1, 2, 3].map(|corner| {
                let offsets: Vec<(f64, GridPoint)> = all
                    .iter()
                    .zip(&sizes)
                    .filter_map(|(one, sigma)| match one {
                        Descriptor::Material(one) => Some((*sigma, between(one.centre(), one.corners[corner]))),
                        Descriptor::Dynamic(_) => None,
                    })
                    .collect();
                plus(anchor, weighted(&offsets))
            });
            let size_m = fused_sigma(sizes.iter().copied());
            let [width, height] = size_m_of(&corners);
            let sigma = Uncertainty { position_m, size_m: Some(size_m), area_m2: Some(size_m * width.hypot(height)) };
            let normal = normal(&corners).unwrap_or(material.normal);
            Descriptor::Material(MaterialDescriptor { class: material.class, corners, normal, sigma: Some(sigma) })
        }
    }
}

fn size_m_of(corners: &[GridPoint; 4]) -> [f64; 2] {
    [distance_m(corners[0], corners[1]), distance_m(corners[1], corners[2])]
}

/// 1σ of a mean with weights 1/σ².
fn fused_sigma(sigmas: impl Iterator<Item = f64>) -> f64 {
    sigmas.map(|sigma| sigma.powi(-2)).sum::<f64>().sqrt().recip()
}

fn weighted(points: &[(f64, GridPoint)]) -> GridPoint {
    let total: f64 = points.iter().map(|(sigma, _)| sigma.powi(-2)).sum();
    let mean = |pick: fn(&GridPoint) -> f64| {
        points.iter().map(|(sigma, point)| sigma.powi(-2) * pick(point)).sum::<f64>() / total
    };
    GridPoint::new(mean(|point| point.easting_m), mean(|point| point.northing_m), mean(|point| point.height_m))
}

/// Mean direction of the headings that are known; `None` when none is, or when they cancel out.
fn mean_heading(all: &[&Descriptor]) -> Option<f64> {
    let known = all.iter().filter_map(|one| match one {
        Descriptor::Dynamic(dynamic) => Some((position_sigma_m(one).powi(-2), dynamic.yaw_rad?)),
        Descriptor::Material(_) => None,
    });
    let (mut east, mut north) = (0.0, 0.0);
    known.for_each(|(weight, yaw)| (east, north) = (east + weight * yaw.sin(), north + weight * yaw.cos()));
    (east.hypot(north) > 0.0).then(|| east.atan2(north).rem_euclid(std::f64::consts::TAU))
}

fn between(from: GridPoint, to: GridPoint) -> GridPoint {
    GridPoint::new(to.easting_m - from.easting_m, to.northing_m - from.northing_m, to.height_m - from.height_m)
}

fn plus(a: GridPoint, b: GridPoint) -> GridPoint {
    GridPoint::new(a.easting_m + b.easting_m, a.northing_m + b.northing_m, a.height_m + b.height_m)
}

/// Unit normal towards those who see the corners turn left.
fn normal(corners: &[GridPoint; 4]) -> Option<[f64; 3]> {
    let diagonal = |from: usize, to: usize| Vector3::from(<[f64; 3]>::from(between(corners[from], corners[to])));
    diagonal(0, 2).cross(&diagonal(1, 3)).try_normalize(f64::MIN_POSITIVE).map(Into::into)
}

#[cfg(test)]
#[path = "confirm_tests.rs"]
mod tests;
