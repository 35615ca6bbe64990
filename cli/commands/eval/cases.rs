//! Captures with truth, and where the maps of their scenes are.

use crate::args::Eval;
use crate::failure::Failure;
use resurvey_core::evaluate::Truth;
use std::path::{Path, PathBuf};

const TRUTH: &str = "truth.json";
const CAPTURE: &str = "capture.json";
/// The directory of another photo within that of the first.
const SECOND: &str = "second";

/// Another photo of the same changed place.
#[derive(Clone)]
pub struct Second {
    /// The capture.
    pub capture: PathBuf,
    /// What really was.
    pub truth: Truth,
}

/// A directory with `capture.json` and `truth.json`.
#[derive(Clone)]
pub struct Case {
    /// The directory.
    pub directory: PathBuf,
    /// The name of the directory.
    pub name: String,
    /// What really was.
    pub truth: Truth,
    /// The directory of its scene's model.
    pub scene: PathBuf,
    /// The photo in `second`, where there is one.
    pub second: Option<Second>,
}

impl Case {
    /// The capture.
    pub fn capture(&self) -> PathBuf {
        self.directory.join(CAPTURE)
    }

    /// The descriptors that the map had before, where it had any.
    pub fn base_changes(&self) -> Option<PathBuf> {
        Some(self.directory.join("base.changes.jsonl")).filter(|path| path.exists())
    }
}

/// Every capture that `options` speak of, each with its truth and map found; by name within each of CASES.
pub fn find(options: &Eval) -> Result<Vec<Case>, Failure> {
    let mut cases = Vec::new();
    for given in &options.cases {
        let (directories, maps) = directories(given)?;
        let maps: Vec<PathBuf> = options.maps.iter().cloned().chain(maps).collect();
        for directory in directories {
            let name = name_of(&directory);
            if options.only.as_ref().is_none_or(|prefix| name.starts_with(prefix.as_str())) {
                cases.push((directory, name, maps.clone()));
            }
        }
    }
    if cases.is_empty() {
        let prefix = options.only.as_deref().unwrap_or_default();
        return Err(Failure::input(format!("expected captures whose directory begins with {prefix:?}, found none")));
    }
    let limit = options.limit.map_or(usize::MAX, |limit| usize::try_from(limit).unwrap_or(usize::MAX));
    cases.truncate(limit);
    cases.into_iter().map(|(directory, name, maps)| read(directory, name, &maps)).collect()
}

fn read(directory: PathBuf, name: String, maps: &[PathBuf]) -> Result<Case, Failure> {
    let path = directory.join(TRUTH);
    let truth = Truth::read(&path)?;
    let scene = maps.iter().map(|maps| maps.join(&truth.scene)).find(|scene| scene.is_dir()).ok_or_else(|| {
        let searched: Vec<String> = maps.iter().map(|maps| maps.display().to_string()).collect();
        let (scene, searched) = (&truth.scene, searched.join(", "));
        Failure::input(format!(
            "{}: scene {scene:?}: expected a directory {scene} in one of {searched}; name the directory of maps with --maps",
            path.display()
        ))
    })?;
    let second = Some(directory.join(SECOND)).filter(|second| second.is_dir());
    let second = second.map(|second| {
        Ok::<_, Failure>(Second { capture: second.join(CAPTURE), truth: Truth::read(&second.join(TRUTH))? })
    });
    Ok(Case { second: second.transpose()?, directory, name, truth, scene })
}

/// The directories of captures that `given` is or holds, by name, and where their maps may be.
fn directories(given: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), Failure> {
    let wrong = |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", given.display()));
    let given_in_full = given.canonicalize().map_err(|error| wrong(&error))?;
    let beside = given_in_full.parent().map(|parent| parent.join("maps"));
    let maps = std::iter::once(given_in_full.join("maps")).chain(beside).collect();
    if given_in_full.join(TRUTH).exists() {
        return Ok((vec![given_in_full], maps));
    }
    let entries = std::fs::read_dir(&given_in_full).map_err(|error| wrong(&error))?;
    let paths = entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>();
    let mut found: Vec<PathBuf> = paths.map_err(|error| wrong(&error))?;
    found.retain(|path| path.join(TRUTH).exists());
    found.sort();
    if found.is_empty() {
        return Err(wrong(&format!("expected {TRUTH}, or directories with one, found none")));
    }
    Ok((found, maps))
}

fn name_of(directory: &Path) -> String {
    directory.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
