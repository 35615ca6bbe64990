//! What a transaction comes to, worked out and checked before anything is written: the same for every backend.

use super::commit_error::{CommitError, FID_STEP};
use super::error::StoreError;
use super::rows::check_classes;
use crate::version::{
    BoxMm, Counts, Delta, Digest, FeatureState, Fid, InvalidState, Operations, UpdateTransaction, VersionId,
    VersionKind, VersionRecord, version_hash,
};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use std::collections::BTreeSet;

/// What is written.
pub(super) struct Plan {
    /// The new version.
    pub(super) record: VersionRecord,
    /// By rising feature number, each with its exact state before.
    pub(super) deltas: Vec<Delta>,
    /// Box of the state after each delta.
    pub(super) boxes: Vec<Option<BoxMm>>,
}

/// Refuses what no map could take, whatever is in it.
pub(super) fn check_request(transaction: &UpdateTransaction, head: VersionId) -> Result<(), CommitError> {
    for version in [Some(transaction.base), transaction.reverts].into_iter().flatten() {
        if version > head {
            return Err(StoreError::NoSuchVersion { version, head }.into());
        }
    }
    if transaction.kind == VersionKind::Init {
        return Err(CommitError::Kind);
    }
    if transaction.is_empty() {
        return Err(CommitError::Empty);
    }
    let mut seen = BTreeSet::new();
    for delta in &transaction.deltas {
        let fid = delta.fid();
        if !(1..=Fid::MAX.0).contains(&fid.0) {
            return Err(CommitError::FidRange { fid });
        }
        if !seen.insert(fid) {
            return Err(CommitError::Twice { fid });
        }
        if delta.before() == delta.after() {
            return Err(CommitError::NoChange { fid });
        }
    }
    Ok(())
}

/// The class table that the states of the transaction must fit, where `old` is in force before it.
pub(super) fn check_new_classes(transaction: &UpdateTransaction, old: ClassTable) -> Result<ClassTable, CommitError> {
    let Some(new) = &transaction.classes else { return Ok(old) };
    check_classes(new)?;
    match old.iter().find(|class| new.get(class.index).is_none_or(|kept| kept.kind != class.kind)) {
        Some(lost) => Err(CommitError::ClassLost { class: lost.name.clone() }),
        None => Ok(new.clone()),
    }
}

/// Refuses states that `classes` or geometry do not allow.
pub(super) fn check_states(transaction: &UpdateTransaction, classes: &ClassTable) -> Result<(), CommitError> {
    let invalid = |feature: String| move |error| CommitError::State { feature, error };
    for (position, state) in transaction.additions.iter().enumerate() {
        state.validate(classes).map_err(invalid(format!("addition {position}")))?;
    }
    for delta in &transaction.deltas {
        let after = delta.after().map_or(Ok(()), |state| state.validate(classes));
        after.map_err(invalid(format!("feature {}", delta.fid())))?;
    }
    Ok(())
}

/// Objects of the transaction and the geometry that each needs.
pub(super) fn needed_geometry(transaction: &UpdateTransaction) -> impl Iterator<Item = (&str, Digest)> {
    let after = transaction.deltas.iter().filter_map(Delta::after);
    transaction.additions.iter().chain(after).filter_map(|state| match state {
        FeatureState::Object { name, geometry, .. } => Some((name.as_str(), *geometry)),
        FeatureState::Descriptor(_) => None,
    })
}

/// Refuses geometry under a digest that is not its own.
pub(super) fn check_digests(transaction: &UpdateTransaction) -> Result<(), CommitError> {
    for (given, bytes) in &transaction.geometries {
        let found = Digest::of(bytes);
        if found != *given {
            return Err(CommitError::WrongDigest { given: *given, found });
        }
    }
    Ok(())
}

/// Whether `delta` starts from what is `live`.
pub(super) fn starts_from(delta: &Delta, live: Option<&FeatureState>) -> bool {
    match (delta.before(), live) {
        (Some(before), Some(live)) => before.is_same_as(live),
        (before, live) => before.is_none() && live.is_none(),
    }
}

/// Refuses additions under numbers that are far above `last_fid`, or were another thing's; `past` is what a feature that is
/// gone was last. An undo brings back what was there.
pub(super) fn check_numbers<E: From<CommitError>>(
    transaction: &UpdateTransaction,
    last_fid: Fid,
    past: impl Fn(Fid) -> Result<Option<FeatureState>, E>,
) -> Result<(), E> {
    for delta in transaction.deltas.iter().filter(|delta| delta.before().is_none()) {
        let fid = delta.fid();
        if fid.0 > last_fid.0.saturating_add(FID_STEP) {
            return Err(CommitError::FidAhead { fid, last: last_fid }.into());
        }
        if fid > last_fid || transaction.kind == VersionKind::Revert {
            continue;
        }
        let (was, found) = (past(fid)?.as_ref().map(thing), delta.after().map(thing));
        if let (Some(was), Some(found)) = (was, found)
            && was != found
        {
            return Err(CommitError::FidOfAnother { fid, was, found }.into());
        }
    }
    Ok(())
}

/// What a feature is through all its states.
fn thing(state: &FeatureState) -> String {
    match state.class() {
        Some(class) => format!("a {} descriptor of class {}", state.kind_name(), class.0),
        None => format!("an {}", state.kind_name()),
    }
}

/// Boxes of everything that the transaction changes, before and after. A state without a box is refused by
/// [`check_states`], by name.
pub(super) fn touched(transaction: &UpdateTransaction) -> Vec<BoxMm> {
    let sides = transaction.deltas.iter().flat_map(|delta| delta.before().into_iter().chain(delta.after()));
    sides.chain(&transaction.additions).filter_map(|state| state.bounds().ok()).collect()
}

/// The version after `head`, in which the additions have the numbers after `last_fid` and each delta starts from exactly
/// what `live` gives.
pub(super) fn plan(
    transaction: &UpdateTransaction,
    live: impl Fn(Fid) -> Option<FeatureState>,
    last_fid: Fid,
    head: &VersionRecord,
    (evidence, now): (Option<Digest>, Timestamp),
) -> Result<Plan, CommitError> {
    let deltas = numbered(transaction, live, last_fid)?;
    let (boxes, envelope) = boxes_of(&deltas)?;
    let mut operations = Operations::start(None, transaction.classes.as_ref(), deltas.len() as u64);
    deltas.iter().for_each(|delta| operations.add(delta));
    let record = VersionRecord {
        version: VersionId(head.version.0 + 1),
        kind: transaction.kind,
        committed_at: whole_microseconds(now).max(head.committed_at),
        observed_at: transaction.observed_at.map(whole_microseconds),
        author: transaction.author.clone(),
        message: transaction.message.clone(),
        base: Some(transaction.base),
        reverts: transaction.reverts,
        counts: Some(Counts::of(&deltas)),
        envelope,
        idempotency_key: transaction.idempotency_key.clone(),
        evidence,
        hash: version_hash(Some(head.hash), operations.finish(), evidence),
    };
    Ok(Plan { record, deltas, boxes })
}

/// Times of a map are whole microseconds.
pub(super) fn whole_microseconds(time: Timestamp) -> Timestamp {
    Timestamp::from_microsecond(time.as_microsecond()).unwrap_or(time)
}

fn numbered(
    transaction: &UpdateTransaction,
    live: impl Fn(Fid) -> Option<FeatureState>,
    last_fid: Fid,
) -> Result<Vec<Delta>, CommitError> {
    let mut last = transaction.deltas.iter().map(|delta| delta.fid().0).fold(last_fid.0, u64::max);
    let mut deltas = Vec::with_capacity(transaction.deltas.len() + transaction.additions.len());
    for delta in &transaction.deltas {
        deltas.extend(Delta::from_sides(delta.fid(), live(delta.fid()), delta.after().cloned()));
    }
    for state in &transaction.additions {
        last += 1;
        if last > Fid::MAX.0 {
            return Err(CommitError::FidRange { fid: Fid(last) });
        }
        deltas.push(Delta::add(Fid(last), state.clone()));
    }
    deltas.sort_by_key(Delta::fid);
    Ok(deltas)
}

/// The box after each delta, and the one around all states before and after.
fn boxes_of(deltas: &[Delta]) -> Result<(Vec<Option<BoxMm>>, Option<BoxMm>), CommitError> {
    let mut envelope: Option<BoxMm> = None;
    let mut boxes = Vec::with_capacity(deltas.len());
    for delta in deltas {
        let bounds = |state: Option<&FeatureState>| state.map(FeatureState::bounds).transpose();
        let invalid = |error| {
            let error = InvalidState::Box(error);
            CommitError::State { feature: format!("feature {}", delta.fid()), error }
        };
        let (before, after) = (bounds(delta.before()).map_err(invalid)?, bounds(delta.after()).map_err(invalid)?);
        for bounds in [before, after].into_iter().flatten() {
            envelope = Some(envelope.map_or(bounds, |envelope| envelope.union(&bounds)));
        }
        boxes.push(after);
    }
    Ok((boxes, envelope))
}
