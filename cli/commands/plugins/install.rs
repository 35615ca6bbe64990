//! `resurvey plugins install`: checks a plugin file, copies it to the user's data directory and allows it.

use super::check::{Checked, check};
use super::installed::{Installed, Library, bytes_of, failure};
use crate::args::Install;
use crate::console::Console;
use crate::document;
use crate::failure::{Failure, PLUGIN};
use crate::tools::RESERVED;
use anyhow::anyhow;
use resurvey_core::plugin::{Digest, PluginError, PluginInfo, Registry};
use resurvey_schema::wire::EXECUTABLE_PREFIX;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Installs a file. What is checked, hashed and kept is one copy, so that nobody can change it in between.
pub fn run(options: &Install, registry: &Registry, console: &mut Console<'_>) -> Result<u8, Failure> {
    let file = &options.file;
    let bytes = bytes_of(file)?;
    // Its own permissions and header first: their messages name the file that the user knows.
    Registry::vet(file)?;
    let (info, is_executable) = Registry::inspect_bytes(file, &bytes)?;
    if let Some(builtin) = registry.list().iter().find(|other| other.builtin && other.name == info.name) {
        let name = &builtin.name;
        return Err(refused(&format!(
            "{}: a built-in plugin is called {name}; build it under another name",
            file.display()
        )));
    }
    if RESERVED.contains(&info.name.as_str()) {
        let (file, name) = (file.display(), &info.name);
        return Err(refused(&format!(
            "{file}: {name} is a name that resurvey uses itself; build it under another name"
        )));
    }
    let installed = Installed::of_this_user()?;
    let sha256 = Digest::of(&bytes);
    let home = installed.plugins().join(sha256.to_string());
    let name = if is_executable { format!("{EXECUTABLE_PREFIX}{}", info.name) } else { library_name(&info.name) };
    let copy = Copy::new(&installed.plugins(), &name, &bytes, is_executable)?;
    let checked = if options.no_check { None } else { Some(check(&copy.file, options.limits, console)?) };
    if let Some(checked) = checked.as_ref().filter(|checked| checked.failed() > 0) {
        return not_installed(file, checked, console);
    }
    let was_there = home.is_dir();
    copy.keep(&home)?;
    let is_new = installed.allow(sha256, &info.name, &info.version)? || !was_there;
    let older = others(&installed, &info.name, sha256);
    let info = PluginInfo { path: Some(home.join(name)), sha256, ..info };
    say(&info, is_new, &older, checked.as_ref(), console)?;
    Ok(0)
}

fn refused(text: &str) -> Failure {
    Failure::new(PLUGIN, anyhow!("{text}"))
}

fn not_installed(file: &Path, checked: &Checked, console: &mut Console<'_>) -> Result<u8, Failure> {
    if console.is_json() {
        console.document(&json!({ "installed": false, "check": checked.document() }))?;
    } else {
        checked.print(console)?;
    }
    let failed = checked.failed();
    Err(refused(&format!(
        "{} is not installed: {failed} tests failed; --no-check installs it all the same",
        file.display()
    )))
}

/// Other builds of the same name, which do not run any more and stay for `replay`.
fn others(installed: &Installed, name: &str, newest: Digest) -> Vec<Library> {
    let is_other =
        |library: &Library| library.sha256 != newest && library.info.as_ref().is_some_and(|info| info.name == name);
    installed.libraries().into_iter().filter(is_other).collect()
}

fn say(
    info: &PluginInfo,
    is_new: bool,
    older: &[Library],
    checked: Option<&Checked>,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    if console.is_json() {
        let mut document = document::plugin_info(info);
        document["installed"] = json!(true);
        document["was_installed"] = json!(!is_new);
        document["replaced"] = older.iter().map(|other| json!(other.sha256.to_string())).collect();
        document["check"] = checked.map_or(Value::Null, Checked::document);
        return console.document(&document);
    }
    let path = info.path.as_deref().map(Path::display);
    let what = if is_new { "installed" } else { "already installed" };
    console.line(format_args!("{what} {} {} ({})", info.name, info.version, info.kind))?;
    if let Some(path) = path {
        console.line(format_args!("  {path}"))?;
    }
    for other in older {
        console.line(format_args!("  replaces {}, which stays for replay", other.sha256))?;
    }
    let tests = if checked.is_some() { "it passed every test" } else { "it was not checked" };
    let which = if older.is_empty() { info.name.clone() } else { info.sha256.to_string() };
    console.line(format_args!("  {tests}; \"resurvey plugins remove {which}\" takes it away"))
}

/// A copy of a plugin file beside its place, gone unless it is kept.
struct Copy {
    directory: tempfile::TempDir,
    file: PathBuf,
}

impl Copy {
    fn new(plugins: &Path, name: &str, bytes: &[u8], is_executable: bool) -> Result<Self, Failure> {
        let make = || -> std::io::Result<Self> {
            std::fs::create_dir_all(plugins)?;
            let directory = tempfile::Builder::new().prefix(".new-").tempdir_in(plugins)?;
            let file = directory.path().join(name);
            std::fs::write(&file, bytes)?;
            owned(directory.path(), 0o755)?;
            owned(&file, if is_executable { 0o755 } else { 0o644 })?;
            std::fs::File::open(&file)?.sync_all()?;
            Ok(Self { directory, file })
        };
        let copy = make().map_err(|error| failure(plugins, &error))?;
        // Who may write the directories above may put another file in its place.
        for above in [plugins, plugins.parent().unwrap_or(plugins)] {
            Registry::vet(above).map_err(|error: PluginError| Failure::from(error).about(above))?;
        }
        Ok(copy)
    }

    /// Makes it `home` in one step; where that is there already, the same bytes are.
    fn keep(self, home: &Path) -> Result<(), Failure> {
        if home.is_dir() {
            return Ok(());
        }
        std::fs::rename(self.directory.path(), home).map_err(|error| failure(home, &error))?;
        // The directory has gone to its place: there is nothing left to remove.
        let _ = self.directory.keep();
        Ok(())
    }
}

/// `libname.so`, as this system calls libraries.
fn library_name(name: &str) -> String {
    format!("{}{}{}", std::env::consts::DLL_PREFIX, name.replace('-', "_"), std::env::consts::DLL_SUFFIX)
}

#[cfg(unix)]
fn owned(path: &Path, mode: u32) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn owned(_: &Path, _: u32) -> std::io::Result<()> {
    Ok(())
}
