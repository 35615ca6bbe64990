//! Random histories.

use super::{at, banner, chair, transaction};
use crate::store::History;
use crate::version::{Delta, FeatureState, Fid, UpdateTransaction, VersionId};
use proptest::prelude::*;
use std::collections::BTreeMap;

/// What a random transaction does next.
#[derive(Clone, Debug)]
pub(crate) enum Move {
    Add(bool, f64),
    Change(usize, f64),
    Remove(usize),
}

/// The moves of one transaction.
pub(crate) type Moves = Vec<Move>;

/// Features by number.
pub(crate) type Content = BTreeMap<Fid, FeatureState>;

/// Histories of one to seven transactions, with one to four moves each.
pub(crate) fn moves() -> impl Strategy<Value = Vec<Moves>> {
    let one = prop_oneof![
        (any::<bool>(), -50.0..50.0_f64).prop_map(|(is_banner, offset)| Move::Add(is_banner, offset)),
        (any::<usize>(), -50.0..50.0_f64).prop_map(|(which, offset)| Move::Change(which, offset)),
        any::<usize>().prop_map(Move::Remove),
    ];
    proptest::collection::vec(proptest::collection::vec(one, 1..5), 1..8)
}

fn feature(is_banner: bool, offset: f64) -> FeatureState {
    if is_banner { banner(offset) } else { chair(offset) }
}

/// The transaction that makes `moves` on `content`, of version `base`.
pub(super) fn update(base: u64, content: &Content, moves: &[Move]) -> UpdateTransaction {
    let mut update = transaction(base);
    let mut free: Vec<(Fid, &FeatureState)> = content.iter().map(|(fid, state)| (*fid, state)).collect();
    let mut pick = |which: &usize| if free.is_empty() { None } else { Some(free.remove(which % free.len())) };
    for one in moves {
        match one {
            Move::Add(is_banner, offset) => update.additions.push(feature(*is_banner, *offset)),
            Move::Change(which, offset) => {
                let Some((fid, before)) = pick(which) else { continue };
                let after = feature(before.kind_name() == "material", *offset);
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
