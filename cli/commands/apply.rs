//! `resurvey apply`.

use crate::args::Apply;
use crate::console::Console;
use crate::document;
use crate::failure::Failure;
use jiff::Timestamp;
use resurvey_core::mesh::decode_mesh;
use resurvey_core::store::{History, Made, MapFile};
use resurvey_core::version::{Digest, UpdateTransaction, VersionKind, read_change_set};
use serde_json::json;
use std::io::Read;
use std::path::Path;

/// Applies a change set whole, or refuses it whole.
pub fn run(options: &Apply, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open(&options.map)?;
    let text = read(&options.file).map_err(|error| Failure::input(format!("{}: {error}", options.file.display())))?;
    let (key, request) = (options.retry.idempotency_key.as_deref(), Digest::of(text.as_bytes()));
    let made = match map.repeated(key, (VersionKind::Apply, Some(request)))? {
        Some(version) => Made { version, repeated: true },
        None => {
            let mut transaction = transaction(&map, &options.file, &text)?;
            transaction.idempotency_key = key.map(ToOwned::to_owned);
            transaction.request = Some(request);
            let committed = map.commit_once(&transaction, Timestamp::now());
            committed.map_err(|error| Failure::from(error).about(&options.file))?
        }
    };
    let (version, counts) = (made.version, map.version(made.version)?.counts.unwrap_or_default());
    if console.is_json() {
        let mut document = json!({
            "base_version": version.0.saturating_sub(1), "version": version.0,
            "added": counts.added, "modified": counts.modified, "removed": counts.removed,
        });
        document::say_repeated(&mut document, made.repeated);
        console.document(&document)?;
    } else {
        let (added, modified, removed) = (counts.added, counts.modified, counts.removed);
        console.line(format_args!("version {version}: {added} added, {modified} modified, {removed} removed"))?;
    }
    Ok(0)
}

/// What the change set `text` of `file` does to the newest version.
fn transaction(map: &MapFile, file: &Path, text: &str) -> Result<UpdateTransaction, Failure> {
    let (head, place) = (map.head()?, file.display());
    let changes = read_change_set(text, map.snapshot(head)?.classes())
        .map_err(|error| Failure::input(format!("{place}: {error}")))?;
    for (digest, bytes) in &changes.geometries {
        decode_mesh(bytes).map_err(|error| Failure::input(format!("{place}: geometry {digest}: {error}")))?;
    }
    Ok(changes.into_transaction(head))
}

fn read(path: &Path) -> std::io::Result<String> {
    if path == Path::new("-") {
        let mut text = String::new();
        std::io::stdin().read_to_string(&mut text)?;
        return Ok(text);
    }
    std::fs::read_to_string(path)
}
