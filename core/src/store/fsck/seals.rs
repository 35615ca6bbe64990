//! What the hash chain does not cover: rows under their seal, and states to which the way is forgotten.

use super::problem::Findings;
use crate::store::error::Fault;
use crate::store::kept_states::kept_states;
use crate::store::migrate::format_of;
use crate::store::seal::{ALL, SEALED_FORMAT};
use crate::version::Digest;
use rusqlite::Connection;

/// Rows are what their seal says.
pub(super) fn seals(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    if format_of(connection)? < SEALED_FORMAT {
        return Ok(());
    }
    for sealed in ALL {
        for broken in sealed.broken(connection)? {
            findings.add(broken.place, expected("its row has", broken.found, broken.seal));
        }
    }
    Ok(())
}

/// The state of a version to which the way is forgotten is what the hash chain proved when it was there.
pub(super) fn states(connection: &Connection, findings: &mut Findings) -> Result<(), Fault> {
    if format_of(connection)? < SEALED_FORMAT {
        return Ok(());
    }
    for kept in kept_states(connection)? {
        let place = format!("version {}", kept.version);
        match kept.found(connection) {
            Ok(found) if kept.digest == Some(found) => {}
            Ok(found) => findings.add(place, expected("its state has", found, kept.digest)),
            Err(Fault::Damage(detail)) => findings.add(place, format!("its state cannot be read: {detail}")),
            Err(fault) => return Err(fault),
        }
    }
    Ok(())
}

fn expected(what: &str, found: Digest, expected: Option<Digest>) -> String {
    match expected {
        Some(expected) => format!("{what} digest {found}, expected {expected}"),
        None => format!("{what} digest {found}, and none is written down"),
    }
}
