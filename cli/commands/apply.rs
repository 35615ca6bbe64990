//! `resurvey apply`.

use crate::args::Apply;
use crate::console::Console;
use crate::failure::Failure;
use jiff::Timestamp;
use resurvey_core::mesh::decode_mesh;
use resurvey_core::store::{History, MapFile};
use resurvey_core::version::read_change_set;
use serde_json::json;
use std::io::Read;
use std::path::Path;

/// Applies a change set whole, or refuses it whole.
pub fn run(options: &Apply, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open(&options.map)?;
    let head = map.head()?;
    let place = options.file.display();
    let text = read(&options.file).map_err(|error| Failure::input(format!("{place}: {error}")))?;
    let changes = read_change_set(&text, map.snapshot(head)?.classes())
        .map_err(|error| Failure::input(format!("{place}: {error}")))?;
    for (digest, bytes) in &changes.geometries {
        decode_mesh(bytes).map_err(|error| Failure::input(format!("{place}: geometry {digest}: {error}")))?;
    }
    let mut transaction = changes.into_transaction(head);
    transaction.idempotency_key.clone_from(&options.retry.idempotency_key);
    let committed = map.commit(&transaction, Timestamp::now());
    let version = committed.map_err(|error| Failure::from(error).about(&options.file))?;
    console.did(format_args!("version {version} was committed"));
    let record = map.version(version)?;
    let counts = record.counts;
    if console.is_json() {
        console.document(&json!({
            "base_version": record.base.map(|base| base.0), "version": version.0,
            "added": counts.added, "modified": counts.modified, "removed": counts.removed,
        }))?;
    } else {
        let (added, modified, removed) = (counts.added, counts.modified, counts.removed);
        console.line(format_args!("version {version}: {added} added, {modified} modified, {removed} removed"))?;
    }
    Ok(0)
}

fn read(path: &Path) -> std::io::Result<String> {
    if path == Path::new("-") {
        let mut text = String::new();
        std::io::stdin().read_to_string(&mut text)?;
        return Ok(text);
    }
    std::fs::read_to_string(path)
}
