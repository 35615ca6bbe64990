//! The command line: names, options, units, defaults and help.

mod captures;
mod eval;
mod history;
mod plugins;

pub use captures::{LabelsFrom, Localize, PriorFrom, Render, Settings, Update};
pub use eval::{Eval, Experiment, TableV};
pub use history::{Changes, Diff, DiffFormat, Gc, ProposalAction, Proposals, Retry, Revert, Tag};
pub use plugins::{Check, Install, Language, Limits, New, NewForm, NewKind, Plugins};

use clap::{Args, Parser, Subcommand, ValueEnum};
use jiff::Timestamp;
use resurvey_core::plugin::Isolation;
use resurvey_core::version::{PluginBuild, parse_moment};
use std::path::PathBuf;

/// Keeps a 3D city map current from phone photos.
///
/// A map is one file (*.rsv). Results go to standard output, progress and messages to standard error.
#[derive(Debug, Parser)]
#[command(name = "resurvey", version, arg_required_else_help = true, subcommand_required = true, after_help = CODES)]
pub struct Cli {
    /// Print one JSON document instead of text
    #[arg(long, global = true, help_heading = EVERYWHERE)]
    pub json: bool,
    #[command(flatten)]
    pub plugins: PluginSearch,
    /// What to do
    #[command(subcommand)]
    pub command: Command,
}

/// Over the options of every command, which would stand between a command's own.
const EVERYWHERE: &str = "Options of every command";

/// What exit codes mean, below the help.
const CODES: &str = "\
Exit codes:
  0   done
  1   internal error: a bug
  2   bad usage
  10  bad input file, or a file that cannot be written
  11  no such thing: map, version, tag, feature, proposal, class, plugin
  12  a plugin failed or was refused
  13  map file damaged, of a newer format, read-only, or on a disk that refuses
  20  nothing to update
  21  conflict: the map changed since the base version, or another process is writing to it
  22  pose not reliable, nothing committed
  130 interrupted";

/// Where plugins beside the built-in ones come from.
#[derive(Debug, Args)]
#[command(next_help_heading = EVERYWHERE)]
pub struct PluginSearch {
    /// Directory with plugin libraries, e.g. ./plugins, beside RESURVEY_PLUGIN_PATH and the user's data directory; may be
    /// given again
    #[arg(long, global = true, value_name = "DIR")]
    pub plugin_dir: Vec<PathBuf>,
    /// SHA-256 of a plugin library that may be loaded, all 64 digits, e.g. as "plugins list --verbose" prints it; may be
    /// given again
    #[arg(long, global = true, value_name = "SHA256")]
    pub allow_plugin: Vec<String>,
    /// Seconds of its own that a plugin from a file has for one call, e.g. 30
    #[arg(long, global = true, value_name = "SECONDS", default_value_t = Isolation::DEFAULT_CALL_LIMIT_S, value_parser = seconds)]
    pub plugin_timeout: f64,
    /// Address space of the process of a plugin from a file, MiB, e.g. 2048; 0 is no limit
    #[arg(long, global = true, value_name = "MIB", default_value_t = Isolation::DEFAULT_MEMORY_MIB)]
    pub plugin_memory: u64,
    /// Open plugin libraries in this process: faster to start, and a crash of theirs is one of resurvey
    #[arg(long, global = true)]
    pub in_process: bool,
    /// The program that runs plugins in processes of their own
    #[arg(skip)]
    pub program: Option<PathBuf>,
}

/// A time above zero that a clock can count to.
fn seconds(text: &str) -> Result<f64, String> {
    let parsed = text.parse::<f64>().ok().filter(|seconds| (0.001..=1e6).contains(seconds));
    parsed.ok_or_else(|| format!("expected seconds from 0.001 to 1000000, found {text:?}"))
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Make an empty map file (version 0); refuses to overwrite one
    Init(Init),
    /// Add the objects of models to the map as one new version
    Import(Import),
    /// Find where a photo was taken; changes nothing on disk but the files you name
    Localize(Localize),
    /// Draw the map as a camera sees it: class image, depth and points; writes into --out only
    Render(Render),
    /// Localize, detect, estimate and commit: one new version per capture that changes something
    Update(Update),
    /// List descriptors and objects in a region at a version; changes nothing
    Query(Query),
    /// List versions that changed something, newest first; changes nothing
    Log(Log),
    /// Show what differs between two versions, in a region or everywhere; changes nothing
    Diff(Diff),
    /// Undo one version, in a region or everywhere, by a new version
    Revert(Revert),
    /// Give a version a name, or list the names; changes nothing but names
    Tag(Tag),
    /// Show the evidence behind a descriptor or object; changes nothing
    Why(Why),
    /// Review updates that wait: list and show them; accept makes a new version, reject closes one
    Proposals(Proposals),
    /// Print what differs between two versions as a change set (JSON lines) for apply; changes nothing
    Changes(Changes),
    /// Apply a change set (JSON lines) as one new version, or refuse it whole
    Apply(Apply),
    /// Write a version or region of the map to another format; changes nothing in the map
    Export(Export),
    /// Compare matchers on captures with known truth; changes nothing on disk but the file you name with --csv
    Eval(Eval),
    /// Run the plugins of a version again on what it saw, and compare; changes nothing
    Replay(Replay),
    /// List, check, install and remove plugins; no map is touched
    #[command(subcommand)]
    Plugins(Plugins),
    /// Check everything that must hold in a map; changes nothing without --repair
    Fsck(Fsck),
    /// Remove from the map file what nobody uses, and versions before one when asked to forget them
    Gc(Gc),
    /// Print the completion script of a shell (never JSON)
    Completions(Completions),
    /// Write a manual page per command into a directory
    Man(Man),
}

/// Arguments of `init`.
#[derive(Debug, Args)]
pub struct Init {
    /// Map file to make
    pub map: PathBuf,
    /// Coordinate reference system of the map; others than EPSG:2326 need a build with --features proj
    #[arg(long, default_value = "EPSG:2326")]
    pub crs: String,
    /// Class table, JSON: [{"index":0,"name":"stone","colour":[0,0,255],"kind":"material"}, …]; default: the nine classes
    #[arg(long, value_name = "FILE")]
    pub classes: Option<PathBuf>,
}

/// Arguments of `import`.
#[derive(Debug, Args)]
pub struct Import {
    /// Map file
    pub map: PathBuf,
    /// Models: 3DS, GLB or glTF, told apart by content
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// Grid position of the model's origin, metres, e.g. 835600,817800,4.5
    #[arg(long, value_name = "E,N,H", allow_hyphen_values = true, value_parser = numbers::<3>)]
    pub origin: Option<[f64; 3]>,
    /// CRS of the model's own coordinates, e.g. EPSG:2056; needs a build with --features proj
    #[arg(long, value_name = "EPSG:CODE", conflicts_with = "origin")]
    pub crs: Option<String>,
    /// The model's up axis; default: what the format says
    #[arg(long, value_enum)]
    pub up: Option<UpAxis>,
    /// Turn the model clockwise about the up axis before it is moved to the origin, degrees, e.g. 90
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    pub rotate: f64,
    /// Classes of materials, TOML: name = "class", default = "class"
    #[arg(long, value_name = "FILE")]
    pub map_classes: Option<PathBuf>,
    /// Take the nearest class colour within this distance (0–441), e.g. 30, in label textures, for lossy ones such as JPG
    #[arg(long, value_name = "DISTANCE")]
    pub nearest_colour: Option<f64>,
    /// Index that means "unlabelled" in label textures, e.g. 0
    #[arg(long, value_name = "INDEX")]
    pub void_index: Option<u8>,
    /// When the model was surveyed, a date or a time with its zone, e.g. 2025-11-30; default: unknown
    #[arg(long, value_name = "T", value_parser = moment)]
    pub observed_at: Option<Timestamp>,
    /// Message of the version
    #[arg(long, value_name = "TEXT")]
    pub message: Option<String>,
    /// Who commits
    #[arg(long, value_name = "NAME", default_value = "resurvey")]
    pub author: String,
    #[command(flatten)]
    pub retry: Retry,
}

/// Up axis of a model.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum UpAxis {
    /// y up, as glTF has it
    Y,
    /// z up, as 3DS has it
    Z,
}

/// A region of the map.
#[derive(Debug, Args)]
pub struct Region {
    /// West, south, east, north: grid metres, e.g. 835500,817700,835700,817900, or degrees with --wgs84
    #[arg(long, value_name = "E0,N0,E1,N1", allow_hyphen_values = true, value_parser = numbers::<4>)]
    pub bbox: Option<[f64; 4]>,
    /// Lowest and highest height, metres above the map's datum, e.g. 0,10; alone everywhere in plan
    #[arg(long, value_name = "H0,H1", allow_hyphen_values = true, value_parser = numbers::<2>)]
    pub height: Option<[f64; 2]>,
    /// The region is in WGS84 degrees (bbox: longitude, latitude, longitude, latitude), and query answers in degrees too
    #[arg(long)]
    pub wgs84: bool,
}

/// Arguments of `query`.
#[derive(Debug, Args)]
pub struct Query {
    /// Map file
    pub map: PathBuf,
    #[command(flatten)]
    pub region: Region,
    /// A GeoJSON file with one polygon, e.g. block.geojson: grid metres, or degrees with --wgs84
    #[arg(long, value_name = "FILE.geojson", conflicts_with = "bbox")]
    pub polygon: Option<PathBuf>,
    /// Centre of a circle, WGS84 degrees, e.g. 22.2978,114.1711
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true, value_parser = numbers::<2>, requires = "radius", conflicts_with_all = ["bbox", "polygon"])]
    pub near: Option<[f64; 2]>,
    /// Radius of the circle, metres, e.g. 50
    #[arg(long, value_name = "M", allow_hyphen_values = true, value_parser = metres, requires = "near")]
    pub radius: Option<f64>,
    /// Version, tag, date or head, e.g. 12 or @2026-03-01
    #[arg(long, default_value = "head", value_name = "REV")]
    pub at: String,
    /// What was there at this time as that version knows it, e.g. 2026-03-01: by when photos were taken, not committed
    #[arg(long, value_name = "T", value_parser = moment)]
    pub observed_at: Option<Timestamp>,
    /// Only this class, e.g. banner; may be given again
    #[arg(long, value_name = "NAME")]
    pub class: Vec<String>,
    /// Form of the answer [default: table, or json with --json]
    #[arg(long, value_enum)]
    pub format: Option<QueryFormat>,
}

/// Form of a query's answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum QueryFormat {
    /// For people
    Table,
    /// One JSON document
    Json,
    /// A GeoJSON feature collection (WGS84, as RFC 7946 asks)
    Geojson,
    /// Comma-separated, one feature a line
    Csv,
}

/// Arguments of `log`.
#[derive(Debug, Args)]
pub struct Log {
    /// Map file
    pub map: PathBuf,
    /// Only versions that changed this feature
    #[arg(value_parser = number)]
    pub fid: Option<u64>,
    #[command(flatten)]
    pub region: Region,
    /// Only versions that this plugin took part in: the SHA-256 of its build (8 digits or more), NAME or NAME@VERSION, e.g.
    /// semantic@0.1.0
    #[arg(long, value_name = "BUILD")]
    pub by_plugin: Option<PluginBuild>,
    /// At most this many versions, e.g. 10
    #[arg(long, short = 'n', value_name = "N")]
    pub limit: Option<usize>,
}

/// Arguments of `why`.
#[derive(Debug, Args)]
pub struct Why {
    /// Map file
    pub map: PathBuf,
    /// Feature id, as query prints it
    #[arg(value_parser = number)]
    pub fid: u64,
}

/// Arguments of `replay`.
#[derive(Debug, Args)]
pub struct Replay {
    /// Map file
    pub map: PathBuf,
    /// Version, tag or date
    #[arg(value_name = "REV")]
    pub revision: String,
    /// The capture, where the map did not keep its label image (update --keep-labels does)
    #[arg(long, value_name = "CAPTURE.json")]
    pub capture: Option<PathBuf>,
    /// Also with other builds of the plugins than the recorded ones
    #[arg(long)]
    pub any_build: bool,
    /// Where a file that a setting names lies now, e.g. segnet.weights=models/city.onnx; may be given again
    #[arg(long, value_name = "PLUGIN.KEY=PATH")]
    pub file: Vec<String>,
}

/// Arguments of `apply`.
#[derive(Debug, Args)]
pub struct Apply {
    /// Map file
    pub map: PathBuf,
    /// Change set (resurvey.changes/1); - reads standard input
    pub file: PathBuf,
    #[command(flatten)]
    pub retry: Retry,
}

/// Arguments of `export`.
#[derive(Debug, Args)]
pub struct Export {
    /// Map file
    pub map: PathBuf,
    /// File to write; its suffix says the format: .glb, or .gltf with a .bin beside it
    pub out: PathBuf,
    /// Version, tag, date or head, e.g. 12 or @2026-03-01
    #[arg(long, default_value = "head", value_name = "REV")]
    pub at: String,
    /// Only what differs between two versions, e.g. 3..head: added green, removed red, changed yellow
    #[arg(long, value_name = "REV..REV", conflicts_with = "at")]
    pub diff: Option<String>,
    #[command(flatten)]
    pub region: Region,
}

/// Arguments of `fsck`.
#[derive(Debug, Args)]
pub struct Fsck {
    /// Map file
    pub map: PathBuf,
    /// Mend the index and remove what nobody uses first; nothing else is touched
    #[arg(long)]
    pub repair: bool,
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct Completions {
    /// Shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub struct Man {
    /// Directory, made when it is missing
    pub out: PathBuf,
}

/// Parses the number of a feature or proposal.
fn number(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("expected a number, found {text:?}"))
}

/// Parses a length; whether it can be one is for the command to say.
fn metres(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| format!("expected metres, found {text:?}"))
}

/// Parses a date, or a time with its zone.
fn moment(text: &str) -> Result<Timestamp, String> {
    parse_moment(text).map_err(|error| error.to_string())
}

/// Parses exactly `N` finite numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let values: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse::<f64>().map_err(|_| format!("expected {N} numbers with commas, found {part:?}")))
        .collect::<Result<_, _>>()?;
    if let Some(value) = values.iter().find(|value| !value.is_finite()) {
        return Err(format!("expected finite numbers, found {value}"));
    }
    let found = values.len();
    values.try_into().map_err(|_| format!("expected {N} numbers with commas, found {found}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    /// Every command with its names, the one of `command` and those within it.
    fn all(command: &clap::Command, within: &str) -> Vec<(String, clap::Command)> {
        let name = format!("{within} {}", command.get_name());
        let below = command.get_subcommands().flat_map(|below| all(below, &name));
        std::iter::once((name.clone(), command.clone())).chain(below).collect()
    }

    #[test]
    fn every_option_that_takes_a_value_has_an_example_of_one() {
        let of_files = ["FILE", "DIR", "TEXT", "POSE.json", "CAPTURE.json", "FILE.json", "FILE.jpg", "FILE.png"];
        for (name, command) in all(&Cli::command(), "") {
            // Theirs is another page.
            if name.contains("plugins") || name.contains("eval") {
                continue;
            }
            let mut silent = Vec::new();
            for option in command.get_opts() {
                let takes = option.get_value_names().unwrap_or_default();
                let is_file = takes.iter().any(|value| of_files.contains(&value.as_str()));
                let help = option.get_help().map(ToString::to_string).unwrap_or_default();
                let has_example = help.contains("e.g.") || !option.get_default_values().is_empty();
                let is_told = has_example || is_file || !option.get_possible_values().is_empty();
                let takes_value = option.get_action().takes_values();
                if takes_value && !is_told {
                    silent.push(format!("--{}: {help}", option.get_id()));
                }
            }
            assert!(silent.is_empty(), "{name}: {silent:#?}");
        }
    }

    #[test]
    fn negative_and_missing_numbers_are_told_apart() {
        let [first, second] = numbers::<2>("-1.5, 2").unwrap();
        assert!((first + 1.5).abs() < 1e-12 && (second - 2.0).abs() < 1e-12);
        assert!(numbers::<2>("1").unwrap_err().contains("found 1"));
        assert!(numbers::<2>("1,NaN").unwrap_err().contains("finite"));
    }
}
