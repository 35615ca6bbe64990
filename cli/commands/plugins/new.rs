//! `resurvey plugins new`: writes a project that builds and passes `plugins check`. The files are those of
//! `plugins/templates`, which compile and pass as they are, with the name put in.

use super::template::{self, Project};
use crate::args::{Language, New, NewForm, NewKind};
use crate::console::Console;
use crate::failure::{Failure, INPUT};
use crate::tools::RESERVED;
use anyhow::anyhow;
use resurvey_core::plugin::Registry;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Longest name: the symbol and the declaration hold it.
const LONGEST: usize = 40;
/// What Cargo does not take as the name of a package, or the project depends on.
const TAKEN: &[&str] = &[
    "abstract",
    "alloc",
    "as",
    "async",
    "await",
    "become",
    "box",
    "break",
    "const",
    "continue",
    "core",
    "crate",
    "do",
    "dyn",
    "else",
    "enum",
    "extern",
    "false",
    "final",
    "fn",
    "for",
    "gen",
    "if",
    "impl",
    "in",
    "let",
    "loop",
    "macro",
    "match",
    "mod",
    "move",
    "mut",
    "override",
    "priv",
    "proc-macro",
    "pub",
    "ref",
    "resurvey-plugin",
    "resurvey-schema",
    "return",
    "self",
    "serde",
    "serde-json",
    "static",
    "std",
    "struct",
    "super",
    "test",
    "trait",
    "true",
    "try",
    "type",
    "typeof",
    "unsafe",
    "unsized",
    "use",
    "virtual",
    "where",
    "while",
    "yield",
];

/// Writes the project of `options`.
pub fn run(options: &New, registry: &Registry, console: &mut Console<'_>) -> Result<u8, Failure> {
    let name = &options.name;
    is_free(name, registry)?;
    if options.form == NewForm::Search && !matches!(options.kind, NewKind::Matcher) {
        return Err(Failure::usage(format_args!(
            "--form search is for a matcher; leave it out for --kind {}",
            options.kind
        )));
    }
    let is_scorer = matches!(options.kind, NewKind::Matcher) && options.form == NewForm::Score;
    if matches!(options.lang, Language::Cpp) && !is_scorer {
        return Err(Failure::usage(
            "--lang cpp begins a matcher that scores; begin others with --lang c, whose headers are C++ as well",
        ));
    }
    let sdk = match options.lang {
        Language::Rust => Some(sdk(options.sdk.as_deref())?),
        Language::C | Language::Cpp | Language::Python => None,
    };
    let project = Project { name, kind: options.kind, form: options.form, language: options.lang, sdk };
    let directory = options.out.clone().unwrap_or_else(|| PathBuf::from(name));
    let files = template::files(&project);
    write(&directory, &files)?;
    if console.is_json() {
        let paths: Vec<_> = files.iter().map(|(path, _)| path).collect();
        console.document(&json!({
            "name": name,
            "kind": options.kind.to_string(),
            "form": matches!(options.kind, NewKind::Matcher).then(|| options.form.to_string()),
            "lang": options.lang.to_string(),
            "directory": directory.display().to_string(),
            "files": paths,
        }))?;
        return Ok(0);
    }
    let place = directory.display();
    console.line(format_args!(
        "{place} is a {} in {}: {}",
        options.kind,
        options.lang,
        template::main_file(&project)
    ))?;
    console.line("next:")?;
    console.line(format_args!("  cd {place}"))?;
    for line in template::steps(&project) {
        console.line(format_args!("  {line}"))?;
    }
    Ok(0)
}

/// A name that the host, Cargo and a C symbol can take, and no built-in plugin has.
fn is_free(name: &str, registry: &Registry) -> Result<(), Failure> {
    let is_part = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit());
    let is_word = name.starts_with(|c: char| c.is_ascii_lowercase()) && name.split('-').all(is_part);
    if !is_word || name.len() > LONGEST {
        return Err(Failure::usage(format_args!(
            "expected a name of up to {LONGEST} of a-z and 0-9, words joined by single dashes, such as facade-edges; \
             found {name:?}"
        )));
    }
    if registry.list().iter().any(|plugin| plugin.builtin && plugin.name == name) {
        return Err(Failure::usage(format_args!("a built-in plugin is called {name}; take another name")));
    }
    if RESERVED.contains(&name) {
        return Err(Failure::usage(format_args!("{name} is a name that resurvey uses itself; take another name")));
    }
    if TAKEN.contains(&name) {
        return Err(Failure::usage(format_args!(
            "{name} is a word of Rust or a package of its own; take another name"
        )));
    }
    Ok(())
}

/// The dependency on the SDK, as `Cargo.toml` says it.
fn sdk(given: Option<&str>) -> Result<String, Failure> {
    if let Some(url) = given.filter(|given| given.contains("://") || given.starts_with("git@")) {
        return Ok(format!("{{ git = {} }}", quoted(url)));
    }
    // Where this program was built; that may be long gone.
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/plugins/sdk");
    let directory = Path::new(given.unwrap_or(own));
    let found = [directory.to_owned(), directory.join("plugins/sdk")];
    let is_sdk = |directory: &&PathBuf| {
        let manifest = std::fs::read_to_string(directory.join("Cargo.toml")).unwrap_or_default();
        manifest.contains("name = \"resurvey-plugin\"")
    };
    let Some(directory) = found.iter().find(is_sdk) else {
        let tried = directory.display();
        return Err(Failure::usage(format_args!(
            "expected the Rust SDK in {tried}; give --sdk, the directory of a checkout of resurvey or the URL of its \
             repository"
        )));
    };
    let whole =
        directory.canonicalize().map_err(|error| Failure::input(format_args!("{}: {error}", directory.display())))?;
    let path =
        whole.to_str().ok_or_else(|| Failure::input(format_args!("{}: expected a path in UTF-8", whole.display())))?;
    Ok(format!("{{ path = {} }}", quoted(path)))
}

/// A TOML string: the escapes of JSON are among those of TOML.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Writes all files or none: into a directory beside `directory`, which then takes its name.
fn write(directory: &Path, files: &[(String, String)]) -> Result<(), Failure> {
    let failure = |error: std::io::Error| Failure::input(format_args!("{}: {error}", directory.display()));
    let is_empty = || std::fs::read_dir(directory).is_ok_and(|mut entries| entries.next().is_none());
    if directory.symlink_metadata().is_ok() && !is_empty() {
        return Err(Failure::new(INPUT, anyhow!("{} is there already; give another --out", directory.display())));
    }
    let parent = directory.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::create_dir_all(parent).map_err(failure)?;
    let made = tempfile::Builder::new().prefix(".new-plugin-").tempdir_in(parent).map_err(failure)?;
    // A directory of its own in the temporary one: with the permissions that the user gives new directories.
    let project = made.path().join("project");
    for (path, text) in files {
        let path = project.join(path);
        std::fs::create_dir_all(path.parent().unwrap_or(&project)).map_err(failure)?;
        std::fs::write(&path, text).map_err(failure)?;
    }
    // An empty directory is replaced; one that has been filled meanwhile is not.
    std::fs::rename(&project, directory).map_err(failure)
}
