//! The plugins in the user's data directory: `plugins/SHA256/LIBRARY`, and a line for each in `allowed-plugins`. Of several
//! builds of one name the last on the list is the one that runs; the older ones are there for `replay`.

use crate::failure::{Failure, MISSING};
use crate::tools::{CRASHED, data_directory};
use anyhow::anyhow;
use resurvey_core::plugin::{CrashLog, Digest, PluginInfo, Registry, edit_lines, read_lines};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The list of the SHA-256 of every library that may be loaded, one a line; what follows it on the line is for people.
const ALLOWED: &str = "allowed-plugins";
/// The directory of installed libraries.
const PLUGINS: &str = "plugins";

/// The user's data directory.
pub struct Installed {
    data: PathBuf,
}

/// An installed library.
pub struct Library {
    /// Its SHA-256, which is the name of its directory.
    pub sha256: Digest,
    /// Its directory.
    pub directory: PathBuf,
    /// What it says of itself; `None` where it cannot be read.
    pub info: Option<PluginInfo>,
}

impl Installed {
    /// The data directory of this user, which need not be there.
    pub fn of_this_user() -> Result<Self, Failure> {
        let none = || Failure::new(MISSING, anyhow!("no data directory: expected XDG_DATA_HOME or HOME to be set"));
        Ok(Self { data: data_directory().ok_or_else(none)? })
    }

    /// Where libraries lie.
    pub fn plugins(&self) -> PathBuf {
        self.data.join(PLUGINS)
    }

    /// The list of what may be loaded.
    pub fn list(&self) -> PathBuf {
        self.data.join(ALLOWED)
    }

    /// Every installed library, by digest.
    pub fn libraries(&self) -> Vec<Library> {
        let mut all: Vec<Library> = directories(&self.plugins())
            .into_iter()
            .map(|(sha256, directory)| {
                let library = first_file(&directory);
                Library { sha256, info: library.and_then(|path| Registry::inspect(&path).ok()), directory }
            })
            .collect();
        all.sort_by_key(|library| library.sha256.to_string());
        all
    }

    /// Puts `sha256` at the end of the list, with `name` and `version`, and forgets its crashes; gives whether it was not
    /// on it.
    pub fn allow(&self, sha256: Digest, name: &str, version: &str) -> Result<bool, Failure> {
        self.forget_crashes(sha256)?;
        self.edit(|lines| {
            let known = lines.iter().position(|line| digest_of(line) == Some(sha256));
            let line = known.map_or_else(|| format!("{sha256}  {name} {version}"), |index| lines.remove(index));
            lines.push(line);
            known.is_none()
        })
    }

    /// Takes `sha256` off the list, and its crashes out of their log; gives whether it was in either.
    pub fn forbid(&self, sha256: Digest) -> Result<bool, Failure> {
        let has_crashed = self.forget_crashes(sha256)?;
        let was_allowed = self.edit(|lines| {
            let before = lines.len();
            lines.retain(|line| digest_of(line) != Some(sha256));
            lines.len() < before
        })?;
        Ok(was_allowed || has_crashed)
    }

    fn forget_crashes(&self, sha256: Digest) -> Result<bool, Failure> {
        let log = self.data.join(CRASHED);
        CrashLog::new(&log).forget(sha256).map_err(|error| failure(&log, &error))
    }

    fn edit<T>(&self, edit: impl FnOnce(&mut Vec<String>) -> T) -> Result<T, Failure> {
        let list = self.list();
        edit_lines(&list, edit).map_err(|error| failure(&list, &error))
    }
}

/// The digests on the list in `data`, a user's data directory. A list that others may write allows nothing.
pub fn allowed_in(data: &Path) -> Result<Vec<Digest>, Failure> {
    let list = data.join(ALLOWED);
    let lines = read_lines(&list).map_err(|error| failure(&list, &error))?;
    if !lines.is_empty() {
        Registry::vet(&list).map_err(|error| Failure::from(error).about(&list))?;
    }
    Ok(lines.iter().filter_map(|line| digest_of(line)).collect())
}

/// An installed build that another one of its name came after.
pub struct Older {
    /// Its name.
    pub name: String,
    /// Its SHA-256.
    pub sha256: Digest,
    /// Its directory.
    pub directory: PathBuf,
}

/// The directories of the builds in `data` that run, and the older ones.
pub fn builds_in(data: &Path) -> (Vec<PathBuf>, Vec<Older>) {
    let mut directories = directories(&data.join(PLUGINS));
    let (mut current, mut older, mut names) = (Vec::new(), Vec::new(), HashSet::new());
    // What cannot be read is told where the list is needed.
    for line in read_lines(&data.join(ALLOWED)).unwrap_or_default().iter().rev() {
        let build = directories.iter().position(|(sha256, _)| Some(*sha256) == digest_of(line));
        let Some((sha256, directory)) = build.map(|index| directories.remove(index)) else { continue };
        match line.split_whitespace().nth(1) {
            Some(name) if !names.insert(name.to_owned()) => {
                older.push(Older { name: name.to_owned(), sha256, directory });
            }
            _ => current.push(directory),
        }
    }
    // What is not on the list is looked at too, which says why it does not run.
    current.extend(directories.into_iter().map(|(_, directory)| directory));
    (current, older)
}

/// The file of the installed build with this SHA-256.
pub fn build_of(sha256: Digest) -> Option<PathBuf> {
    first_file(&data_directory()?.join(PLUGINS).join(sha256.to_string()))
}

/// The directories of installed libraries in `plugins`.
fn directories(plugins: &Path) -> Vec<(Digest, PathBuf)> {
    let entries = std::fs::read_dir(plugins).into_iter().flatten().flatten();
    let mut found: Vec<(Digest, PathBuf)> = entries
        .filter_map(|entry| Some((entry.file_name().to_str()?.parse().ok()?, entry.path())))
        .filter(|(_, path)| path.is_dir())
        .collect();
    found.sort_by(|a, b| a.1.cmp(&b.1));
    found
}

/// A file or directory of the user that cannot be read or written.
pub fn failure(path: &Path, error: &std::io::Error) -> Failure {
    Failure::input(format!("{}: {error}", path.display()))
}

/// The bytes of a plugin file; a pipe or device may have no end.
pub fn bytes_of(path: &Path) -> Result<Vec<u8>, Failure> {
    if !std::fs::metadata(path).map_err(|error| failure(path, &error))?.is_file() {
        return Err(Failure::input(format!("{}: not a file; name a library or an executable", path.display())));
    }
    std::fs::read(path).map_err(|error| failure(path, &error))
}

/// The plugin file in the directory of a build.
pub fn first_file(directory: &Path) -> Option<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(directory).ok()?.flatten().map(|entry| entry.path()).collect();
    files.sort();
    files.into_iter().next()
}

fn digest_of(line: &str) -> Option<Digest> {
    line.split_whitespace().next()?.parse().ok()
}
