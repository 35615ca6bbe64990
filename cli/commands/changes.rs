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
    let mut geometries = BTreeMap::new();
    for digest in deltas.iter().filter_map(|delta| delta.after()?.geometry()) {
        if let Entry::Vacant(place) = geometries.entry(digest) {
            place.insert(map.geometry(digest)?);
        }
    }
    let mut header = header(&map, from, to)?;
    if !geometries.is_empty() {
        header.classes = Some(after.classes().iter().map(|class| (class.name.clone(), class.index)).collect());
    }
    let text = write_change_set(&header, &deltas, (before.classes(), after.classes()), &geometries)?;
    console.out().write_all(text.as_bytes())?;
    if before.classes() != after.classes() {
        console.message("warning: the class table differs too; a change set does not carry it");
    }
    Ok(0)
}

/// Where the set starts from, and author, message and time of what it does: of one version those it has itself, of several
/// all their authors and the time at which the newest was seen. A way back is nobody's work yet.
fn header(map: &MapFile, from: VersionId, to: VersionId) -> Result<ChangeSetHeader, Failure> {
    let map_id = map.info()?.map_id;
    let mut header = ChangeSetHeader {
        format: FORMAT.to_owned(),
        base_version: Some(from.0),
        author: None,
        message: Some(format!("changes {from}..{to} of map {map_id}")),
        observed_at: None,
        map_id: Some(map_id),
        base_hash: Some(map.version(from)?.hash.to_string()),
        classes: None,
    };
    let records: Vec<_> =
        (from.0 + 1..=to.0).map(|version| map.version(VersionId(version))).collect::<Result<_, _>>()?;
    if let [only] = records.as_slice() {
        header.message = Some(only.message.clone());
    }
    let mut authors: Vec<&str> = Vec::new();
    for record in &records {
        if !record.author.is_empty() && !authors.contains(&record.author.as_str()) {
            authors.push(&record.author);
        }
    }
    header.author = (!authors.is_empty()).then(|| authors.join(", "));
    // Where one of them says when it was seen, that of the others is when they were committed.
    let is_seen = records.iter().any(|record| record.observed_at.is_some());
    let seen = records.iter().map(|record| record.observed_at.unwrap_or(record.committed_at)).max();
    header.observed_at = seen.filter(|_| is_seen).map(|time| time.to_string());
    Ok(header)
}
