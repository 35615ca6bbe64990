//! Which plugins there are: those built in, and those found in directories. Listing runs no code of a file.

use super::crashes::CrashLog;
use super::declaration::{Declared, Fault, read_library};
use super::error::{PluginError, Refusal, Stage};
use super::executable::{is_named_executable, read_executable};
use super::info::{Digest, PluginInfo};
use super::isolation::Isolation;
use super::open::Plugin;
use super::process::Fingerprint;
use super::trust;
use resurvey_schema::abi::Declaration;
use resurvey_schema::wire::DECLARATION;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What to do about a file that cannot be read.
const UNREADABLE: &str = "check path and permissions";

/// The plugins that can be had by name.
#[derive(Debug, Default)]
pub struct Registry {
    builtins: BTreeMap<String, Plugin>,
    found: BTreeMap<String, PluginInfo>,
    skipped: Vec<SkippedFile>,
    directories: Vec<PathBuf>,
    allowed: HashSet<Digest>,
    isolation: Option<Arc<Isolation>>,
    crashes: Option<CrashLog>,
    program: Option<Digest>,
}

/// A file that will not be loaded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SkippedFile {
    /// Where it lies.
    pub path: PathBuf,
    /// Its name, where it has a declaration that this host can read.
    pub name: Option<String>,
    /// Why, and what to do.
    pub refusal: Refusal,
}

impl Registry {
    /// No plugins yet; library files load when their SHA-256 is in `allowed`.
    pub fn new(allowed: impl IntoIterator<Item = Digest>) -> Self {
        Self { allowed: allowed.into_iter().collect(), ..Self::default() }
    }

    /// Runs plugins from files in processes of their own. Without it libraries are opened in this process.
    pub fn isolate(&mut self, isolation: Isolation) {
        self.isolation = Some(Arc::new(isolation));
    }

    /// Counts crashes in `log`, and refuses files that crashed too often, however they are run.
    pub fn count_crashes(&mut self, log: CrashLog) {
        self.crashes = Some(log);
    }

    /// Makes the digest of every plugin that is added to this program depend on the program's own.
    pub fn of_program(&mut self, sha256: Digest) {
        self.program = Some(sha256);
    }

    /// Adds a plugin that is linked into this program.
    pub fn add_builtin(&mut self, declaration: &'static Declaration) -> Result<(), PluginError> {
        let plugin = Plugin::of_program(declaration, self.program)?;
        let name = plugin.info().name.clone();
        if self.builtins.contains_key(&name) {
            let reason = "another built-in plugin has this name".to_owned();
            let advice = "give one of them another name".to_owned();
            return Err(Refusal { name, path: None, stage: Stage::Entry, reason, advice }.into());
        }
        self.builtins.insert(name, plugin);
        Ok(())
    }

    /// Looks at the libraries in `directory` (not below it), by file name. The first plugin of a name counts; built-in
    /// ones come before all others, so add those first.
    pub fn add_directory(&mut self, directory: &Path) {
        self.directories.push(directory.to_owned());
        let entries = std::fs::read_dir(directory).and_then(Iterator::collect::<Result<Vec<_>, _>>);
        let mut paths: Vec<_> = match entries {
            Ok(entries) => entries.into_iter().map(|entry| entry.path()).filter(|path| is_plugin(path)).collect(),
            Err(error) => {
                let advice = "leave it out, or create it".to_owned();
                self.skip(directory, None, (Stage::File, error.to_string(), advice));
                return;
            }
        };
        paths.sort();
        for path in paths {
            self.add_file(&path);
        }
    }

    fn add_file(&mut self, path: &Path) {
        let (name, outcome) = examine(path, &self.allowed);
        let candidate = match outcome {
            Ok(candidate) => candidate,
            Err(fault) => return self.skip(path, name, fault),
        };
        let info = PluginInfo { is_apart: self.isolation.is_some(), ..candidate.info() };
        if let Err(fault) = self.check_crashes(info.sha256) {
            return self.skip(path, name, fault);
        }
        let first = match (self.builtins.contains_key(&info.name), self.found.get(&info.name)) {
            (true, _) => "built in".to_owned(),
            (false, Some(first)) => {
                first.path.as_deref().map_or_else(String::new, |path| format!("at {}", path.display()))
            }
            (false, None) => {
                self.found.insert(info.name.clone(), info);
                return;
            }
        };
        let reason = format!("a plugin called {} is already there, {first}", info.name);
        self.skip(path, None, (Stage::File, reason, "remove one of the two".to_owned()));
    }

    /// Takes the file at `path` for the plugin of its name, whatever other file was found for it.
    pub fn prefer(&mut self, path: &Path) -> Result<(), PluginError> {
        let candidate = examine(path, &self.allowed).1.map_err(|fault| refusal(path, fault))?;
        let info = PluginInfo { is_apart: self.isolation.is_some(), ..candidate.info() };
        self.check_crashes(info.sha256).map_err(|fault| refusal(path, fault))?;
        self.found.insert(info.name.clone(), info);
        Ok(())
    }

    fn check_crashes(&self, sha256: Digest) -> Result<(), Fault> {
        self.crashes.as_ref().map_or(Ok(()), |log| log.check(sha256))
    }

    fn skip(&mut self, path: &Path, name: Option<String>, fault: Fault) {
        self.skipped.push(SkippedFile { path: path.to_owned(), name, refusal: refusal(path, fault) });
    }

    /// Every plugin that can be loaded, by name.
    pub fn list(&self) -> Vec<PluginInfo> {
        let mut all: Vec<_> = self.builtins.values().map(|plugin| plugin.info().clone()).collect();
        all.extend(self.found.values().cloned());
        all.sort_by(|a, b| a.name.cmp(&b.name));
        all
    }

    /// The files that will not be loaded, in the order they were looked at.
    pub fn skipped(&self) -> &[SkippedFile] {
        &self.skipped
    }

    /// The directories that were searched, in order.
    pub fn directories(&self) -> &[PathBuf] {
        &self.directories
    }

    /// The plugin called `name`; a file is read, hashed and checked again, then opened.
    pub fn load(&self, name: &str) -> Result<Plugin, PluginError> {
        if let Some(plugin) = self.builtins.get(name) {
            return Ok(plugin.clone());
        }
        if let Some(path) = self.found.get(name).and_then(|info| info.path.as_deref()) {
            return self.load_file(path);
        }
        if let Some(skipped) = self.skipped.iter().find(|skipped| skipped.name.as_deref() == Some(name)) {
            return Err(skipped.refusal.clone().into());
        }
        let known = self.list().into_iter().map(|info| info.name).collect();
        Err(PluginError::Unknown { name: name.to_owned(), known })
    }

    /// What the file at `path` says of itself, whether or not it may be loaded; runs no code of it.
    pub fn inspect(path: &Path) -> Result<PluginInfo, PluginError> {
        let (real, bytes) = read(path).map_err(|fault| refusal(path, fault))?;
        Self::inspect_bytes(&real, &bytes).map(|(info, _)| info)
    }

    /// What `bytes`, read from `path`, say of themselves, and whether they are a program that speaks the wire.
    pub fn inspect_bytes(path: &Path, bytes: &[u8]) -> Result<(PluginInfo, bool), PluginError> {
        let declared = read_declaration(path, bytes).map_err(|fault| refusal(path, fault))?;
        let is_executable = declared.is_executable();
        let candidate = Candidate { path: path.to_owned(), sha256: Digest::of(bytes), declared };
        Ok((candidate.info(), is_executable))
    }

    /// Refuses a file or directory that others may write, or replace.
    pub fn vet(path: &Path) -> Result<(), PluginError> {
        trust::check_permissions(path).map_err(|fault| refusal(path, fault).into())
    }

    /// The plugin in the file at `path`, under the same rules.
    pub fn load_file(&self, path: &Path) -> Result<Plugin, PluginError> {
        let refused = |fault| PluginError::from(refusal(path, fault));
        let fingerprint = fingerprint(path).map_err(refused)?;
        let Candidate { path: real, sha256, declared } = examine(path, &self.allowed).1.map_err(refused)?;
        self.check_crashes(sha256).map_err(refused)?;
        match &self.isolation {
            Some(isolation) => {
                let keeping = (Arc::clone(isolation), self.crashes.clone());
                Plugin::apart((&real, fingerprint), declared, sha256, keeping)
            }
            None if declared.is_executable() => {
                let advice = "leave out --in-process".to_owned();
                Err(refused((Stage::Symbol, "an executable runs in a process of its own alone".to_owned(), advice)))
            }
            None => Plugin::open(&real, declared, sha256).map_err(refused),
        }
    }
}

/// A file that may be opened.
struct Candidate {
    path: PathBuf,
    sha256: Digest,
    declared: Declared,
}

impl Candidate {
    fn info(&self) -> PluginInfo {
        let Declared { kind, name, version, summary, .. } = self.declared.clone();
        let path = Some(self.path.clone());
        PluginInfo {
            name,
            kind,
            version,
            summary,
            sha256: self.sha256,
            path,
            builtin: false,
            is_apart: false,
            settings_schema: None,
        }
    }
}

/// Passes the gates that need no code of the file to run; also gives the name, where it can be read.
fn examine(path: &Path, allowed: &HashSet<Digest>) -> (Option<String>, Result<Candidate, Fault>) {
    let (path, bytes) = match read(path) {
        Ok(read) => read,
        Err(fault) => return (None, Err(fault)),
    };
    let (sha256, declared) = (Digest::of(&bytes), read_declaration(&path, &bytes));
    let name = declared.as_ref().ok().map(|declared| declared.name.clone());
    let outcome = trust::check_permissions(&path)
        .and_then(|()| trust::check_allowed(&path, sha256, allowed))
        .and(declared)
        .and_then(|declared| match declared.is_executable() {
            true => trust::check_executable(&path).map(|()| declared),
            false => Ok(declared),
        })
        .map(|declared| Candidate { path, sha256, declared });
    (name, outcome)
}

/// What tells that the file is still the one that is read next.
pub(super) fn fingerprint(path: &Path) -> Result<Fingerprint, Fault> {
    Fingerprint::of(path).map_err(|error| (Stage::File, error.to_string(), UNREADABLE.to_owned()))
}

/// The real path and the bytes of a file.
pub(super) fn read(path: &Path) -> Result<(PathBuf, Vec<u8>), Fault> {
    let unreadable = |error: std::io::Error| (Stage::File, error.to_string(), UNREADABLE.to_owned());
    // The system looks along its own search path for a name without a directory: open the real path alone.
    let path = path.canonicalize().map_err(unreadable)?;
    if !path.metadata().map_err(unreadable)?.is_file() {
        return Err((Stage::File, "not a file".to_owned(), "name a library".to_owned()));
    }
    let bytes = std::fs::read(&path).map_err(unreadable)?;
    Ok((path, bytes))
}

pub(super) fn refusal(path: &Path, (stage, reason, advice): Fault) -> Refusal {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Refusal { name, path: Some(path.to_owned()), stage, reason, advice }
}

fn is_library(path: &Path) -> bool {
    path.extension().is_some_and(|suffix| suffix == "so" || suffix == "dylib" || suffix == "dll")
}

fn is_plugin(path: &Path) -> bool {
    is_library(path) || is_named_executable(path)
}

/// What a file says of itself: a library by its symbol, any other file by its line.
pub(super) fn read_declaration(path: &Path, bytes: &[u8]) -> Result<Declared, Fault> {
    let line = if is_library(path) { None } else { read_executable(bytes) };
    match line {
        Some(declared) => declared,
        None if is_named_executable(path) && !is_library(path) => {
            let reason = format!("it has no line {DECLARATION:?}");
            Err((Stage::Header, reason, "look at \"Executables\" in docs/plugin-wire.md".to_owned()))
        }
        None => read_library(bytes),
    }
}
