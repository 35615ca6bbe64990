//! What is known of a plugin before it runs.

pub use crate::version::{Digest, InvalidDigest};
use resurvey_schema::abi;
use std::path::PathBuf;

/// A plugin as `plugins list` shows it and the evidence records it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PluginInfo {
    /// Name on the command line.
    pub name: String,
    /// What it does.
    pub kind: Kind,
    /// Its own version.
    pub version: String,
    /// One sentence.
    pub summary: String,
    /// Of the plugin's file. A built-in plugin has no file of its own: the digest of its name, version, summary and
    /// settings schema and of the program that it is part of. So the same program gives the same evidence on every machine,
    /// and one with other code gives another.
    pub sha256: Digest,
    /// The library file; `None` when built in.
    pub path: Option<PathBuf>,
    /// Whether it is part of this program.
    pub builtin: bool,
    /// Whether it runs in a process of its own.
    pub is_apart: bool,
    /// JSON schema of its settings; `None` for a file that is not loaded yet, because asking would run its code.
    pub settings_schema: Option<String>,
}

/// What a plugin does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// Finds the pose of a photo.
    Matcher,
    /// Finds the regions in which photo and map differ.
    Detector,
    /// Makes descriptors of these regions.
    Estimator,
    /// Says which class each pixel of a photo is.
    Segmenter,
}

impl Kind {
    /// The kind with this number in the header.
    pub(super) fn from_number(number: u16) -> Option<Self> {
        match number {
            abi::KIND_MATCHER => Some(Self::Matcher),
            abi::KIND_DETECTOR => Some(Self::Detector),
            abi::KIND_ESTIMATOR => Some(Self::Estimator),
            abi::KIND_SEGMENTER => Some(Self::Segmenter),
            _ => None,
        }
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Matcher => "matcher",
            Self::Detector => "detector",
            Self::Estimator => "estimator",
            Self::Segmenter => "segmenter",
        })
    }
}
