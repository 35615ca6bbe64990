//! What can go wrong with a plugin.

use super::info::Kind;
use super::settings::SettingsError;
use std::path::PathBuf;

/// Why a plugin gave no answer, or none that can be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PluginError {
    /// Neither built in nor found in the directories searched.
    #[error("no plugin is called {name:?}; known are: {}", known.join(", "))]
    Unknown {
        /// What was asked for.
        name: String,
        /// Every name that would do, sorted.
        known: Vec<String>,
    },
    /// It is there but may not or cannot be loaded.
    #[error("{0}")]
    Refused(Box<Refusal>),
    /// It exists but does something else.
    #[error("plugin {plugin} is a {is}, not a {wanted}")]
    WrongKind {
        /// Its name.
        plugin: String,
        /// Its kind.
        is: Kind,
        /// What was asked for.
        wanted: Kind,
    },
    /// A setting is unknown or out of range.
    #[error("plugin {plugin}: {source}")]
    Settings {
        /// Its name.
        plugin: String,
        /// What is wrong.
        source: SettingsError,
    },
    /// A bug in the plugin; the instance is not used again.
    #[error("plugin {plugin} panicked in {call}: {text}")]
    Panicked {
        /// Its name.
        plugin: String,
        /// `load`, `create`, `score`, `search`, `detect`, `estimate` or `destroy`.
        call: &'static str,
        /// Message, file and line.
        text: String,
    },
    /// This instance panicked before.
    #[error("plugin {plugin} panicked in an earlier call; make a new instance")]
    Poisoned {
        /// Its name.
        plugin: String,
    },
    /// The plugin says that it has no answer.
    #[error("plugin {plugin} gave no answer in {call}: {text}")]
    Failed {
        /// Its name.
        plugin: String,
        /// As in [`Panicked`](Self::Panicked).
        call: &'static str,
        /// The plugin's own words.
        text: String,
    },
    /// The call ended early because the caller asked for it.
    #[error("plugin {plugin} was cancelled in {call}")]
    Cancelled {
        /// Its name.
        plugin: String,
        /// As in [`Panicked`](Self::Panicked).
        call: &'static str,
    },
    /// The process of the plugin died, or left.
    #[error("plugin {plugin} crashed in {call}: {how}; \"resurvey plugins check FILE\" says more for its author")]
    Crashed {
        /// Its name.
        plugin: String,
        /// As in [`Panicked`](Self::Panicked).
        call: &'static str,
        /// Signal or exit code, and what it said last.
        how: String,
    },
    /// The process of the plugin said something that is no message, or not its turn.
    #[error(
        "plugin {plugin} broke the wire in {call}: expected {expected}, found {found}; \"resurvey plugins check FILE\" says more \
         for its author"
    )]
    Garbled {
        /// Its name.
        plugin: String,
        /// As in [`Panicked`](Self::Panicked).
        call: &'static str,
        /// What could have come.
        expected: String,
        /// The beginning of what came.
        found: String,
    },
    /// The plugin did not return in time; its process was ended.
    #[error("plugin {plugin} did not return from {call} within {limit_s} s; --plugin-timeout SECONDS gives it longer")]
    TimedOut {
        /// Its name.
        plugin: String,
        /// As in [`Panicked`](Self::Panicked).
        call: &'static str,
        /// The limit, seconds.
        limit_s: f64,
    },
    /// The caller's rasters do not belong together, or there is no process for the plugin.
    #[error("plugin {plugin} was not called: {text}")]
    InvalidInput {
        /// Its name.
        plugin: String,
        /// What does not fit what.
        text: String,
    },
    /// The answer breaks a rule; nothing of the run is kept.
    #[error("plugin {plugin} answered {field} = {value} in {call}; expected {expected}")]
    InvalidOutput {
        /// Its name.
        plugin: String,
        /// As in [`Panicked`](Self::Panicked).
        call: &'static str,
        /// Which value.
        field: String,
        /// What it was.
        value: String,
        /// The rule.
        expected: String,
    },
}

/// Why a file or a built-in plugin was not loaded, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("refused {name} at {stage}: {reason} · {advice}")]
pub struct Refusal {
    /// File name, or plugin name for a built-in one.
    pub name: String,
    /// Where it lies; `None` for a built-in one.
    pub path: Option<PathBuf>,
    /// How far it came.
    pub stage: Stage,
    /// What was expected and found.
    pub reason: String,
    /// What to do next.
    pub advice: String,
}

/// The gates that a plugin passes, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The file can be read.
    File,
    /// Nobody else may write it.
    Permissions,
    /// Its SHA-256 is on the user's list.
    AllowList,
    /// It did not crash twice before.
    Quarantine,
    /// It is a library with one declaration.
    Header,
    /// It speaks this version of the line.
    Abi,
    /// The system opens it and finds all its symbols.
    Symbol,
    /// Its entry fills the table for its kind.
    Entry,
    /// Its settings schema can be read.
    Settings,
}

impl Stage {
    const ALL: [Self; 9] = [
        Self::File,
        Self::Permissions,
        Self::AllowList,
        Self::Quarantine,
        Self::Header,
        Self::Abi,
        Self::Symbol,
        Self::Entry,
        Self::Settings,
    ];

    /// The gate that messages call `name`.
    pub(super) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.to_string() == name)
    }
}

impl std::fmt::Display for Stage {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::File => "file",
            Self::Permissions => "permissions",
            Self::AllowList => "allow-list",
            Self::Quarantine => "quarantine",
            Self::Header => "header",
            Self::Abi => "abi",
            Self::Symbol => "symbol",
            Self::Entry => "entry",
            Self::Settings => "settings",
        })
    }
}

impl From<Refusal> for PluginError {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(Box::new(refusal))
    }
}
