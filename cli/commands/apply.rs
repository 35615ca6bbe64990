//! `resurvey apply`.

use crate::args::Apply;
use crate::conflict::refused;
use crate::console::Console;
use crate::document;
use crate::failure::{Failure, NOTHING};
use jiff::Timestamp;
use resurvey_core::mesh::{Mesh, Surface, decode_mesh};
use resurvey_core::store::{History, Made, MapFile, StoreError};
use resurvey_core::version::{ChangeSet, Digest, UpdateTransaction, VersionId, VersionKind, read_change_set};
use resurvey_schema::{ClassId, ClassTable};
use serde_json::json;
use std::collections::BTreeSet;
use std::fmt::Display;
use std::io::Read;
use std::path::Path;

/// Who commits a change set that does not say.
const AUTHOR: &str = "resurvey";

/// Applies a change set whole, or refuses it whole.
pub fn run(options: &Apply, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open(&options.map)?;
    let file = if options.file == Path::new("-") { Path::new("standard input") } else { &options.file };
    let about = |failure: Failure| failure.about(file);
    let text = read(&options.file).map_err(about)?;
    let (key, request) = (options.retry.idempotency_key.as_deref(), Digest::of(text.as_bytes()));
    let made = match map.repeated(key, (VersionKind::Apply, Some(request)))? {
        Some(version) => Made { version, repeated: true },
        None => {
            let mut transaction = transaction(&map, file, &text, console).map_err(about)?;
            transaction.idempotency_key = key.map(ToOwned::to_owned);
            transaction.request = Some(request);
            let committed = map.commit_once(&transaction, Timestamp::now());
            committed.map_err(|error| about(refused(error, &map, &transaction.deltas)))?
        }
    };
    let version = made.version;
    console.did(format_args!("version {version} was committed"));
    let record = map.version(version)?;
    let counts = record.counts.unwrap_or_default();
    if console.is_json() {
        let mut document = json!({
            "base_version": record.base.map(|base| base.0), "version": version.0,
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

/// What the change set `text` of `file` does to `map`.
fn transaction(
    map: &MapFile,
    file: &Path,
    text: &str,
    console: &mut Console<'_>,
) -> Result<UpdateTransaction, Failure> {
    let head = map.head()?;
    let classes = map.classes(head)?;
    let mut changes = read_change_set(text, &classes)?;
    check_geometries(&changes, &classes)?;
    if is_of_another_history(map, head, &changes)? {
        let (file, base) = (file.display(), changes.base.take().unwrap_or(head));
        let whose = changes.map_id.as_deref().map_or_else(String::new, |map_id| format!(" (made from map {map_id})"));
        console.message(&format!(
            "note: version {base} of {file}{whose} is not one of this map: every \"before\" is checked, and nothing else that \
             changed here"
        ));
    }
    changes.author.get_or_insert_with(|| AUTHOR.to_owned());
    let transaction = changes.into_transaction(head);
    if transaction.is_empty() {
        return Err(of_nothing(transaction.base));
    }
    Ok(transaction)
}

/// A set without an operation: not wrong, and nothing to do.
fn of_nothing(base: VersionId) -> Failure {
    let text =
        "the change set changes nothing, so nothing was committed; expected at least one operation after the header";
    Failure::new(NOTHING, anyhow::anyhow!(text)).with_document(json!({
        "decision": "nothing", "base_version": base.0, "version": null, "added": 0, "modified": 0, "removed": 0,
    }))
}

/// Whether the set says which version it was made against, and this map has another one under that number, or none.
fn is_of_another_history(map: &MapFile, head: VersionId, changes: &ChangeSet) -> Result<bool, Failure> {
    match (changes.base, changes.base_hash) {
        (Some(base), Some(hash)) if base <= head => Ok(map.version(base)?.hash != hash),
        (Some(_), Some(_)) => Ok(true),
        (Some(base), None) if base > head => {
            let error = Failure::from(StoreError::NoSuchVersion { version: base, head });
            Err(Failure::new(error.code(), anyhow::anyhow!("base_version: {error}; null applies to any version")))
        }
        _ => Ok(false),
    }
}

/// Refuses geometry that is none, or whose class indices mean other classes here than where the set was made.
fn check_geometries(changes: &ChangeSet, classes: &ClassTable) -> Result<(), Failure> {
    for (digest, bytes) in &changes.geometries {
        let wrong = |text: &dyn Display| Failure::input(format!("geometry {digest}: {text}"));
        let mesh = decode_mesh(bytes).map_err(|error| wrong(&error))?;
        for index in classes_of(&mesh) {
            let here = classes.get(index).map(|class| class.name.as_str());
            let there = changes.classes.get(&index).map(String::as_str);
            if here.is_none() || there.is_some_and(|there| here != Some(there)) {
                let whose = there.map_or_else(String::new, |there| format!(", {there:?} where the set was made,"));
                let here = here.map_or_else(|| "not in this map".to_owned(), |here| format!("{here:?} in this map"));
                let expected = "expected a map with the same class table";
                return Err(wrong(&format!("class {}{whose} is {here}; {expected}", index.0)));
            }
        }
    }
    Ok(())
}

/// Every class in `mesh`.
fn classes_of(mesh: &Mesh) -> BTreeSet<ClassId> {
    let mut classes = BTreeSet::new();
    for surface in &mesh.surfaces {
        match surface {
            Surface::Class(class) => classes.extend([*class]),
            Surface::Texture(texture) => classes.extend(texture.labels.values().iter().map(|value| ClassId(*value))),
        }
    }
    classes.remove(&ClassId::VOID);
    classes
}

fn read(path: &Path) -> Result<String, Failure> {
    let bytes = if path == Path::new("-") {
        let mut bytes = Vec::new();
        std::io::stdin().read_to_end(&mut bytes).map(|_| bytes)
    } else {
        std::fs::read(path)
    };
    let text = String::from_utf8(bytes.map_err(Failure::input)?)
        .map_err(|_| Failure::input("expected a change set as JSON lines in UTF-8, found bytes that are no text"))?;
    // Some editors begin a text with a mark of its byte order.
    Ok(if let Some(rest) = text.strip_prefix('\u{feff}') { rest.to_owned() } else { text })
}
