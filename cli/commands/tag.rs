//! `resurvey tag`.

use crate::args::Tag;
use crate::console::Console;
use crate::failure::Failure;
use jiff::Timestamp;
use resurvey_core::store::{History, MapFile};
use serde_json::json;

/// Names a version, takes a name away, or lists the names.
pub fn run(options: &Tag, console: &mut Console<'_>) -> Result<u8, Failure> {
    let Some(name) = &options.name else { return list(&MapFile::open_read_only(&options.map)?, console) };
    let map = MapFile::open(&options.map)?;
    let (version, verb) = if options.delete {
        (map.untag(name)?, "no longer names")
    } else {
        let version = map.resolve(&options.revision)?;
        map.tag(name, version, Timestamp::now())?;
        (version, "names")
    };
    console.did(format_args!("{name} {verb} version {version}"));
    if console.is_json() {
        console.document(&json!({ "tag": name, "version": version.0, "deleted": options.delete }))?;
    } else {
        console.line(format_args!("{name} {verb} version {version}"))?;
    }
    Ok(0)
}

fn list(map: &MapFile, console: &mut Console<'_>) -> Result<u8, Failure> {
    let tags = map.tags()?;
    if console.is_json() {
        let tags: Vec<_> = tags.iter().map(|(name, version)| json!({ "tag": name, "version": version.0 })).collect();
        console.document(&json!({ "tags": tags }))?;
        return Ok(0);
    }
    for (name, version) in &tags {
        console.line(format_args!("{name} {version}"))?;
    }
    Ok(0)
}
