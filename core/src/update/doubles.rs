//! What an undo brings back where another stands by now.

use super::resolve::in_the_way;
use crate::store::{CommitError, ConflictingChange, History, StoreError};
use crate::version::{BoxMm, Delta, Feature, FeatureState, VersionId};
use resurvey_schema::Descriptor;

/// A wall of the map stands off the true one by less, so banners that share a surface are no further apart.
const REACH_MM: i64 = 1_000;

/// Refuses `version`, an undo, when it brings back a descriptor where another one stands that came since the undone version
/// and is or replaces it: a chair that somebody saw again, and added. Names those that stand there.
pub fn refuse_doubles(history: &(impl History + ?Sized), version: VersionId) -> Result<(), CommitError> {
    let record = history.version(version)?;
    let since = record.reverts.unwrap_or(version);
    let mut changed = Vec::new();
    for delta in history.changes_of(version)?.iter().filter(|delta| delta.before().is_none()) {
        let Some(other) = other_in_place(history, version, delta)?.filter(|other| other.from > since) else { continue };
        let (fid, changed_in, found) = (other.fid, Some(other.from), Some(other.state));
        changed.push(ConflictingChange { fid, changed_in, found, is_target: false });
    }
    if changed.is_empty() {
        return Ok(());
    }
    let head = VersionId(version.0.saturating_sub(1));
    Err(CommitError::Conflict { base: since, head, changed, looked_at: Vec::new() })
}

fn other_in_place(
    history: &(impl History + ?Sized),
    version: VersionId,
    delta: &Delta,
) -> Result<Option<Feature>, StoreError> {
    let Some(FeatureState::Descriptor(added)) = delta.after() else { return Ok(None) };
    let around = delta.after().and_then(|state| state.bounds().ok()).and_then(|bounds| grown(&bounds));
    let mut near = history.features(version, around.as_ref())?;
    near.retain(|feature| feature.fid != delta.fid());
    let descriptor = |feature: &Feature| match &feature.state {
        FeatureState::Descriptor(descriptor) => Some((feature.fid.0, descriptor.clone())),
        FeatureState::Object { .. } => None,
    };
    let descriptors: Vec<(u64, Descriptor)> = near.iter().filter_map(descriptor).collect();
    let other = in_the_way(added, &descriptors);
    Ok(near.into_iter().find(|feature| Some(feature.fid.0) == other))
}

fn grown(bounds: &BoxMm) -> Option<BoxMm> {
    BoxMm::from_mm(bounds.min().map(|end| end - REACH_MM), bounds.max().map(|end| end + REACH_MM))
}
