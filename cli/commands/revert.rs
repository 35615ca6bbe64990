//! `resurvey revert`.

use super::{crs_of, versions_by};
use crate::args::Revert;
use crate::conflict::refused;
use crate::console::Console;
use crate::document;
use crate::failure::{Failure, NOTHING};
use crate::region;
use crate::request::Request;
use jiff::Timestamp;
use resurvey_core::store::{self, CommitError, History, Made, MapFile, StoreError};
use resurvey_core::update::refuse_doubles;
use resurvey_core::version::{Delta, Digest, PluginBuild, Revision, VersionId, VersionKind};
use serde_json::{Value, json};

/// Undoes one version by a new one, or all that a plugin build did by one for each.
pub fn run(options: &Revert, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open(&options.map)?;
    let mut wish = store::Revert {
        version: VersionId(0),
        region: region::bbox(&options.region, crs_of(&map)?)?,
        author: options.author.clone(),
        message: options.message.clone(),
        idempotency_key: options.retry.idempotency_key.clone(),
        request: Some(request(options)?),
    };
    match (&options.by_plugin, &options.revision) {
        (Some(build), _) => all_of(&map, build, &wish, console),
        (None, Some(revision)) => {
            let made = match map.repeated(wish.idempotency_key.as_deref(), (VersionKind::Revert, wish.request))? {
                // Of a retry the revision may be another by now, or forgotten.
                Some(version) => Made { version, repeated: true },
                None => {
                    wish.version = map.resolve(revision)?;
                    let reverted = map.together(|map| -> Result<_, CommitError> {
                        let made = map.revert_once(&wish, Timestamp::now())?;
                        if !made.repeated {
                            refuse_doubles(map, made.version)?;
                        }
                        Ok(made)
                    });
                    reverted.map_err(|error| refused(error, &map, &undoing(&map, wish.version)))?
                }
            };
            console.did(format_args!("version {} was committed", made.version));
            let mut document = undone(&map, made.version)?;
            document::say_repeated(&mut document, made.repeated);
            if console.is_json() {
                console.document(&document)?;
            } else {
                console.line(words(&document))?;
            }
            Ok(0)
        }
        (None, None) => Err(Failure::usage("expected a version or --by-plugin BUILD")),
    }
}

/// What is to be undone, as it is called, and where.
fn request(options: &Revert) -> Result<Digest, Failure> {
    let revision = options.revision.as_deref().map(|text| {
        Ok::<_, StoreError>(match Revision::parse(text)? {
            Revision::Number(version) => version.to_string(),
            _ => text.to_owned(),
        })
    });
    let request = Request::of("revert").with("revision", revision.transpose()?);
    Ok(request.with("by-plugin", options.by_plugin.as_ref()).with_region(&options.region).digest())
}

/// What an undo of `version` changes, for telling why it was refused.
fn undoing(map: &MapFile, version: VersionId) -> Vec<Delta> {
    map.changes_of(version).unwrap_or_default().into_iter().map(Delta::undone).collect()
}

fn all_of(map: &MapFile, build: &PluginBuild, wish: &store::Revert, console: &mut Console<'_>) -> Result<u8, Failure> {
    let mut versions = versions_by(map, build)?;
    let done = map.together(|map| -> Result<_, CommitError> {
        let done = map.revert_all(&versions, wish, Timestamp::now())?;
        if !done.repeated {
            done.undone.iter().try_for_each(|(_, version)| refuse_doubles(map, *version))?;
        }
        Ok(done)
    });
    let done = done.map_err(|error| refused(error, map, &[]))?;
    done.undone.iter().for_each(|(_, version)| console.did(format_args!("version {version} was committed")));
    if let Some((_, first)) = done.undone.first() {
        // What the build did since the first time is not what this undid.
        versions.retain(|version| version < first);
    }
    let documents = done.undone.iter().map(|(_, version)| undone(map, *version)).collect::<Result<Vec<_>, _>>()?;
    if console.is_json() {
        let mut document =
            json!({ "plugin": build.to_string(), "versions_by_plugin": versions, "reverted": documents });
        document::say_repeated(&mut document, done.repeated);
        console.document(&document)?;
    } else {
        for document in &documents {
            console.line(words(document))?;
        }
        if documents.is_empty() {
            console.line(format_args!("{} versions by {build}, nothing of them shows", versions.len()))?;
        }
    }
    Ok(if documents.is_empty() { NOTHING } else { 0 })
}

/// What `version` undid.
fn undone(map: &MapFile, version: VersionId) -> Result<Value, Failure> {
    let record = map.version(version)?;
    let counts = record.counts.unwrap_or_default();
    Ok(json!({
        "reverts": record.reverts.map(|reverts| reverts.0), "version": version.0,
        "added": counts.added, "modified": counts.modified, "removed": counts.removed,
    }))
}

fn words(document: &Value) -> String {
    format!(
        "version {} undoes version {}: {} added, {} modified, {} removed",
        document["version"], document["reverts"], document["added"], document["modified"], document["removed"]
    )
}
