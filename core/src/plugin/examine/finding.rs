//! What came out of a trial.

use super::super::error::PluginError;

/// What came out of a trial.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Finding {
    /// The promise holds; what was seen, in a few words.
    Passed(String),
    /// It does not.
    Failed {
        /// What was expected and what was found.
        problem: String,
        /// What to do about it.
        advice: String,
    },
    /// It has no meaning for this plugin, or on this system; why.
    NotApplicable(String),
}

impl Finding {
    /// The promise does not hold.
    pub(super) fn failed(problem: impl Into<String>, advice: impl Into<String>) -> Self {
        Self::Failed { problem: problem.into(), advice: advice.into() }
    }

    /// The promise holds.
    pub(super) fn passed(note: impl Into<String>) -> Self {
        Self::Passed(note.into())
    }
}

/// What the host itself says of a plugin that it cannot use.
impl From<PluginError> for Finding {
    fn from(error: PluginError) -> Self {
        let advice = match &error {
            PluginError::Refused(refusal) => {
                return Self::failed(format!("{}: {}", refusal.stage, refusal.reason), refusal.advice.clone());
            }
            PluginError::Panicked { .. } | PluginError::Poisoned { .. } => {
                "return an error with the reason instead; a panic ends the whole run"
            }
            PluginError::InvalidOutput { .. } => {
                "check this value before it is returned; the host drops a run with such an answer"
            }
            PluginError::Failed { call: "create", .. } => {
                "every value that the settings schema allows must make an instance; narrow the schema or take the value"
            }
            PluginError::Failed { .. } => {
                "answer here: the place is a plain street with a façade, and photo and map fit"
            }
            PluginError::Cancelled { .. } => "return RSV_CANCELLED only after the host's cancelled() gave 1",
            PluginError::Settings { .. } => "make every default and every bound a value that the schema itself allows",
            // Of an executable alone: a library runs in the process of the test itself.
            PluginError::Crashed { .. } => "its last words say why; docs/plugin-wire.md says what a process has to do",
            PluginError::Garbled { .. } => {
                "put descriptor 2 in the place of 1 before anything prints: docs/plugin-wire.md says how, and what may be said"
            }
            PluginError::TimedOut { .. } => {
                "end every loop, and answer each message: docs/plugin-wire.md says with what; --time-limit gives it longer"
            }
            _ => "read the rules at the top of resurvey_plugin.h",
        };
        let problem = match &error {
            // Without the way to this very test.
            PluginError::Crashed { call, how, .. } => format!("crashed in {call}: {how}"),
            PluginError::Garbled { call, expected, found, .. } => {
                format!("broke the wire in {call}: expected {expected}, found {found}")
            }
            _ => error.to_string(),
        };
        Self::failed(problem, advice)
    }
}
