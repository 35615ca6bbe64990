//! The plugins in the user's data directory: `plugins/SHA256/LIBRARY`, and a line for each in `allowed-plugins`.

use crate::failure::{Failure, MISSING};
use crate::tools::{CRASHED, data_directory};
use anyhow::anyhow;
use resurvey_core::plugin::{CrashLog, Digest, PluginInfo, Registry};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The list of the SHA-256 of every library that may be loaded, one a line; what follows it on the line is for people.
pub const ALLOWED: &str = "allowed-plugins";
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

    /// Puts `sha256` on the list, with `remark`, and forgets its crashes; gives whether it was not there.
    pub fn allow(&self, sha256: Digest, remark: &str) -> Result<bool, Failure> {
        self.forget_crashes(sha256)?;
        let mut lines = self.lines()?;
        if lines.iter().any(|line| digest_of(line) == Some(sha256)) {
            return Ok(false);
        }
        lines.push(format!("{sha256}  {remark}"));
        self.write(&lines).map(|()| true)
    }

    /// Takes `sha256` off the list, and its crashes out of their log; gives whether it was in either.
    pub fn forbid(&self, sha256: Digest) -> Result<bool, Failure> {
        let has_crashed = self.forget_crashes(sha256)?;
        let lines = self.lines()?;
        let kept: Vec<String> = lines.iter().filter(|line| digest_of(line) != Some(sha256)).cloned().collect();
        if kept.len() == lines.len() {
            return Ok(has_crashed);
        }
        self.write(&kept).map(|()| true)
    }

    fn forget_crashes(&self, sha256: Digest) -> Result<bool, Failure> {
        let log = self.data.join(CRASHED);
        CrashLog::new(&log).forget(sha256).map_err(|error| failure(&log, &error))
    }

    fn lines(&self) -> Result<Vec<String>, Failure> {
        match std::fs::read_to_string(self.list()) {
            Ok(text) => Ok(text.lines().map(str::to_owned).collect()),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
            Err(error) => Err(failure(&self.list(), &error)),
        }
    }

    /// The whole list at once: a reader sees the old one or the new one.
    fn write(&self, lines: &[String]) -> Result<(), Failure> {
        let list = self.list();
        let write = || -> std::io::Result<()> {
            let mut file = tempfile::Builder::new().prefix(".allowed-plugins").tempfile_in(&self.data)?;
            for line in lines {
                writeln!(file, "{line}")?;
            }
            file.as_file().sync_all()?;
            file.persist(&list)?;
            Ok(())
        };
        write().map_err(|error| failure(&list, &error))
    }
}

/// The directories of installed libraries in `plugins`.
pub fn directories(plugins: &Path) -> Vec<(Digest, PathBuf)> {
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

fn first_file(directory: &Path) -> Option<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(directory).ok()?.flatten().map(|entry| entry.path()).collect();
    files.sort();
    files.into_iter().next()
}

fn digest_of(line: &str) -> Option<Digest> {
    line.split_whitespace().next()?.parse().ok()
}
