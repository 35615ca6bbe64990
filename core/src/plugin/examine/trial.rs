//! The trials by name, in the order in which they are made.

use super::super::error::PluginError;
use super::super::isolation::Isolation;
use super::super::registry::{self, Registry};
use super::super::trust;
use super::exports::only_the_declaration;
use super::finding::Finding;
use super::report::Report;
use super::stage::Stage;
use super::tries::{self, Bench, Tried};
use super::{limits, sense};
use std::path::Path;
use std::sync::Arc;

const BYTES_PER_MIB: u64 = 1 << 20;

/// A promise of the plugin line that is put to the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
#[allow(missing_docs, reason = "`promise` says what each is")]
pub enum Trial {
    Header,
    Permissions,
    Exports,
    Loads,
    Settings,
    Answers,
    SmallImages,
    Rows,
    Nothing,
    Inputs,
    Outputs,
    Repeats,
    Cancel,
    Threads,
    OlderHost,
    NewerHost,
    Manners,
    Sense,
}

impl Trial {
    /// All of them, in order.
    pub const ALL: [Self; 18] = [
        Self::Header,
        Self::Permissions,
        Self::Exports,
        Self::Loads,
        Self::Settings,
        Self::Answers,
        Self::SmallImages,
        Self::Rows,
        Self::Nothing,
        Self::Inputs,
        Self::Outputs,
        Self::Repeats,
        Self::Cancel,
        Self::Threads,
        Self::OlderHost,
        Self::NewerHost,
        Self::Manners,
        Self::Sense,
    ];

    /// Its name, in letters and dashes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Header => "header",
            Self::Permissions => "permissions",
            Self::Exports => "exports",
            Self::Loads => "loads",
            Self::Settings => "settings",
            Self::Answers => "answers",
            Self::SmallImages => "small-images",
            Self::Rows => "rows",
            Self::Nothing => "nothing",
            Self::Inputs => "inputs",
            Self::Outputs => "outputs",
            Self::Repeats => "repeats",
            Self::Cancel => "cancel",
            Self::Threads => "threads",
            Self::OlderHost => "older-host",
            Self::NewerHost => "newer-host",
            Self::Manners => "manners",
            Self::Sense => "sense",
        }
    }

    /// What holds when it passes.
    pub fn promise(self) -> &'static str {
        match self {
            Self::Header => "a whole library with one declaration, of an ABI that this host speaks; no code runs",
            Self::Permissions => "nobody else may write the file or its directory",
            Self::Exports => "the declaration is the only exported symbol",
            Self::Loads => "it opens with all its symbols, and entry fills the table for its kind",
            Self::Settings => "the schema is valid; values at its bounds are taken, others refused",
            Self::Answers => "it answers on an ordinary street, within the rules of the host",
            Self::SmallImages => "images of one pixel, one row and one column",
            Self::Rows => "padding behind the rows changes nothing",
            Self::Nothing => "no regions, no candidates, a photo that is all void",
            Self::Inputs => "inputs are read inside their bounds, not written, and not used after the call",
            Self::Outputs => "nothing is written beside the places for answers and errors",
            Self::Repeats => "the same input gives the same answer",
            Self::Cancel => "it returns within 200 ms of a cancel",
            Self::Threads => "two instances in two threads agree",
            Self::OlderHost => "structs that end earlier are not read beyond their size",
            Self::NewerHost => "structs that go on change nothing",
            Self::Manners => "floating-point mode, working directory, locale and signal handlers stay",
            Self::Sense => "a view matches itself best; equal images are no change; a wall is measured within 2 %",
        }
    }

    /// Whether the trials after it have no meaning when it fails.
    pub fn is_gate(self) -> bool {
        matches!(self, Self::Header | Self::Permissions | Self::Loads | Self::Answers)
    }

    /// The trial of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|trial| trial.name() == name)
    }
}

/// Puts the library at `path` to `trial` in this process, which gets no more address space than `isolation` gives to a
/// plugin, may not survive it and does nothing else afterwards; what happens is written into `report`.
pub fn examine(trial: Trial, path: &Path, stage: &dyn Stage, isolation: Isolation, report: &Report) {
    limits::set(isolation.memory_mib.saturating_mul(BYTES_PER_MIB));
    #[cfg(unix)]
    super::fault::tell(report.file());
    report.step("before the first call");
    let finding = attempt(trial, path, stage, isolation, report).unwrap_or_else(|finding| finding);
    report.end(&finding);
}

fn attempt(trial: Trial, path: &Path, stage: &dyn Stage, isolation: Isolation, report: &Report) -> Tried {
    let refused = |fault| Finding::from(PluginError::from(registry::refusal(path, fault)));
    let (path, bytes) = registry::read(path).map_err(refused)?;
    let bench = Bench { path: &path, bytes: &bytes, stage, report, isolation: Arc::new(isolation) };
    match trial {
        Trial::Header => {
            let info = Registry::inspect(&path)?;
            Ok(Finding::passed(format!("{} {} ({})", info.name, info.version, info.kind)))
        }
        Trial::Permissions => {
            trust::check_permissions(&path).map_err(refused)?;
            Ok(Finding::passed("nobody else may write it"))
        }
        Trial::Exports => Ok(only_the_declaration(&path, &bytes)),
        Trial::Loads => tries::loads(&bench),
        Trial::Settings => tries::settings(&bench),
        Trial::Answers => tries::answers(&bench),
        Trial::SmallImages => tries::small_images(&bench),
        Trial::Rows => tries::rows(&bench),
        Trial::Nothing => tries::nothing(&bench),
        Trial::Inputs => tries::inputs(&bench),
        Trial::Outputs => tries::outputs(&bench),
        Trial::Repeats => tries::repeats(&bench),
        Trial::Cancel => tries::cancel(&bench),
        Trial::Threads => tries::threads(&bench),
        Trial::OlderHost => tries::older_host(&bench),
        Trial::NewerHost => tries::newer_host(&bench),
        Trial::Manners => tries::manners(&bench),
        Trial::Sense => sense::sense(&bench),
    }
}
