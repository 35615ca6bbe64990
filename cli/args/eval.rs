//! Arguments of `eval`.

use super::Settings;
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// Arguments of `eval`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, disable_help_subcommand = true)]
pub struct Eval {
    /// An experiment that needs no captures
    #[command(subcommand)]
    pub experiment: Option<Experiment>,
    /// Captures with truth.json: directories of one each, or directories that hold such directories
    #[arg(required = true)]
    pub cases: Vec<PathBuf>,
    /// Directory with SCENE/map.json and SCENE/SCENE.3ds or .glb, before "maps" in and beside CASES; may be given again
    #[arg(long, value_name = "DIR")]
    pub maps: Vec<PathBuf>,
    /// A matcher with settings of its own, e.g. semantic:profile=paper,dice=1; "prior" is the phone's pose itself. May be
    /// given again; default: prior, skyline, silhouette, edges, pixel, fused,
    /// Dice, Jaccard and boundary F1 alone, the mean of the three, semantic
    #[arg(long, value_name = "NAME[:KEY=VALUE,…]")]
    pub matcher: Vec<String>,
    /// Also detect, estimate and commit, on copies of the maps, and score the changes
    #[arg(long)]
    pub updates: bool,
    /// Only captures whose directory begins with this
    #[arg(long, value_name = "PREFIX")]
    pub only: Option<String>,
    /// At most this many captures
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub limit: Option<u64>,
    /// A change detector with settings of its own, as --matcher has them; may be given again: every matcher is tried
    /// with every detector and estimator
    #[arg(long, value_name = "NAME[:KEY=VALUE,…]", default_value = "class-difference", requires = "updates")]
    pub detector: Vec<String>,
    /// A descriptor estimator, likewise
    #[arg(long, value_name = "NAME[:KEY=VALUE,…]", default_value = "descriptors", requires = "updates")]
    pub estimator: Vec<String>,
    /// Captures at a time; more than one makes the seconds longer than they are alone [default: processors with
    /// --updates, else 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub jobs: Option<u16>,
    #[command(flatten)]
    pub settings: Settings,
    /// Seed of the bootstrap that the 95 % intervals come from
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// Also print a row for each capture, as the paper's Table II has them
    #[arg(long)]
    pub table: bool,
    /// Write a line for each capture and matcher
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

/// Experiments of `eval` that need no captures.
#[derive(Debug, Subcommand)]
pub enum Experiment {
    /// What an error of the pose, 0 to 5 m, does to a pedestrian on level ground and to a banner on a wall, beside what
    /// geometry says (the paper's Table V); writes only what you name with --out
    #[command(name = "table-v")]
    TableV(TableV),
}

/// Arguments of `eval table-v`.
#[derive(Debug, Args)]
pub struct TableV {
    /// Change detector
    #[arg(long, default_value = "class-difference")]
    pub detector: String,
    /// Descriptor estimator
    #[arg(long, default_value = "descriptors")]
    pub estimator: String,
    #[command(flatten)]
    pub settings: Settings,
    /// Draw both curves into this directory: table-v-pedestrian.svg, table-v-banner.svg
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}
