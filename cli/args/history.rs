//! Arguments of the commands on history: difference, undo, names, change sets, review, forgetting.

use super::{Region, number};
use clap::{Args, ValueEnum};
use resurvey_core::version::PluginBuild;
use std::path::PathBuf;

/// Arguments of `diff`.
#[derive(Debug, Args)]
pub struct Diff {
    /// Map file
    pub map: PathBuf,
    /// Two versions, tags or dates, e.g. 3..head; the other way round is the way back
    #[arg(value_name = "REV..REV")]
    pub range: String,
    #[command(flatten)]
    pub region: Region,
    /// Form of the answer [default: text, or json with --json]
    #[arg(long, value_enum)]
    pub format: Option<DiffFormat>,
}

/// Form of a difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DiffFormat {
    /// ++ came, -- went, ~~ changed: - and + are the old and the new value
    Text,
    /// One JSON document
    Json,
    /// A GeoJSON feature collection (WGS84): what changed is there twice, before and after
    Geojson,
}

/// Arguments of `revert`.
#[derive(Debug, Args)]
pub struct Revert {
    /// Map file
    pub map: PathBuf,
    /// Version, tag or date of what is undone
    #[arg(value_name = "REV", conflicts_with = "by_plugin")]
    pub revision: Option<String>,
    /// Undo every version that a plugin took part in and that still shows, all or none: the SHA-256 of its build (8 digits
    /// or more), NAME or NAME@VERSION, e.g. semantic@0.1.0
    #[arg(long, value_name = "BUILD")]
    pub by_plugin: Option<PluginBuild>,
    /// Only what lies in the region before or after
    #[command(flatten)]
    pub region: Region,
    /// Message of the version; default: "revert version N: " and its message
    #[arg(long, value_name = "TEXT")]
    pub message: Option<String>,
    /// Who commits
    #[arg(long, value_name = "NAME", default_value = "resurvey")]
    pub author: String,
    #[command(flatten)]
    pub retry: Retry,
}

/// How a command that may be sent twice is done once.
#[derive(Debug, Default, Args)]
pub struct Retry {
    /// A key of your own, e.g. a UUID: the same key again gives the version of the first time and changes nothing
    #[arg(long, value_name = "KEY")]
    pub idempotency_key: Option<String>,
}

/// Arguments of `tag`.
#[derive(Debug, Args)]
pub struct Tag {
    /// Map file
    pub map: PathBuf,
    /// Name to give; without one all tags are listed
    pub name: Option<String>,
    /// Version, tag, date or head
    #[arg(value_name = "REV", default_value = "head")]
    pub revision: String,
    /// Take the name away; the version stays
    #[arg(long, requires = "name", conflicts_with = "revision")]
    pub delete: bool,
}

/// Arguments of `changes`.
#[derive(Debug, Args)]
pub struct Changes {
    /// Map file
    pub map: PathBuf,
    /// Two versions, tags or dates, e.g. 3..head; the other way round is the way back
    #[arg(value_name = "REV..REV")]
    pub range: String,
}

/// Arguments of `proposals`.
#[derive(Debug, Args)]
pub struct Proposals {
    /// Map file
    pub map: PathBuf,
    /// What to do
    #[arg(value_enum, default_value = "list")]
    pub action: ProposalAction,
    /// Number of the proposal, as list prints it
    #[arg(value_parser = number)]
    pub id: Option<u64>,
    /// Also list what was accepted or rejected (with list)
    #[arg(long)]
    pub all: bool,
    /// Who decides, with accept and reject, e.g. ada [default: resurvey]
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
    /// Why, with accept and reject, e.g. "seen on site"
    #[arg(long, value_name = "TEXT")]
    pub note: Option<String>,
}

/// What to do with proposals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProposalAction {
    /// List those that wait for review
    List,
    /// Show one with its evidence
    Show,
    /// Make a version of one
    Accept,
    /// Close one without a version
    Reject,
}

/// Arguments of `gc`.
#[derive(Debug, Args)]
pub struct Gc {
    /// Map file
    pub map: PathBuf,
    /// Forget the versions before this version, tag or date, e.g. @2026-01-01, but for tagged ones and head
    #[arg(long, value_name = "REV")]
    pub forget_before: Option<String>,
    /// Only say what would be removed
    #[arg(long)]
    pub dry_run: bool,
}
