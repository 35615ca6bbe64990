//! Undoing one version by a new one.

use super::commit_error::CommitError;
use super::error::{Fault, StoreError};
use super::forgotten::check_state;
use super::map_file::MapFile;
use super::operations::new_classes;
use super::rows::classes_at;
use crate::version::{BoxMm, Delta, UpdateTransaction, VersionId, VersionKind, VersionRecord};
use jiff::Timestamp;
use resurvey_schema::ClassTable;

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
}

impl MapFile {
    /// Undoes a version by a new one, or refuses it with a list when later versions changed the same features. What is
    /// undone never was, so the new version speaks of the time that the old one spoke of.
    pub fn revert(&self, wish: &Revert, now: Timestamp) -> Result<VersionId, CommitError> {
        let record = self.version(wish.version)?;
        let deltas = match &wish.region {
            Some(region) => self.changes_in(before(wish.version), wish.version, region)?,
            None => self.changes_of(wish.version)?,
        };
        let classes = if wish.region.is_none() { self.classes_before(wish.version)? } else { None };
        if deltas.is_empty() && classes.is_none() {
            let place = if wish.region.is_some() { " in the region" } else { "" };
            return Err(CommitError::NothingToRevert { version: wish.version, place });
        }
        let message = wish.message.clone().unwrap_or_else(|| message_of(&record));
        let mut transaction = UpdateTransaction::new(wish.version, VersionKind::Revert, wish.author.clone(), message);
        transaction.reverts = Some(wish.version);
        transaction.observed_at = Some(record.observed_at.unwrap_or(record.committed_at));
        transaction.idempotency_key.clone_from(&wish.idempotency_key);
        transaction.deltas = deltas.into_iter().map(Delta::undone).collect();
        transaction.classes = classes;
        self.commit(&transaction, now)
    }

    /// The class table that `version` replaced, if it brought one that is still in force.
    fn classes_before(&self, version: VersionId) -> Result<Option<ClassTable>, StoreError> {
        let head = self.head()?;
        self.read(|connection| -> Result<Option<ClassTable>, Fault> {
            check_state(connection, before(version))?;
            let Some(brought) = new_classes(connection, version)?.filter(|_| version.0 > 0) else { return Ok(None) };
            let is_in_force = classes_at(connection, head)? == brought;
            if is_in_force { classes_at(connection, before(version)).map(Some) } else { Ok(None) }
        })
    }
}

fn before(version: VersionId) -> VersionId {
    VersionId(version.0.saturating_sub(1))
}

fn message_of(record: &VersionRecord) -> String {
    let first_line = record.message.lines().next().unwrap_or_default();
    format!("revert version {}: {first_line}", record.version)
}
