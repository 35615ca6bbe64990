//! `resurvey gc`.

use crate::args::Gc;
use crate::console::Console;
use crate::failure::Failure;
use jiff::Timestamp;
use resurvey_core::store::{Forgetting, History, MapFile};
use resurvey_core::version::VersionId;
use serde_json::json;
use std::path::Path;

/// Removes what nobody uses, and forgets versions when asked to.
pub fn run(options: &Gc, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = if options.dry_run { MapFile::open_read_only(&options.map)? } else { MapFile::open(&options.map)? };
    let before = options.forget_before.as_deref().map(|revision| map.resolve(revision)).transpose()?;
    let size_before = size(&options.map);
    let forgetting = if options.dry_run { map.gc_plan(before)? } else { map.gc(before, Timestamp::now())? };
    if !options.dry_run && !forgetting.is_empty() {
        console.did("what nobody uses was removed");
        // What was removed stays removed; only its space is not given back.
        if let Err(error) = map.compact() {
            console.message(&format!("warning: removed, but the file could not be made smaller: {error}"));
        }
    }
    if console.is_json() {
        let numbers = |versions: &[VersionId]| versions.iter().map(|version| version.0).collect::<Vec<_>>();
        console.document(&json!({
            "dry_run": options.dry_run,
            "forgotten": numbers(&forgetting.versions),
            "kept": numbers(&forgetting.kept),
            "states": forgetting.states,
            "geometries": forgetting.geometries,
            "label_images": forgetting.label_images,
            "bytes": forgetting.bytes,
            "file_bytes_before": size_before,
            "file_bytes_after": size(&options.map),
        }))?;
        return Ok(0);
    }
    say(&forgetting, options.dry_run, console)?;
    Ok(0)
}

fn size(path: &Path) -> u64 {
    std::fs::metadata(path).map_or(0, |file| file.len())
}

fn say(forgetting: &Forgetting, is_dry: bool, console: &mut Console<'_>) -> Result<(), Failure> {
    let Forgetting { versions, kept, states, geometries, label_images, bytes } = forgetting;
    let would = if is_dry { "would be " } else { "" };
    if forgetting.is_empty() {
        return console.line(format_args!("nothing {}", if is_dry { "would be removed" } else { "to remove" }));
    }
    if !versions.is_empty() {
        console.line(format_args!("versions {would}forgotten: {}", spans(versions)))?;
        console.line(format_args!("versions kept: {}", spans(kept)))?;
    }
    console.line(format_args!(
        "{would}removed: {states} states, {geometries} geometries, {label_images} label images, {bytes} bytes"
    ))
}

/// `1-4, 6`.
fn spans(versions: &[VersionId]) -> String {
    let mut spans: Vec<(u64, u64)> = Vec::new();
    for version in versions {
        match spans.last_mut() {
            Some((_, last)) if *last + 1 == version.0 => *last = version.0,
            _ => spans.push((version.0, version.0)),
        }
    }
    let text = |(first, last): &(u64, u64)| if first == last { first.to_string() } else { format!("{first}-{last}") };
    spans.iter().map(text).collect::<Vec<_>>().join(", ")
}
