//! `resurvey plugins remove`: takes an installed library away.

use super::installed::{Installed, Library, failure};
use crate::console::Console;
use crate::failure::{Failure, MISSING};
use anyhow::anyhow;
use resurvey_core::plugin::Digest;
use serde_json::json;

/// Removes every installed build called `which`, or the one with that SHA-256; the list first, so that what is left of a
/// removal that was broken off does not load.
pub fn run(which: &str, console: &mut Console<'_>) -> Result<u8, Failure> {
    let installed = Installed::of_this_user()?;
    let (libraries, digest) = (installed.libraries(), which.parse::<Digest>().ok());
    let is_meant = |library: &&Library| match digest {
        Some(digest) => library.sha256 == digest,
        None => library.info.as_ref().is_some_and(|info| info.name == which),
    };
    let meant: Vec<&Library> = libraries.iter().filter(is_meant).collect();
    let mut removed: Vec<Digest> = meant.iter().map(|library| library.sha256).collect();
    let mut was_there = !meant.is_empty();
    // A digest may be on the list without a library: one from a directory of the user's own.
    removed.extend(digest.filter(|_| meant.is_empty()));
    for sha256 in &removed {
        was_there |= installed.forbid(*sha256)?;
    }
    for library in &meant {
        std::fs::remove_dir_all(&library.directory).map_err(|error| failure(&library.directory, &error))?;
    }
    if !was_there {
        let names: Vec<&str> =
            libraries.iter().filter_map(|library| Some(library.info.as_ref()?.name.as_str())).collect();
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        return Err(Failure::new(MISSING, anyhow!("no installed plugin is {which:?}; installed are: {known}")));
    }
    if console.is_json() {
        let removed: Vec<String> = removed.iter().map(ToString::to_string).collect();
        console.document(&json!({ "removed": removed }))?;
    } else {
        for sha256 in &removed {
            console.line(format_args!("removed {which}, SHA-256 {sha256}"))?;
        }
    }
    Ok(0)
}
