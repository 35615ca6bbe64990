//! The index of a map of a format that has another one, or none, made for one connection.

use super::error::Fault;
use super::index::{Source, rebuild};
use super::migrate::{INDEX_FORMAT, format_of};
use resurvey_schema::sql::{INDEX_BESIDE, INDEX_BESIDE_END};
use rusqlite::Connection;
use std::collections::BTreeMap;

/// What a connection has of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Beside {
    /// The map has the index itself.
    NotNeeded,
    /// Nothing yet.
    Missing,
    /// All that was in the file when its `data_version` was this.
    Of(i64),
}

impl Beside {
    /// For a map of this format.
    pub(super) fn for_format(format: usize) -> Self {
        if format < INDEX_FORMAT { Self::Missing } else { Self::NotNeeded }
    }

    /// Makes it what the file is now, in the transaction that is going to ask it: others may have committed, or migrated
    /// the map. What it is then holds if the transaction ends well.
    pub(super) fn refreshed(self, connection: &Connection) -> Result<Self, Fault> {
        if self == Self::NotNeeded {
            return Ok(self);
        }
        let now = Self::Of(connection.pragma_query_value(None, "data_version", |row| row.get(0))?);
        if self == now {
            return Ok(self);
        }
        if format_of(connection)? >= INDEX_FORMAT {
            return self.ended(connection);
        }
        if self == Self::Missing {
            connection.execute_batch(INDEX_BESIDE)?;
        }
        rebuild(connection, &Source::read(connection)?, BTreeMap::new())?;
        Ok(now)
    }

    /// Gives way to the index of the map, in the transaction that is going to use that.
    pub(super) fn ended(self, connection: &Connection) -> Result<Self, Fault> {
        if let Self::Of(_) = self {
            connection.execute_batch(INDEX_BESIDE_END)?;
        }
        Ok(Self::NotNeeded)
    }
}
