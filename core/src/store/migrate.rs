//! Bringing a map to the newest format.

use super::error::Fault;
use super::index::{Source, rebuild};
use super::kept_states::write_kept_states;
use super::seal::{self, SEALED_FORMAT};
use resurvey_schema::sql::MIGRATIONS;
use rusqlite::Connection;
use std::collections::BTreeMap;

/// The first format whose index this program reads.
pub(super) const INDEX_FORMAT: usize = 3;

/// The number of migrations that the file has had.
pub(super) fn format_of(connection: &Connection) -> Result<usize, Fault> {
    let format: i32 = connection.pragma_query_value(None, "user_version", |row| row.get(0))?;
    Ok(format.max(0) as usize)
}

/// Applies the migrations that the file has not had. What is sealed then is what is found: of damage from before only
/// the hash chain knows.
pub(super) fn migrate(connection: &Connection) -> Result<(), Fault> {
    let format = format_of(connection)?;
    for migration in MIGRATIONS.iter().skip(format) {
        connection.execute_batch(migration)?;
    }
    if format < INDEX_FORMAT {
        rebuild(connection, &Source::read(connection)?, BTreeMap::new())?;
    }
    if format < SEALED_FORMAT {
        write_kept_states(connection)?;
        for sealed in seal::ALL {
            sealed.seal_all(connection)?;
        }
    }
    connection.pragma_update(None, "user_version", MIGRATIONS.len() as i32)?;
    Ok(())
}
