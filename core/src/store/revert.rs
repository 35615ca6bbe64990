//! Undoing one version by a new one.

use super::commit::make_unseen_version;
use super::commit_error::CommitError;
use super::error::StoreError;
use super::interface::History;
use super::map_file::MapFile;
use crate::version::{BoxMm, Delta, Digest, UpdateTransaction, VersionId, VersionKind, VersionRecord};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use rusqlite::named_params;
use std::cmp::Reverse;
use std::collections::BTreeSet;

/// What is to be undone, by whom and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Revert {
    /// The version to undo.
    pub version: VersionId,
    /// Only what lies in here before or after; everything without.
    pub region: Option<BoxMm>,
    /// Who.
    pub author: String,
    /// Why; when there is none, the message quotes that of the version.
    pub message: Option<String>,
    /// The same key a second time gives the version of the first time.
    pub idempotency_key: Option<String>,
    /// Digest of what is asked for: the same key with another one is refused.
    pub request: Option<Digest>,
}

/// What became of a wish to undo several versions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reverted {
    /// What was undone and by which version, in the order of the versions that undid it.
    pub undone: Vec<(VersionId, VersionId)>,
    /// Whether the same request did it before.
    pub repeated: bool,
}

impl MapFile {
    /// Undoes each of `versions` that still shows, newest first, each by a version of its own: all of them or none. `wish`
    /// says the rest; its idempotency key goes to the first, and with `#2`, `#3` … to the further ones.
    pub fn revert_all(&self, versions: &[VersionId], wish: &Revert, now: Timestamp) -> Result<Reverted, CommitError> {
        let newest_first: BTreeSet<Reverse<VersionId>> = versions.iter().copied().map(Reverse).collect();
        self.write(|connection| {
            let mut undone = self.undone_before(wish)?;
            if !undone.is_empty() {
                return Ok(Reverted { undone, repeated: true });
            }
            for Reverse(version) in newest_first {
                let one = Revert { version, idempotency_key: nth_key(wish, undone.len()), ..wish.clone() };
                let Some(transaction) = self.undoing_what_shows(&one)? else { continue };
                let made = make_unseen_version(connection, &transaction, None, now)?;
                undone.push((version, made.version));
            }
            Ok(Reverted { undone, repeated: false })
        })
    }

    /// What the same request undid before, and by which versions.
    pub fn undone_before(&self, wish: &Revert) -> Result<Vec<(VersionId, VersionId)>, CommitError> {
        let mut undone = Vec::new();
        while let Some(version) =
            self.repeated(nth_key(wish, undone.len()).as_deref(), (VersionKind::Revert, wish.request))?
        {
            undone.push((self.version(version)?.reverts.unwrap_or(version), version));
        }
        Ok(undone)
    }

    /// The transaction that undoes what `wish` names, without what is undone already.
    fn undoing_what_shows(&self, wish: &Revert) -> Result<Option<UpdateTransaction>, CommitError> {
        let mut transaction = match undoing(self, wish) {
            Ok(transaction) => transaction,
            Err(CommitError::NothingToRevert { .. }) => return Ok(None),
            // Nobody knows what it did, but nothing of it is left to be undone.
            Err(CommitError::Store(StoreError::Forgotten { .. })) if !self.lives_on(wish.version)? => return Ok(None),
            Err(error) => return Err(error),
        };
        let head = self.head()?;
        let mut showing = Vec::new();
        for delta in std::mem::take(&mut transaction.deltas) {
            let live = match self.feature(head, delta.fid()) {
                Ok(feature) => Some(feature.state),
                Err(StoreError::NoSuchFeature { .. }) => None,
                Err(error) => return Err(error.into()),
            };
            if live.as_ref() != delta.after() {
                showing.push(delta);
            }
        }
        transaction.deltas = showing;
        Ok((!transaction.is_empty()).then_some(transaction))
    }

    /// Whether the newest version has a state that `version` brought.
    fn lives_on(&self, version: VersionId) -> Result<bool, StoreError> {
        const SQL: &str = "SELECT EXISTS (SELECT 1 FROM feature_version
            WHERE from_version = :version AND to_version IS NULL) ORDER BY 1";
        self.read(|connection| {
            let mut statement = connection.prepare_cached(SQL)?;
            Ok(statement.query_row(named_params! {":version": version.0 as i64}, |row| row.get(0))?)
        })
    }
}

/// The key of the undo after so many others of one wish.
fn nth_key(wish: &Revert, others: usize) -> Option<String> {
    let key = wish.idempotency_key.as_deref()?;
    Some(if others == 0 { key.to_owned() } else { format!("{key}#{}", others + 1) })
}

/// The transaction that undoes what `wish` names.
pub(super) fn undoing(history: &(impl History + ?Sized), wish: &Revert) -> Result<UpdateTransaction, CommitError> {
    let record = history.version(wish.version)?;
    let deltas = history.changes(before(wish.version), wish.version, wish.region.as_ref())?;
    let classes = if wish.region.is_none() { classes_before(history, wish.version)? } else { None };
    if deltas.is_empty() && classes.is_none() {
        let place = if wish.region.is_some() { " in the region" } else { "" };
        return Err(CommitError::NothingToRevert { version: wish.version, place });
    }
    let message = wish.message.clone().unwrap_or_else(|| message_of(&record));
    let mut transaction = UpdateTransaction::new(wish.version, VersionKind::Revert, wish.author.clone(), message);
    transaction.reverts = Some(wish.version);
    transaction.observed_at = Some(record.observed_at.unwrap_or(record.committed_at));
    transaction.idempotency_key.clone_from(&wish.idempotency_key);
    transaction.request = wish.request;
    transaction.deltas = deltas.into_iter().map(Delta::undone).collect();
    transaction.classes = classes;
    Ok(transaction)
}

/// The class table that `version` replaced, if it brought another one that is still in force.
fn classes_before(history: &(impl History + ?Sized), version: VersionId) -> Result<Option<ClassTable>, StoreError> {
    let (old, brought) = (history.classes(before(version))?, history.classes(version)?);
    let is_in_force = old != brought && history.classes(history.head()?)? == brought;
    Ok(is_in_force.then_some(old))
}

fn before(version: VersionId) -> VersionId {
    VersionId(version.0.saturating_sub(1))
}

fn message_of(record: &VersionRecord) -> String {
    let first_line = record.message.lines().next().unwrap_or_default();
    format!("revert version {}: {first_line}", record.version)
}
