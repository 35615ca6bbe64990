//! `resurvey log`.

use super::{crs_of, versions_by};
use crate::args::Log;
use crate::console::Console;
use crate::document;
use crate::failure::Failure;
use crate::plain::plain;
use crate::region;
use comfy_table::{Table, presets};
use resurvey_core::store::{History, MapFile};
use resurvey_core::version::{BoxMm, Counts, Fid, VersionId, VersionRecord};
use serde_json::json;
use std::collections::BTreeSet;

/// Versions that changed something, newest first.
pub fn run(options: &Log, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open_read_only(&options.map)?;
    let bounds = region::bbox(&options.region, crs_of(&map)?)?;
    let mut records: Vec<VersionRecord> = match (options.fid, bounds) {
        (Some(fid), bounds) => log_of(&map, Fid(fid), bounds.as_ref())?,
        (None, bounds) => map.log(bounds.as_ref())?,
    };
    if let Some(build) = &options.by_plugin {
        let versions: BTreeSet<VersionId> = versions_by(&map, build)?.into_iter().collect();
        records.retain(|record| versions.contains(&record.version));
    }
    records.truncate(options.limit.unwrap_or(usize::MAX));
    if console.is_json() {
        let versions: Vec<_> = records.iter().map(document::version).collect();
        console.document(&json!({ "versions": versions }))?;
        return Ok(0);
    }
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header([
        "version",
        "kind",
        "committed",
        "author",
        "+",
        "~",
        "-",
        "message",
    ]);
    for record in &records {
        let count = |pick: fn(Counts) -> u64| record.counts.map_or("?".to_owned(), |counts| pick(counts).to_string());
        table.add_row([
            record.version.to_string(),
            record.kind.name().to_owned(),
            record.committed_at.to_string(),
            plain(&record.author).into_owned(),
            count(|counts| counts.added),
            count(|counts| counts.modified),
            count(|counts| counts.removed),
            plain(&record.message).into_owned(),
        ]);
    }
    console.line(table.trim_fmt())?;
    if records.iter().any(|record| record.counts.is_none()) {
        console.message("?: unknown, forgotten");
    }
    Ok(0)
}

/// The versions that changed a feature; with a region those after or before which it lay there.
fn log_of(map: &MapFile, fid: Fid, bounds: Option<&BoxMm>) -> Result<Vec<VersionRecord>, Failure> {
    let mut records = map.log_of(fid)?;
    if let Some(bounds) = bounds {
        let mut versions = BTreeSet::new();
        for life in map.lives(fid)? {
            // A state in the map has a box.
            if life.state.bounds().is_ok_and(|own| own.intersects(bounds)) {
                versions.extend(std::iter::once(life.from).chain(life.to));
            }
        }
        records.retain(|record| versions.contains(&record.version));
    }
    Ok(records)
}
