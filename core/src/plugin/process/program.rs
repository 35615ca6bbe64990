//! A plugin file that runs in processes: started when needed, kept while idle, counted when it crashes.

use super::child::Child;
use super::fingerprint::Fingerprint;
use super::lending::Lending;
use super::link::{About, Link, Turn};
use super::wire::Wire;
use crate::plugin::crashes::CrashLog;
use crate::plugin::declaration::{Declared, Fault};
use crate::plugin::error::{PluginError, Refusal, Stage};
use crate::plugin::info::Digest;
use crate::plugin::isolation::Isolation;
use crate::plugin::kinds::MatcherForm;
use crate::plugin::settings::SettingsSchema;
use resurvey_schema::wire::{Hello, ToHost, WIRE_VERSION};
use rustix::process::{Resource, getrlimit};
use std::ffi::{OsStr, OsString};
use std::io;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Processes that wait for the next instance.
const MOST_IDLE: usize = 4;

/// What starts processes of one plugin file.
#[derive(Debug)]
pub(in super::super) struct Program {
    isolation: Arc<Isolation>,
    crashes: Option<CrashLog>,
    path: PathBuf,
    /// Of the file when it was hashed.
    fingerprint: Fingerprint,
    sha256: Digest,
    declared: Declared,
    hello: Hello,
    idle: Mutex<Vec<Link>>,
}

impl Program {
    /// Starts the plugin once to hear what it says of itself. The fingerprint was taken before the file was read.
    pub(in super::super) fn load(
        (path, fingerprint): (&Path, Fingerprint),
        declared: Declared,
        sha256: Digest,
        (isolation, crashes): (Arc<Isolation>, Option<CrashLog>),
    ) -> Result<(Self, SettingsSchema), PluginError> {
        let hello = Hello {
            wire: WIRE_VERSION,
            name: declared.name.clone(),
            version: declared.version.clone(),
            kind: declared.kind.to_string(),
            summary: declared.summary.clone(),
            form: None,
            settings_schema: String::new(),
        };
        let idle = Mutex::default();
        let path = path.to_owned();
        let mut program = Self { isolation, crashes, path, fingerprint, sha256, declared, hello, idle };
        let (link, hello) = program.start()?;
        program.check_hello(&hello).map_err(|fault| program.refused(fault))?;
        let schema = SettingsSchema::parse(&hello.settings_schema)
            .map_err(|error| program.refused((Stage::Settings, error.to_string(), corrected())))?;
        program.hello = hello;
        program.put_back(link);
        Ok((program, schema))
    }

    /// Text of the settings schema.
    pub(in super::super) fn settings_schema(&self) -> &str {
        &self.hello.settings_schema
    }

    /// Which call a matcher takes.
    pub(in super::super) fn form(&self) -> MatcherForm {
        if self.hello.form.as_deref() == Some("search") { MatcherForm::Search } else { MatcherForm::Score }
    }

    /// A process without an instance.
    pub(super) fn take(&self) -> Result<Link, PluginError> {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        if let Some(link) = idle {
            return Ok(link);
        }
        let (link, hello) = self.start()?;
        if hello == self.hello {
            return Ok(link);
        }
        let reason = "it does not say the same of itself every time it starts".to_owned();
        Err(self.refused((Stage::Entry, reason, corrected())))
    }

    /// Keeps a process whose instance has ended.
    pub(super) fn put_back(&self, link: Link) {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        if idle.len() < MOST_IDLE {
            idle.push(link);
        }
    }

    /// Counts a crash in a call; other errors are not counted, nor those that too little memory may have made.
    pub(super) fn count(&self, error: &PluginError) {
        let (PluginError::Crashed { call, .. } | PluginError::Garbled { call, .. }) = error else { return };
        if let Some(log) = self.crashes.as_ref().filter(|_| has_room(&self.isolation)) {
            // Without the file the plugin is only trusted for longer; the crash itself is told.
            let _ = log.record(self.sha256, &self.declared.name, call);
        }
    }

    fn start(&self) -> Result<(Link, Hello), PluginError> {
        self.refuse_quarantined()?;
        let mut link = self.open().map_err(|error| {
            let next = "free memory and processes, or raise their limits";
            let text = format!("its process could not be started: {error}; {next}");
            PluginError::InvalidInput { plugin: self.declared.name.clone(), text }
        })?;
        let mut turn = Turn::steady("load");
        let heard = link.next(&mut turn).and_then(|message| match message {
            ToHost::Hello(hello) => Ok(hello),
            ToHost::Refused(refused) => {
                let stage = Stage::named(&refused.stage).unwrap_or(Stage::Entry);
                Err(self.refused((stage, refused.reason, refused.advice)))
            }
            other => Err(link.out_of_turn("load", &other)),
        });
        // An end before the first word is not counted: the reason may be an interpreter or a library that is missing.
        heard.map(|hello| (link, hello))
    }

    fn open(&self) -> io::Result<Link> {
        let (ours, theirs) = UnixStream::pair()?;
        let lending = Lending::new(self.isolation.forgets)?;
        let mode = if self.declared.is_executable() { "executable" } else { "library" };
        let (memory, parent) = (self.isolation.memory_mib.to_string(), std::process::id().to_string());
        let words = [mode, &memory, &parent, self.fingerprint.as_str()].map(OsString::from);
        let mut arguments: Vec<&OsStr> = words.iter().map(OsString::as_os_str).collect();
        arguments.push(self.path.as_os_str());
        let child = Child::start(&self.isolation, &arguments, theirs, &lending.memory)?;
        let about = About { plugin: self.declared.name.clone(), call_limit: self.isolation.call_limit };
        Ok(Link::new(child, Wire::impatient(ours)?, lending, about))
    }

    fn refuse_quarantined(&self) -> Result<(), PluginError> {
        let Some(log) = &self.crashes else { return Ok(()) };
        log.check(self.sha256).map_err(|fault| self.refused(fault))
    }

    fn check_hello(&self, hello: &Hello) -> Result<(), Fault> {
        if hello.wire != WIRE_VERSION {
            let reason = format!("plugin speaks wire {}, this host speaks {WIRE_VERSION}", hello.wire);
            return Err((Stage::Abi, reason, "upgrade resurvey, or install a build for this wire".to_owned()));
        }
        let said = [&hello.name, &hello.version, &hello.kind, &hello.summary];
        let declared = [&self.hello.name, &self.hello.version, &self.hello.kind, &self.hello.summary];
        let words = ["name", "version", "kind", "summary"];
        if let Some((index, word)) = words.iter().enumerate().find(|(index, _)| said[*index] != declared[*index]) {
            let reason = format!("its hello says {word} {:?}, its declaration {:?}", said[index], declared[index]);
            return Err((Stage::Entry, reason, corrected()));
        }
        let forms = [Some("score"), Some("search")];
        if hello.kind == "matcher" && !forms.contains(&hello.form.as_deref()) {
            let reason = format!("a matcher needs the form \"score\" or \"search\", its hello says {:?}", hello.form);
            return Err((Stage::Entry, reason, corrected()));
        }
        Ok(())
    }

    fn refused(&self, (stage, reason, advice): Fault) -> PluginError {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str()).to_string_lossy().into_owned();
        Refusal { name, path: Some(self.path.clone()), stage, reason, advice }.into()
    }
}

/// Whether plugins have at least the memory that they have unless somebody says otherwise.
fn has_room(isolation: &Isolation) -> bool {
    let mib = |bytes: u64| bytes >> 20;
    let least = Isolation::DEFAULT_MEMORY_MIB;
    let of_system = getrlimit(Resource::As).maximum.map_or(u64::MAX, mib);
    of_system >= least && (isolation.memory_mib == 0 || isolation.memory_mib >= least)
}

fn corrected() -> String {
    "ask its author for a corrected build".to_owned()
}
