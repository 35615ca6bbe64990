//! `resurvey changes`.

use crate::args::Changes;
use crate::console::Console;
use crate::failure::Failure;
use resurvey_core::store::{History, MapFile};
use resurvey_core::version::{VersionId, write_change_set};
use resurvey_schema::changes::{ChangeSetHeader, FORMAT};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// Prints what leads from one version to another as a change set.
pub fn run(options: &Changes, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open_read_only(&options.map)?;
    let (from, to) = map.resolve_range(&options.range)?;
    let deltas = map.changes(from, to, None)?;
    let (before, after) = (map.snapshot(from)?, map.snapshot(to)?);
    let header = header(&map, from, to)?;
    let mut geometries = BTreeMap::new();
    for digest in deltas.iter().filter_map(|delta| delta.after()?.geometry()) {
        if let Entry::Vacant(place) = geometries.entry(digest) {
            place.insert(map.geometry(digest)?);
        }
    }
    let text = write_change_set(&header, &deltas, (before.classes(), after.classes()), &geometries)?;
    console.out().write_all(text.as_bytes())?;
    if before.classes() != after.classes() {
        console.message("warning: the class table differs too; a change set does not carry it");
    }
    Ok(0)
}

/// Author, message and time of the version where the set is what one version did.
fn header(map: &MapFile, from: VersionId, to: VersionId) -> Result<ChangeSetHeader, Failure> {
    let mut header = ChangeSetHeader {
        format: FORMAT.to_owned(),
        base_version: Some(from.0),
        author: None,
        message: Some(format!("changes {from}..{to} of map {}", map.info()?.map_id)),
        observed_at: None,
    };
    if to.0 == from.0 + 1 {
        let record = map.version(to)?;
        header.author = Some(record.author);
        header.message = Some(record.message);
        header.observed_at = record.observed_at.map(|time| time.to_string());
    }
    Ok(header)
}
