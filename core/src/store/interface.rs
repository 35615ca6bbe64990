//! What the rest of the program asks of a store, whatever keeps it.

use super::commit_error::CommitError;
use super::error::StoreError;
use super::revert::{Revert, undoing};
use super::snapshot::Snapshot;
use crate::version::{
    BoxMm, Delta, Digest, Feature, FeatureState, Fid, Revision, Side, Step, UpdateTransaction, VersionId, VersionKind,
    VersionRecord,
};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use std::collections::BTreeMap;

/// What a request for a version gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Made {
    /// The version.
    pub version: VersionId,
    /// Whether the same request made it before.
    pub repeated: bool,
}

/// The history of one map: boxes in whole millimetres, versions as integers, and nothing of any database.
///
/// The methods without a body are all that a backend writes; `conformance` holds the laws that they must keep, for
/// every backend alike. Answers that are lists come by rising feature number, logs newest first. A version above the
/// newest is [`StoreError::NoSuchVersion`], one whose state is forgotten [`StoreError::Forgotten`].
pub trait History {
    /// The newest version.
    fn head(&self) -> Result<VersionId, StoreError>;

    /// What is kept about `version` itself.
    fn version(&self, version: VersionId) -> Result<VersionRecord, StoreError>;

    /// Every version; with a region those that changed something there, each with the counts of just that.
    fn log(&self, region: Option<&BoxMm>) -> Result<Vec<VersionRecord>, StoreError>;

    /// The last version at or before `time`; [`StoreError::BeforeFirst`] when there was no map yet.
    fn version_at(&self, time: Timestamp) -> Result<VersionId, StoreError>;

    /// The version that a transaction with this idempotency key made, if there is one.
    fn made_with(&self, key: &str) -> Result<Option<VersionId>, StoreError>;

    /// What was asked for with the key of `version`; `None` for a version without a key, or where nobody said.
    fn request_of(&self, version: VersionId) -> Result<Option<Digest>, StoreError>;

    /// The classes at `version`.
    fn classes(&self, version: VersionId) -> Result<ClassTable, StoreError>;

    /// The features at `version`; with a region those whose box shares a point with it.
    fn features(&self, version: VersionId, region: Option<&BoxMm>) -> Result<Vec<Feature>, StoreError>;

    /// As [`History::features`], of what `version` knows to have been there at `time`: of the versions up to it that
    /// changed a feature, the one that was seen last at or before `time` decides. A version without a time of its own was
    /// seen when it was committed.
    fn features_observed(
        &self,
        version: VersionId,
        time: Timestamp,
        region: Option<&BoxMm>,
    ) -> Result<Vec<Feature>, StoreError>;

    /// The feature `fid` at `version`; [`StoreError::NoSuchFeature`] when it was not there.
    fn feature(&self, version: VersionId, fid: Fid) -> Result<Feature, StoreError>;

    /// Every life span of `fid`, oldest first; [`StoreError::NeverAFeature`] when there is none.
    fn lives(&self, fid: Fid) -> Result<Vec<Feature>, StoreError>;

    /// The smallest box around all features at `version`; `None` for an empty map.
    fn bounds(&self, version: VersionId) -> Result<Option<BoxMm>, StoreError>;

    /// The bytes of the geometry that `digest` names.
    fn geometry(&self, digest: Digest) -> Result<Vec<u8>, StoreError>;

    /// What differs between `from` and `to`: the way back where `to` is the earlier one. What changed and changed back is
    /// no difference. With a region the features that lie there before or after.
    fn changes(&self, from: VersionId, to: VersionId, region: Option<&BoxMm>) -> Result<Vec<Delta>, StoreError>;

    /// Makes the next version of everything in `transaction`, or refuses it and changes nothing.
    ///
    /// The version's time is `now`, or that of the version before where the clock went back. A key that was used before
    /// gives the version it made then, and is refused where something else was asked for then.
    fn commit_once(&self, transaction: &UpdateTransaction, now: Timestamp) -> Result<Made, CommitError>;

    /// Names `version`.
    fn tag(&self, name: &str, version: VersionId, now: Timestamp) -> Result<(), StoreError>;

    /// Takes the name away from the version it names, and returns that.
    fn untag(&self, name: &str) -> Result<VersionId, StoreError>;

    /// Every tag and what it names, by name.
    fn tags(&self) -> Result<Vec<(String, VersionId)>, StoreError>;

    /// The map at `version`, to ask several questions.
    fn snapshot(&self, version: VersionId) -> Result<Snapshot<'_>, StoreError>
    where
        Self: Sized,
    {
        Snapshot::of(self, version)
    }

    /// As [`History::commit_once`], for who need not know whether the version was there already.
    fn commit(&self, transaction: &UpdateTransaction, now: Timestamp) -> Result<VersionId, CommitError> {
        self.commit_once(transaction, now).map(|made| made.version)
    }

    /// The version that the same request made before under `key`; `None` for a new key. Refuses a key under which
    /// something else was asked for, as far as both say what.
    fn repeated(
        &self,
        key: Option<&str>,
        (kind, request): (VersionKind, Option<Digest>),
    ) -> Result<Option<VersionId>, CommitError> {
        let Some(key) = key else { return Ok(None) };
        let Some(version) = self.made_with(key)? else { return Ok(None) };
        let made = (self.version(version)?.kind, self.request_of(version)?);
        let is_same = made.0 == kind && (made.1 == request || made.1.is_none() || request.is_none());
        if is_same {
            return Ok(Some(version));
        }
        Err(CommitError::OtherRequest { key: key.to_owned(), version, made, asked: (kind, request) })
    }

    /// What `version` did.
    fn changes_of(&self, version: VersionId) -> Result<Vec<Delta>, StoreError> {
        self.changes(VersionId(version.0.saturating_sub(1)), version, None)
    }

    /// Whether the state of `version` is there; a store may forget it.
    fn is_kept(&self, _version: VersionId) -> Result<bool, StoreError> {
        Ok(true)
    }

    /// The versions that changed the feature `fid`, newest first, each with the counts of just that, as far as the states
    /// that are left tell.
    fn log_of(&self, fid: Fid) -> Result<Vec<VersionRecord>, StoreError> {
        let steps = steps(self.lives(fid)?, |version| self.is_kept(version))?;
        let record = |step: &Step| Ok(VersionRecord { counts: step.counts(), ..self.version(step.version)? });
        steps.iter().rev().map(record).collect()
    }

    /// Undoes a version by a new one, or refuses it with a list when later versions changed the same features. What is
    /// undone never was, so the new version speaks of the time that the old one spoke of.
    fn revert(&self, wish: &Revert, now: Timestamp) -> Result<VersionId, CommitError> {
        self.revert_once(wish, now).map(|made| made.version)
    }

    /// As [`History::revert`], and says whether the undo was there already, which is looked for before anything else.
    fn revert_once(&self, wish: &Revert, now: Timestamp) -> Result<Made, CommitError> {
        match self.repeated(wish.idempotency_key.as_deref(), (VersionKind::Revert, wish.request))? {
            Some(version) => Ok(Made { version, repeated: true }),
            None => self.commit_once(&undoing(self, wish)?, now),
        }
    }

    /// The version that `revision` names: `12`, `v12`, `head`, a tag, `@2026-03-01` (the end of that day, UTC) or
    /// `@2026-03-01T10:00:00+08:00`.
    fn resolve(&self, revision: &str) -> Result<VersionId, StoreError> {
        resolve(self, &Revision::parse(revision)?)
    }

    /// The two versions that `REV..REV` names.
    fn resolve_range(&self, range: &str) -> Result<(VersionId, VersionId), StoreError> {
        let (from, to) = Revision::parse_range(range)?;
        Ok((resolve(self, &from)?, resolve(self, &to)?))
    }
}

fn resolve(history: &(impl History + ?Sized), revision: &Revision) -> Result<VersionId, StoreError> {
    match revision {
        Revision::Number(version) => history.version(*version).map(|record| record.version),
        Revision::Head => history.head(),
        Revision::At(time) => history.version_at(*time),
        Revision::Tag(name) => {
            let tagged = history.tags()?.into_iter().find(|(known, _)| known == name);
            tagged.map(|(_, version)| version).ok_or_else(|| StoreError::NoSuchTag { name: name.clone() })
        }
    }
}

/// Every version that changed a feature and how, oldest first, from its life spans. Where no life ends or begins, the
/// feature was not there, if the state before or after is kept; else nobody knows.
pub(super) fn steps<E>(lives: Vec<Feature>, is_kept: impl Fn(VersionId) -> Result<bool, E>) -> Result<Vec<Step>, E> {
    let mut sides: BTreeMap<VersionId, (Option<FeatureState>, Option<FeatureState>)> = BTreeMap::new();
    for life in lives {
        sides.entry(life.from).or_default().1 = Some(life.state.clone());
        if let Some(to) = life.to {
            sides.entry(to).or_default().0 = Some(life.state);
        }
    }
    let side = |state: Option<FeatureState>, at: Option<VersionId>| {
        Ok(match state {
            Some(state) => Side::State(state),
            None if at.map_or(Ok(true), &is_kept)? => Side::Absent,
            None => Side::Forgotten,
        })
    };
    let step = |(version, (before, after)): (VersionId, _)| {
        let earlier = version.0.checked_sub(1).map(VersionId);
        Ok(Step { version, before: side(before, earlier)?, after: side(after, Some(version))? })
    };
    sides.into_iter().map(step).collect()
}
