//! A plugin whose code may run: opened once, never closed.
#![allow(unsafe_code)]

use super::crashes::CrashLog;
use super::declaration::{Declared, Fault, header_bytes, read_builtin};
use super::error::{PluginError, Refusal, Stage};
use super::info::{Digest, Kind, PluginInfo};
use super::instance::ErrorBuffer;
use super::isolation::Isolation;
use super::kinds::{Detector, Estimator, Matcher, MatcherForm};
use super::lend;
use super::process::{Fingerprint, Program};
use super::segmenter::Segmenter;
use super::settings::{Settings, SettingsSchema};
use resurvey_schema::abi::{self, ABI_MAJOR, ABI_MINOR, Declaration, Growing, HEADER_BYTES, STATUS_OK, Table};
use std::path::Path;
use std::sync::Arc;

/// A plugin that is part of the program or was opened from its file. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Plugin(Arc<Loaded>);

#[derive(Debug)]
struct Loaded {
    info: PluginInfo,
    code: Code,
    schema: SettingsSchema,
}

/// Where the functions of a plugin are.
#[derive(Clone, Debug)]
pub(super) enum Code {
    /// In this process.
    Here(Table),
    /// In processes of their own.
    Apart(Arc<Program>),
}

impl Code {
    /// Which call a matcher takes.
    pub(super) fn form(&self) -> MatcherForm {
        match self {
            Self::Here(table) if table.search.is_some() => MatcherForm::Search,
            Self::Here(_) => MatcherForm::Score,
            Self::Apart(program) => program.form(),
        }
    }
}

// SAFETY: the pointers in a table are functions and a text that live as long as the process (a library is never closed);
// the header asks of a plugin that `create` may be called from any thread, and the rest takes an instance.
unsafe impl Send for Loaded {}
// SAFETY: as above; nothing in it is ever written.
unsafe impl Sync for Loaded {}

impl Plugin {
    /// A plugin that is linked into this program, whose digest knows nothing of the code.
    pub fn builtin(declaration: &'static Declaration) -> Result<Self, PluginError> {
        Self::of_program(declaration, None)
    }

    /// A plugin that is linked into the program with this digest.
    pub(super) fn of_program(declaration: &'static Declaration, program: Option<Digest>) -> Result<Self, PluginError> {
        let refused = |name: &str, (stage, reason, advice): Fault| -> PluginError {
            Refusal { name: name.to_owned(), path: None, stage, reason, advice }.into()
        };
        let declared = read_builtin(declaration).map_err(|fault| refused("a built-in plugin", fault))?;
        let (table, schema_text, schema) =
            enter(declaration, declared.kind).map_err(|fault| refused(&declared.name, fault))?;
        let program = program.map_or_else(String::new, |sha256| sha256.to_string());
        let parts = [&declared.name, &declared.version, &declared.summary, &schema_text, &program];
        let sha256 = Digest::of(parts.map(|part| format!("{}\n{part}\n", part.len())).concat().as_bytes());
        Ok(Self::new(declared, sha256, None, Code::Here(table), schema_text, schema))
    }

    /// Opens the library at `path`, which the caller has hashed, checked and read `declared` from.
    pub(super) fn open(path: &Path, declared: Declared, sha256: Digest) -> Result<Self, Fault> {
        let declaration = open_library(path, &declared)?;
        let (table, schema_text, schema) = enter(declaration, declared.kind)?;
        Ok(Self::new(declared, sha256, Some(path), Code::Here(table), schema_text, schema))
    }

    /// Starts the file at `path`, which the caller has hashed, checked and read `declared` from, in its own process.
    pub(super) fn apart(
        (path, fingerprint): (&Path, Fingerprint),
        declared: Declared,
        sha256: Digest,
        keeping: (Arc<Isolation>, Option<CrashLog>),
    ) -> Result<Self, PluginError> {
        let (program, schema) = Program::load((path, fingerprint), declared.clone(), sha256, keeping)?;
        let text = program.settings_schema().to_owned();
        Ok(Self::new(declared, sha256, Some(path), Code::Apart(Arc::new(program)), text, schema))
    }

    fn new(
        declared: Declared,
        sha256: Digest,
        path: Option<&Path>,
        code: Code,
        schema_text: String,
        schema: SettingsSchema,
    ) -> Self {
        let info = PluginInfo {
            name: declared.name,
            kind: declared.kind,
            version: declared.version,
            summary: declared.summary,
            sha256,
            path: path.map(Path::to_owned),
            builtin: path.is_none(),
            is_apart: matches!(code, Code::Apart(_)),
            settings_schema: Some(schema_text),
        };
        Self(Arc::new(Loaded { info, code, schema }))
    }

    /// What is known of it.
    pub fn info(&self) -> &PluginInfo {
        &self.0.info
    }

    /// Its settings.
    pub fn schema(&self) -> &SettingsSchema {
        &self.0.schema
    }

    /// Its defaults, overruled by `given` (name and value as typed).
    pub fn settings<'a>(&self, given: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Settings, PluginError> {
        let wrong = |source| PluginError::Settings { plugin: self.info().name.clone(), source };
        self.schema().complete(given).map_err(wrong)
    }

    /// An instance of a matcher.
    pub fn matcher(&self, settings: &Settings) -> Result<Matcher, PluginError> {
        Matcher::create(self.of_kind(Kind::Matcher)?, settings)
    }

    /// An instance of a detector.
    pub fn detector(&self, settings: &Settings) -> Result<Detector, PluginError> {
        Detector::create(self.of_kind(Kind::Detector)?, settings)
    }

    /// An instance of an estimator.
    pub fn estimator(&self, settings: &Settings) -> Result<Estimator, PluginError> {
        Estimator::create(self.of_kind(Kind::Estimator)?, settings)
    }

    /// An instance of a segmenter.
    pub fn segmenter(&self, settings: &Settings) -> Result<Segmenter, PluginError> {
        Segmenter::create(self.of_kind(Kind::Segmenter)?, settings)
    }

    pub(super) fn code(&self) -> &Code {
        &self.0.code
    }

    fn of_kind(&self, wanted: Kind) -> Result<Self, PluginError> {
        if self.info().kind == wanted {
            return Ok(self.clone());
        }
        Err(PluginError::WrongKind { plugin: self.info().name.clone(), is: self.info().kind, wanted })
    }
}

/// Opens the file and finds its declaration. It stays open for the life of the process: closing a library that has
/// started threads or has thread-local values crashes.
pub(super) fn open_library(path: &Path, declared: &Declared) -> Result<&'static Declaration, Fault> {
    let fault = |reason: String| (Stage::Symbol, reason, "ask its author for a build for this system".to_owned());
    #[cfg(unix)]
    let library = {
        use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
        // SAFETY: opening runs the initialisers of the library; the caller has checked that the user trusts this file.
        unsafe { Library::open(Some(path), RTLD_NOW | RTLD_LOCAL) }.map(libloading::Library::from)
    };
    #[cfg(not(unix))]
    // SAFETY: as above.
    let library = unsafe { libloading::Library::new(path) };
    let library = Box::leak(Box::new(library.map_err(|error| fault(error.to_string()))?));
    // SAFETY: the header read from the file says that the symbol is a declaration of this version of the line.
    let symbol = unsafe { library.get::<*const Declaration>(declared.symbol.as_bytes()) };
    let pointer = *symbol.map_err(|error| fault(error.to_string()))?;
    if pointer.is_null() || !pointer.is_aligned() {
        return Err(fault(format!("{} is not a declaration", declared.symbol)));
    }
    let mut found = [0; HEADER_BYTES];
    // SAFETY: the symbol has at least the bytes of a header, as the file has them.
    unsafe { std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), found.as_mut_ptr(), HEADER_BYTES) };
    if found != declared.header {
        return Err(fault("its header in memory is not the one in the file: the file changed".to_owned()));
    }
    // SAFETY: the header, now checked in memory, gives a size of at least this struct; the library is never closed.
    Ok(unsafe { &*pointer })
}

/// Calls the entry and checks what it filled in.
fn enter(declaration: &'static Declaration, kind: Kind) -> Result<(Table, String, SettingsSchema), Fault> {
    let fault = |stage, reason: String| (stage, reason, "ask its author for a corrected build".to_owned());
    debug_assert_eq!(header_bytes(&declaration.header)[..8], abi::MAGIC);
    let host = abi::HostInfo {
        abi_major: ABI_MAJOR,
        abi_minor: ABI_MINOR,
        version: abi::Text::of(env!("CARGO_PKG_VERSION")),
        ..abi::HostInfo::new()
    };
    let (mut table, mut buffer) = (Table::new(), ErrorBuffer::new());
    let mut error = buffer.lend();
    // SAFETY: the declaration promises an entry of this type; all three pointers live until it returns.
    let status = unsafe { (declaration.entry)(&raw const host, &raw mut table, &raw mut error) };
    if status != STATUS_OK {
        let text = buffer.text(&error);
        return Err(fault(Stage::Entry, format!("its entry returned status {status}: {text}")));
    }
    let missing = match kind {
        _ if table.create.is_none() => Some("create"),
        _ if table.destroy.is_none() => Some("destroy"),
        Kind::Matcher if table.score.is_none() && table.search.is_none() => Some("score or search"),
        Kind::Detector if table.detect.is_none() => Some("detect"),
        Kind::Estimator if table.estimate.is_none() => Some("estimate"),
        Kind::Segmenter if table.segment.is_none() => Some("segment"),
        _ => None,
    };
    if let Some(function) = missing {
        return Err(fault(Stage::Entry, format!("a {kind} needs the function {function}, its table has none")));
    }
    // SAFETY: the header asks that the text lives as long as the library.
    let text = unsafe { lend::text(table.settings_schema) };
    let text = text.ok_or_else(|| fault(Stage::Settings, "its settings schema is not UTF-8".to_owned()))?;
    let schema = SettingsSchema::parse(text).map_err(|error| fault(Stage::Settings, error.to_string()))?;
    Ok((table, text.to_owned(), schema))
}
