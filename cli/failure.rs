//! Errors with their exit code: 2 usage, 10 input or output file, 11 no such thing, 12 plugin, 13 map file, 21 conflict,
//! 130 interrupted.

use resurvey_core::capture::CaptureError;
use resurvey_core::crs::CrsError;
use resurvey_core::evaluate::TruthError;
use resurvey_core::export::ExportError;
use resurvey_core::image::ImageError;
use resurvey_core::localize::HeatMapError;
use resurvey_core::mesh::{ClassMapError, EncodingError, ImportError};
use resurvey_core::plugin::{PluginError, SettingsError};
use resurvey_core::store::{CommitError, ConflictingChange, StoreError};
use resurvey_core::update::UpdateError;
use resurvey_core::version::{ChangeSetError, InvalidBox, VersionId};
use serde_json::{Value, json};
use std::fmt;
use std::path::Path;

/// A bug in this program.
pub const INTERNAL: u8 = 1;
/// The command line.
pub const USAGE: u8 = 2;
/// A file that was given to read or to write.
pub const INPUT: u8 = 10;
/// A map, revision, feature or plugin that is not there.
pub const MISSING: u8 = 11;
/// A plugin.
pub const PLUGIN: u8 = 12;
/// The map file.
pub const MAP: u8 = 13;
/// Not an error: nothing to update.
pub const NOTHING: u8 = 20;
/// The map changed since the base version, or another process is writing to it.
pub const CONFLICT: u8 = 21;
/// Not an error: the pose is not reliable.
pub const UNRELIABLE: u8 = 22;
/// The user asked to end: 128 and the number of the signal, as shells say it.
pub const INTERRUPTED: u8 = 130;

/// Why a command ended, and with which code.
#[derive(Debug)]
pub struct Failure {
    code: u8,
    error: anyhow::Error,
    /// What machines are told, with --json.
    document: Option<Box<Value>>,
}

impl Failure {
    /// An error of the kind that `code` stands for.
    pub fn new(code: u8, error: impl Into<anyhow::Error>) -> Self {
        Self { code, error: error.into(), document: None }
    }

    /// A wrong command line, in words.
    pub fn usage(text: impl fmt::Display) -> Self {
        Self::new(USAGE, anyhow::anyhow!("{text}"))
    }

    /// A wrong input file, in words.
    pub fn input(text: impl fmt::Display) -> Self {
        Self::new(INPUT, anyhow::anyhow!("{text}"))
    }

    /// The user asked to end, and so it did in the step that `reason` tells.
    pub fn interrupted(reason: impl fmt::Display) -> Self {
        Self::new(INTERRUPTED, anyhow::anyhow!("interrupted, {reason}; what was not finished is not in the map"))
    }

    /// A conflict with more `words`, and more keys of each feature in the list.
    pub fn conflict(error: &CommitError, words: &str, states: Vec<Value>) -> Self {
        let next = "look at the features with \"resurvey query\" and work the change out again";
        let failure = Self::new(CONFLICT, anyhow::anyhow!("{error}{words}; {next}"));
        let CommitError::Conflict { base, head, changed, looked_at } = error else { return failure };
        let mut document = conflict(*base, *head, changed, looked_at);
        for (index, state) in states.into_iter().enumerate() {
            if let (Some(change), Value::Object(state)) = (document["conflicts"][index].as_object_mut(), state) {
                change.extend(state);
            }
        }
        failure.with_document(document)
    }

    /// The same, naming `file` where the message does not; what is wrong with the map is not the file's doing.
    pub fn about(self, file: &Path) -> Self {
        let place = file.display().to_string();
        let is_of_map = matches!(
            self.error.downcast_ref(),
            Some(StoreError::Busy { .. } | StoreError::WrittenMeanwhile { .. } | StoreError::Internal { .. })
        );
        if self.code == MAP || is_of_map || names(&self.to_string(), &place) {
            self
        } else {
            Self { error: self.error.context(place), ..self }
        }
    }

    /// The same with what machines are told.
    pub fn with_document(self, document: Value) -> Self {
        Self { document: Some(Box::new(document)), ..self }
    }

    /// The same with one more key in what machines are told, if they are told something.
    pub fn with(mut self, key: &str, value: impl Into<Value>) -> Self {
        if let Some(document) = &mut self.document {
            document[key] = value.into();
        }
        self
    }

    /// What machines are told, once.
    pub fn take_document(&mut self) -> Option<Value> {
        self.document.take().map(|document| *document)
    }

    /// The exit code.
    pub fn code(&self) -> u8 {
        self.code
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Causes that a message quotes already are not said twice.
        let mut said = self.error.to_string();
        for cause in self.error.chain().skip(1).map(ToString::to_string) {
            if !said.contains(&cause) {
                said += &format!(": {cause}");
            }
        }
        formatter.write_str(&said)
    }
}

/// Whether `message` says that what follows is about the file at `place`.
fn names(message: &str, place: &str) -> bool {
    let begins = message.strip_prefix(place).is_some_and(|rest| rest.starts_with([':', ',', ' ']));
    begins || message.contains(&format!(": {place}: "))
}

macro_rules! failure_from {
    ($($error:ty => $code:expr,)*) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::new($code, error)
            }
        })*
    };
}

failure_from! {
    serde_json::Error => INTERNAL,
    CaptureError => INPUT,
    CrsError => USAGE,
    ExportError => INTERNAL,
    HeatMapError => INTERNAL,
    ImageError => INPUT,
    ImportError => INPUT,
    ClassMapError => INPUT,
    EncodingError => MAP,
    SettingsError => USAGE,
    TruthError => INPUT,
    ChangeSetError => INPUT,
    InvalidBox => USAGE,
}

/// Results are the only thing written without the name of a file.
impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::new(INPUT, anyhow::Error::from(error).context("standard output"))
    }
}

impl From<StoreError> for Failure {
    fn from(error: StoreError) -> Self {
        let code = match &error {
            StoreError::NotAMap { .. }
            | StoreError::NewerFormat { .. }
            | StoreError::Damaged { .. }
            | StoreError::NoSuchGeometry { .. }
            | StoreError::ReadOnly { .. }
            | StoreError::NoWriteAheadLog { .. }
            | StoreError::Full { .. }
            | StoreError::Io { .. } => MAP,
            StoreError::Busy { .. } | StoreError::WrittenMeanwhile { .. } => CONFLICT,
            StoreError::Internal { .. } => INTERNAL,
            StoreError::NotFound { .. }
            | StoreError::NoSuchVersion { .. }
            | StoreError::NoSuchFeature { .. }
            | StoreError::NeverAFeature { .. }
            | StoreError::NoSuchTag { .. }
            | StoreError::NoSuchProposal { .. }
            | StoreError::Forgotten { .. }
            | StoreError::ForgottenTime { .. }
            | StoreError::BeforeFirst { .. } => MISSING,
            StoreError::ProposalDecided { .. } => CONFLICT,
            StoreError::Revision(_) | StoreError::TagName { .. } => USAGE,
            _ => INPUT,
        };
        let document = match &error {
            StoreError::Busy { .. } | StoreError::WrittenMeanwhile { .. } => {
                Some(json!({ "decision": "busy", "version": null }))
            }
            StoreError::ProposalDecided { id, status } => {
                Some(json!({ "decision": "conflict", "id": id, "status": status, "version": null }))
            }
            _ => None,
        };
        let failure = Self::new(code, error);
        document.into_iter().fold(failure, Self::with_document)
    }
}

impl From<CommitError> for Failure {
    fn from(error: CommitError) -> Self {
        match error {
            CommitError::Conflict { .. } => Self::conflict(&error, "", Vec::new()),
            CommitError::NothingToRevert { version, .. } => Self::new(NOTHING, error).with_document(json!({
                "decision": "nothing", "reverts": version.0, "version": null, "added": 0, "modified": 0, "removed": 0,
            })),
            CommitError::OtherRequest { ref key, version, .. } => {
                let document = other_request(key, &json!({ "version": version.0 }));
                Self::new(CONFLICT, error).with_document(document)
            }
            CommitError::OtherProposal { ref key, id } => {
                let document = other_request(key, &json!({ "proposal": id }));
                Self::new(CONFLICT, error).with_document(document)
            }
            CommitError::Store(error) => error.into(),
            _ => Self::new(INPUT, error),
        }
    }
}

/// The document of a key that went with another request, which `made` something.
fn other_request(key: &str, made: &Value) -> Value {
    json!({ "decision": "conflict", "version": null, "idempotency_key": key, "made": made })
}

/// The document of a conflict.
pub fn conflict(base: VersionId, head: VersionId, changed: &[ConflictingChange], looked_at: &[VersionId]) -> Value {
    let one = |change: &ConflictingChange| {
        json!({
            "fid": change.fid.0,
            "changed_in": change.changed_in.map(|version| version.0),
            "is_on_map": change.found.is_some(),
            "is_target": change.is_target,
        })
    };
    json!({
        "decision": "conflict",
        "base_version": base.0,
        "head": head.0,
        "version": null,
        "conflicts": changed.iter().map(one).collect::<Vec<_>>(),
        "looked_at_by": looked_at.iter().map(|version| version.0).collect::<Vec<_>>(),
    })
}

impl From<PluginError> for Failure {
    fn from(error: PluginError) -> Self {
        let code = match &error {
            PluginError::Unknown { .. } => MISSING,
            PluginError::Settings { .. } => USAGE,
            _ => PLUGIN,
        };
        Self::new(code, error)
    }
}

impl From<UpdateError> for Failure {
    fn from(error: UpdateError) -> Self {
        match error {
            UpdateError::Store(error) => error.into(),
            UpdateError::Plugin(error) => error.into(),
            UpdateError::Geometry { .. } => Self::new(MAP, error),
            _ => Self::new(INPUT, error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_once_however_short_its_name() {
        let about = |text: &str, file: &str| Failure::input(text).about(Path::new(file)).to_string();
        assert_eq!(about("expected a header", "a"), "a: expected a header");
        assert_eq!(about("a: expected a header", "a"), "a: expected a header");
        assert_eq!(about("a, line 3: expected a header", "a"), "a, line 3: expected a header");
        assert_eq!(about("banner: expected a header", "ban"), "ban: banner: expected a header");
    }

    #[test]
    fn what_keeps_the_map_busy_is_not_the_doing_of_a_file() {
        let busy = Failure::from(StoreError::Busy { path: "city.rsv".into() });
        assert!(busy.about(Path::new("set.jsonl")).to_string().starts_with("city.rsv: another process"));
    }
}
