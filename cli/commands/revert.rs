//! `resurvey revert`.

use super::{crs_of, versions_by};
use crate::args::Revert;
use crate::conflict::refused;
use crate::console::Console;
use crate::failure::{Failure, NOTHING};
use crate::region;
use jiff::Timestamp;
use resurvey_core::store::{self, CommitError, History, MapFile};
use resurvey_core::update::refuse_doubles;
use resurvey_core::version::{Delta, PluginBuild, VersionId};
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
    };
    match (&options.by_plugin, &options.revision) {
        (Some(build), _) => all_of(&map, build, &wish, console),
        (None, Some(revision)) => {
            wish.version = map.resolve(revision)?;
            let reverted = map.together(|map| -> Result<_, CommitError> {
                let version = map.revert(&wish, Timestamp::now())?;
                refuse_doubles(map, version)?;
                Ok(version)
            });
            let version = reverted.map_err(|error| refused(error, &map, &undoing(&map, wish.version)))?;
            console.did(format_args!("version {version} was committed"));
            let document = undone(&map, wish.version, version)?;
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

/// What an undo of `version` changes, for telling why it was refused.
fn undoing(map: &MapFile, version: VersionId) -> Vec<Delta> {
    map.changes_of(version).unwrap_or_default().into_iter().map(Delta::undone).collect()
}

fn all_of(map: &MapFile, build: &PluginBuild, wish: &store::Revert, console: &mut Console<'_>) -> Result<u8, Failure> {
    let versions = versions_by(map, build)?;
    let done = map.together(|map| -> Result<_, CommitError> {
        let done = map.revert_all(&versions, wish, Timestamp::now())?;
        done.iter().try_for_each(|(_, version)| refuse_doubles(map, *version))?;
        Ok(done)
    });
    let done = done.map_err(|error| refused(error, map, &[]))?;
    done.iter().for_each(|(_, version)| console.did(format_args!("version {version} was committed")));
    let documents =
        done.iter().map(|(reverts, version)| undone(map, *reverts, *version)).collect::<Result<Vec<_>, _>>()?;
    if console.is_json() {
        console
            .document(&json!({ "plugin": build.to_string(), "versions_by_plugin": versions, "reverted": documents }))?;
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

fn undone(map: &MapFile, reverts: VersionId, version: VersionId) -> Result<Value, Failure> {
    let counts = map.version(version)?.counts;
    Ok(json!({
        "reverts": reverts.0, "version": version.0,
        "added": counts.added, "modified": counts.modified, "removed": counts.removed,
    }))
}

fn words(document: &Value) -> String {
    format!(
        "version {} undoes version {}: {} added, {} modified, {} removed",
        document["version"], document["reverts"], document["added"], document["modified"], document["removed"]
    )
}
