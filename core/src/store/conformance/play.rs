//! Random histories.

use super::{at, banner, chair, transaction};
use crate::store::History;
use crate::version::{BoxMm, Delta, Digest, FeatureState, Fid, UpdateTransaction, VersionId};
use proptest::prelude::*;
use resurvey_schema::{Descriptor, GridPoint};
use std::collections::BTreeMap;

/// What a random transaction does next; places are metres east, north and above that of the test's features.
#[derive(Clone, Debug)]
pub(crate) enum Move {
    Add(Thing, [f64; 3]),
    Change(usize, [f64; 3]),
    Remove(usize),
}

/// A kind of feature.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Thing {
    Banner,
    Chair,
    Tower,
}

/// The moves of one transaction.
pub(crate) type Moves = Vec<Move>;

/// Features by number.
pub(crate) type Content = BTreeMap<Fid, FeatureState>;

/// Histories of one to seven transactions, with one to four moves each.
pub(crate) fn moves() -> impl Strategy<Value = Vec<Moves>> {
    let thing = prop_oneof![Just(Thing::Banner), Just(Thing::Chair), Just(Thing::Tower)];
    let one = prop_oneof![
        (thing, place()).prop_map(|(thing, place)| Move::Add(thing, place)),
        (any::<usize>(), place()).prop_map(|(which, place)| Move::Change(which, place)),
        any::<usize>().prop_map(Move::Remove),
    ];
    proptest::collection::vec(proptest::collection::vec(one, 1..5), 1..8)
}

/// Where a feature may be.
fn place() -> impl Strategy<Value = [f64; 3]> {
    [-50.0..50.0, -50.0..50.0, -10.0..30.0_f64]
}

/// A box among the places: many a feature is in it, many a one is not, and all three axes matter.
pub(super) fn part() -> impl Strategy<Value = BoxMm> {
    let length = prop_oneof![0.0..50.0, Just(200.0)];
    ([-60.0..50.0, -60.0..50.0, -10.0..30.0_f64], [length.clone(), length.clone(), length]).prop_map(|(low, length)| {
        let low = [835_567.743_1 + low[0], 817_816.210_8 + low[1], 7.2 + low[2]];
        let high = [0, 1, 2].map(|axis| low[axis] + length[axis]);
        BoxMm::new(low.into(), high.into()).expect("ends in order")
    })
}

const MESH: &[u8] = b"a mesh";

fn feature(thing: Thing, [east, north, up]: [f64; 3]) -> FeatureState {
    match thing {
        Thing::Banner => moved(banner(north), east, up),
        Thing::Chair => moved(chair(north), east, up),
        Thing::Tower => {
            let corner = [835_567.743_1 + east, 817_816.210_8 + north, 7.2 + up];
            let bounds = BoxMm::new(corner.into(), corner.map(|end| end + 12.0).into()).expect("ends in order");
            FeatureState::Object { name: "tower".to_owned(), geometry: Digest::of(MESH), bounds }
        }
    }
}

fn moved(mut state: FeatureState, east: f64, up: f64) -> FeatureState {
    if let FeatureState::Descriptor(descriptor) = &mut state {
        let points = match descriptor {
            Descriptor::Material(material) => &mut material.corners[..],
            Descriptor::Dynamic(dynamic) => std::slice::from_mut(&mut dynamic.position),
        };
        for point in points {
            *point = GridPoint::new(point.easting_m + east, point.northing_m, point.height_m + up);
        }
    }
    state
}

fn thing_of(state: &FeatureState) -> Thing {
    match state {
        FeatureState::Object { .. } => Thing::Tower,
        FeatureState::Descriptor(Descriptor::Material(_)) => Thing::Banner,
        FeatureState::Descriptor(Descriptor::Dynamic(_)) => Thing::Chair,
    }
}

/// The transaction that makes `moves` on `content`, of version `base`.
pub(super) fn update(base: u64, content: &Content, moves: &[Move]) -> UpdateTransaction {
    let mut update = transaction(base);
    let mut free: Vec<(Fid, &FeatureState)> = content.iter().map(|(fid, state)| (*fid, state)).collect();
    let mut pick = |which: &usize| if free.is_empty() { None } else { Some(free.remove(which % free.len())) };
    for one in moves {
        match one {
            Move::Add(thing, place) => {
                if matches!(thing, Thing::Tower) {
                    update.add_geometry(MESH.to_vec());
                }
                update.additions.push(feature(*thing, *place));
            }
            Move::Change(which, place) => {
                let Some((fid, before)) = pick(which) else { continue };
                let after = feature(thing_of(before), *place);
                update.deltas.push(Delta::modify(fid, before.clone(), after));
            }
            Move::Remove(which) => {
                let Some((fid, before)) = pick(which) else { continue };
                update.deltas.push(Delta::remove(fid, before.clone()));
            }
        }
    }
    update
}

/// Commits `history` and returns what each version should hold, kept beside the store. Version v is committed at minute v.
pub(crate) fn play(history: &dyn History, transactions: &[Moves]) -> Vec<Content> {
    let mut contents = vec![Content::new()];
    let mut next = 1;
    for moves in transactions {
        let base = contents.len() - 1;
        let update = update(base as u64, &contents[base], moves);
        let mut content = contents[base].clone();
        apply(&mut content, &update.deltas);
        for state in &update.additions {
            content.insert(Fid(next), state.clone());
            next += 1;
        }
        if !update.is_empty() {
            let made = history.commit(&update, at(contents.len() as i64));
            assert_eq!(made, Ok(VersionId(contents.len() as u64)));
            contents.push(content);
        }
    }
    contents
}

/// Makes `deltas`, each of which must start from what is there.
pub(super) fn apply(content: &mut Content, deltas: &[Delta]) {
    for delta in deltas {
        assert_eq!(content.get(&delta.fid()), delta.before(), "before feature {}", delta.fid());
        match delta.after() {
            Some(after) => content.insert(delta.fid(), after.clone()),
            None => content.remove(&delta.fid()),
        };
    }
}

/// What the store says that `version` holds.
pub(crate) fn content(history: &dyn History, version: usize) -> Content {
    let features = history.features(VersionId(version as u64), None).expect("features");
    features.into_iter().map(|feature| (feature.fid, feature.state)).collect()
}
