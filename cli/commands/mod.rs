//! One module per command.

pub mod apply;
pub mod changes;
pub mod diff;
pub mod eval;
pub mod evidence;
pub mod export;
pub mod fsck;
pub mod gc;
pub mod generate;
pub mod import;
pub mod init;
pub mod localize;
pub mod log;
pub mod plugins;
pub mod proposals;
pub mod query;
pub mod render;
pub mod replay;
pub mod revert;
mod review;
pub mod tag;
pub mod update;

use crate::console::Console;
use crate::failure::{Failure, MISSING};
use resurvey_core::crs::Crs;
use resurvey_core::store::{MapFile, StoreError};
use resurvey_core::version::{PluginBuild, VersionId};
use std::collections::BTreeSet;

/// The map's coordinate reference system.
fn crs_of(map: &MapFile) -> Result<Crs, Failure> {
    let frame = map.info()?.frame;
    frame.crs.parse().map_err(|error: resurvey_core::crs::CrsError| {
        StoreError::Damaged { path: map.path().to_owned(), detail: error.to_string() }.into()
    })
}

/// The versions, newest first, that a build took part in. One that was never seen at all is missing.
fn versions_by(map: &MapFile, build: &PluginBuild) -> Result<Vec<VersionId>, Failure> {
    let versions = map.versions_by(build)?;
    if !versions.is_empty() {
        return Ok(versions);
    }
    let mut known = BTreeSet::new();
    for used in map.observations()?.into_iter().flat_map(|recorded| recorded.observation.plugins) {
        if build.is(&used) {
            return Ok(versions);
        }
        let digits: String = used.sha256.map(|sha256| sha256.to_string()).unwrap_or_default().chars().take(8).collect();
        known.insert(format!("{}@{} ({digits})", used.name, used.version));
    }
    let known = known.into_iter().collect::<Vec<_>>().join(", ");
    let recorded = if known.is_empty() { "no plugin at all".to_owned() } else { known };
    let text = format!("no plugin {build} in the evidence of this map; recorded are {recorded}");
    Err(Failure::new(MISSING, anyhow::anyhow!(text)))
}

/// The form of an answer, where --format and --json ask for the same: `json` is what --json means alone, `geojson` is a JSON
/// document too.
fn one_format<F: Copy + PartialEq>(
    asked: Option<F>,
    [json, geojson]: [F; 2],
    default: F,
    console: &Console<'_>,
) -> Result<F, Failure> {
    match (asked, console.is_json()) {
        (Some(asked), true) if asked != json && asked != geojson => {
            Err(Failure::usage("--json is one JSON document: expected --format json or geojson beside it, or none"))
        }
        (asked, true) => Ok(asked.unwrap_or(json)),
        (asked, false) => Ok(asked.unwrap_or(default)),
    }
}

/// A CSV cell, quoted where it must be (RFC 4180).
fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn names_with_commas_and_quotes_stay_one_cell() {
        assert_eq!(quoted("tower \"A\", north"), "\"tower \"\"A\"\", north\"");
        assert_eq!(quoted("tower"), "tower");
    }
}
