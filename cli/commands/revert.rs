//! `resurvey revert`.

use super::crs_of;
use crate::args::Revert;
use crate::console::Console;
use crate::failure::Failure;
use crate::region;
use jiff::Timestamp;
use resurvey_core::store::{self, History, MapFile};
use serde_json::json;

/// Undoes one version by a new one.
pub fn run(options: &Revert, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open(&options.map)?;
    let wish = store::Revert {
        version: map.resolve(&options.revision)?,
        region: region::bbox(&options.region, crs_of(&map)?, false)?,
        author: options.author.clone(),
        message: options.message.clone(),
        idempotency_key: options.retry.idempotency_key.clone(),
    };
    let version = map.revert(&wish, Timestamp::now())?;
    let counts = map.version(version)?.counts;
    let (added, modified, removed) = (counts.added, counts.modified, counts.removed);
    if console.is_json() {
        console.document(&json!({
            "reverts": wish.version.0, "version": version.0,
            "added": added, "modified": modified, "removed": removed,
        }))?;
    } else {
        console.line(format_args!(
            "version {version} undoes version {}: {added} added, {modified} modified, {removed} removed",
            wish.version
        ))?;
    }
    Ok(0)
}
