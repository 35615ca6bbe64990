//! Why a transaction is not committed.

use super::error::StoreError;
use crate::version::{Digest, FeatureState, Fid, InvalidState, VersionId, VersionKind};

/// An addition may leave so many numbers out. Versions stay for ever, so the highest number would end all additions.
pub(super) const FID_STEP: u64 = 1 << 32;

/// Why a transaction was not committed; the map is as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CommitError {
    /// The map changed since the base version, or is not what the transaction takes it to be.
    #[error("{}: {}", since(*base, *head), list(changed, looked_at))]
    Conflict {
        /// The version the transaction was worked out against.
        base: VersionId,
        /// The newest version.
        head: VersionId,
        /// What is not as expected, by rising feature number.
        changed: Vec<ConflictingChange>,
        /// Versions after the base whose writers looked at a place that the transaction changes.
        looked_at: Vec<VersionId>,
    },
    /// A version that did nothing there.
    #[error("version {version} changed nothing{place}; there is nothing to undo")]
    NothingToRevert {
        /// The version.
        version: VersionId,
        /// ` in the region`, or nothing.
        place: &'static str,
    },
    /// An idempotency key under which something else was asked for.
    #[error(
        "idempotency key {key:?} made version {version} for {}, and comes with {} now; expected the same request again, or another key",
        request(made),
        request(asked)
    )]
    OtherRequest {
        /// The key.
        key: String,
        /// What it made.
        version: VersionId,
        /// What was asked for then, where the map knows.
        made: (VersionKind, Option<Digest>),
        /// What is asked for now, where it is said.
        asked: (VersionKind, Option<Digest>),
    },
    /// The idempotency key of a proposal that is another.
    #[error(
        "idempotency key {key:?} is that of proposal {id}, which is another; expected the same again, or another key"
    )]
    OtherProposal {
        /// The key.
        key: String,
        /// The proposal.
        id: u64,
    },
    /// Nothing to commit.
    #[error("the transaction changes nothing; expected at least one feature or a class table")]
    Empty,
    /// Only the creation of a map makes this kind.
    #[error("a commit cannot be of kind \"init\"")]
    Kind,
    /// Two deltas for one feature.
    #[error("feature {fid} has two deltas; expected one at most")]
    Twice {
        /// The feature.
        fid: Fid,
    },
    /// A delta whose sides are the same.
    #[error("the delta of feature {fid} changes nothing")]
    NoChange {
        /// The feature.
        fid: Fid,
    },
    /// A number no feature can have.
    #[error("feature number {} is not between 1 and {}", .fid.0, Fid::MAX)]
    FidRange {
        /// The number.
        fid: Fid,
    },
    /// A number so far above the others that it would use them up.
    #[error(
        "feature number {fid} is too far above {last}, the highest in the map; expected at most {}, or no number: the map \
         gives the next", last.0.saturating_add(FID_STEP)
    )]
    FidAhead {
        /// The number.
        fid: Fid,
        /// The highest that a feature has or had.
        last: Fid,
    },
    /// A number that was another thing's.
    #[error(
        "feature {fid} was {was} when it went and cannot come back as {found}; leave out the number to add another"
    )]
    FidOfAnother {
        /// The number.
        fid: Fid,
        /// What it was.
        was: String,
        /// What is added under it.
        found: String,
    },
    /// A state that cannot be in a map.
    #[error("{feature}: {error}")]
    State {
        /// `feature 7`, or `addition 0` counted from 0.
        feature: String,
        /// Why.
        error: InvalidState,
    },
    /// Too far from the rest of the map.
    #[error("{feature} lies more than 2 147 km from the middle of the map's index")]
    OutsideIndex {
        /// `feature 7`.
        feature: String,
    },
    /// An object whose geometry is neither in the map nor in the transaction.
    #[error("object {name:?} needs geometry {digest}, which is neither in the map nor in the transaction")]
    NoGeometry {
        /// Name of the object.
        name: String,
        /// What it needs.
        digest: Digest,
    },
    /// Geometry under a digest that is not its own.
    #[error("geometry given as {given} has digest {found}")]
    WrongDigest {
        /// What the transaction says.
        given: Digest,
        /// What it is.
        found: Digest,
    },
    /// A class that goes or changes its kind.
    #[error(
        "the new class table drops or changes the kind of class {class:?}; a class may only be renamed, recoloured or added"
    )]
    ClassLost {
        /// Its name in the old table.
        class: String,
    },
    /// Something else than descriptors in a proposal.
    #[error("a proposal changes descriptors only; {found} cannot wait for review")]
    NotProposable {
        /// What it changes as well.
        found: &'static str,
    },
    /// The file.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// One thing that is not as a transaction expects.
#[derive(Clone, Debug, PartialEq)]
pub struct ConflictingChange {
    /// The feature.
    pub fid: Fid,
    /// The version that changed it last; `None` when no version ever had it.
    pub changed_in: Option<VersionId>,
    /// Its live state; `None` when it is not in the map.
    pub found: Option<FeatureState>,
    /// Whether the transaction changes it; else it only lies in the viewed region.
    pub is_target: bool,
}

fn request((kind, digest): &(VersionKind, Option<Digest>)) -> String {
    match digest {
        Some(digest) => format!("the {} {digest}", kind.name()),
        None => format!("the {} of which no digest is known", kind.name()),
    }
}

fn since(base: VersionId, head: VersionId) -> String {
    if base == head {
        return format!("version {head} of the map is not what was expected");
    }
    format!("the map changed between version {base} and version {head}")
}

fn list(changed: &[ConflictingChange], looked_at: &[VersionId]) -> String {
    const SHOWN: usize = 5;
    let one = |change: &ConflictingChange| {
        let place = if change.is_target { "" } else { " in the viewed region" };
        match change.changed_in {
            Some(version) => format!("feature {}{place} (version {version})", change.fid),
            None => format!("feature {} is in no version that is kept", change.fid),
        }
    };
    let seen = |version: &VersionId| format!("version {version} looked at a place that this changes");
    let all: Vec<String> = changed.iter().map(one).chain(looked_at.iter().map(seen)).collect();
    let mut text = all[..all.len().min(SHOWN)].join(", ");
    if all.len() > SHOWN {
        text += &format!(" and {} more", all.len() - SHOWN);
    }
    text
}
