//! Arguments of the commands on captures: where pose and labels come from, localizing, drawing, updating.

use clap::Args;
use jiff::Timestamp;
use resurvey_core::version::parse_moment;
use std::path::PathBuf;

/// Choice and settings of plugins.
#[derive(Debug, Args)]
pub struct Settings {
    /// A setting of a plugin or of the gate, e.g. gate.min_score=0.8; "resurvey plugins info NAME" lists them. May be given
    /// again
    #[arg(long, value_name = "PLUGIN.KEY=VALUE")]
    pub set: Vec<String>,
    /// Behaviour of all plugins that know profiles: default, or as published, e.g. paper
    #[arg(long, value_name = "NAME")]
    pub profile: Option<String>,
}

/// Where the position, height and heading of the prior come from, beside capture.json.
#[derive(Debug, Default, Args)]
pub struct PriorFrom {
    /// Take the prior from this NMEA log, at --at-time
    #[arg(long, value_name = "FILE")]
    pub nmea: Option<PathBuf>,
    /// Time to look up in the log, e.g. 2026-06-01T10:28:00+08:00, or a date for its end; default: the capture's taken_at
    #[arg(long, value_name = "T", requires = "nmea", value_parser = time)]
    pub at_time: Option<Timestamp>,
    /// Take the prior from the EXIF of this photo; with --segmenter the labels too, and the EXIF may be missing
    #[arg(long, value_name = "FILE.jpg", conflicts_with = "nmea")]
    pub photo: Option<PathBuf>,
}

impl PriorFrom {
    /// Whether a log or photo is named.
    pub fn is_given(&self) -> bool {
        self.nmea.is_some() || self.photo.is_some()
    }
}

/// Where the labels come from, when not from the label image of capture.json.
#[derive(Debug, Default, Args)]
pub struct LabelsFrom {
    /// Make the labels of the --photo with this plugin, e.g. palette, instead of reading the label image; "resurvey plugins
    /// list" lists segmenters
    #[arg(long, value_name = "NAME", requires = "photo")]
    pub segmenter: Option<String>,
}

/// Arguments of `localize`.
#[derive(Debug, Args)]
pub struct Localize {
    /// Map file
    pub map: PathBuf,
    /// capture.json
    pub capture: PathBuf,
    #[command(flatten)]
    pub prior: PriorFrom,
    #[command(flatten)]
    pub labels: LabelsFrom,
    /// VPS matcher; "resurvey plugins list" lists them
    #[arg(long, default_value = "semantic")]
    pub matcher: String,
    #[command(flatten)]
    pub settings: Settings,
    /// Version, tag, date or head, e.g. 12 or @2026-03-01
    #[arg(long, default_value = "head", value_name = "REV")]
    pub at: String,
    /// Score every candidate on a view of the photo's full size, and say which is best by each metric: minutes for seconds
    #[arg(long)]
    pub exhaustive: bool,
    /// Write the score of every candidate position as a picture
    #[arg(long, value_name = "FILE.png")]
    pub heatmap: Option<PathBuf>,
    /// Mark the true pose in the heat map: a JSON file with a "pose"
    #[arg(long, value_name = "FILE.json", requires = "heatmap")]
    pub truth: Option<PathBuf>,
    /// Write the result, which update and render read with --pose
    #[arg(long, value_name = "POSE.json")]
    pub out: Option<PathBuf>,
}

/// Arguments of `render`.
#[derive(Debug, Args)]
pub struct Render {
    /// Map file
    pub map: PathBuf,
    /// capture.json: its camera, and its prior pose unless --pose is given
    pub capture: Option<PathBuf>,
    #[command(flatten)]
    pub prior: PriorFrom,
    /// Pose to draw from: a JSON file with a "pose"; without a capture the camera is 960x720 with a 120° diagonal
    #[arg(long, value_name = "POSE.json")]
    pub pose: Option<PathBuf>,
    /// Version, tag, date or head, e.g. 12 or @2026-03-01
    #[arg(long, default_value = "head", value_name = "REV")]
    pub at: String,
    /// Directory for class.png, depth.png, points.ply and view.json
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Arguments of `update`.
#[derive(Debug, Args)]
pub struct Update {
    /// Map file
    pub map: PathBuf,
    /// One or more capture.json
    #[arg(required = true)]
    pub captures: Vec<PathBuf>,
    #[command(flatten)]
    pub prior: PriorFrom,
    #[command(flatten)]
    pub labels: LabelsFrom,
    /// Take this pose instead of localizing, with one capture: a JSON file with a "pose"
    #[arg(long, value_name = "POSE.json")]
    pub pose: Option<PathBuf>,
    /// VPS matcher; "resurvey plugins list" lists them
    #[arg(long, default_value = "semantic", conflicts_with = "pose")]
    pub matcher: String,
    /// Change detector
    #[arg(long, default_value = "class-difference")]
    pub detector: String,
    /// Descriptor estimator
    #[arg(long, default_value = "descriptors")]
    pub estimator: String,
    #[command(flatten)]
    pub settings: Settings,
    /// Do everything but write: the map stays as it is
    #[arg(long)]
    pub dry_run: bool,
    /// Keep each change for review instead of committing it
    #[arg(long, conflicts_with = "dry_run")]
    pub propose: bool,
    /// Keep each change for review until this many captures agree on it, e.g. 3, and commit it then
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u64).range(1..), conflicts_with_all = ["dry_run", "propose"])]
    pub confirm: Option<u64>,
    /// A key of your own, e.g. a UUID, with one capture: the same key again gives the version of the first time
    #[arg(long, value_name = "KEY", conflicts_with_all = ["dry_run", "propose", "confirm"])]
    pub idempotency_key: Option<String>,
    /// Also write an HTML page per capture and an index.html that links them, whatever the run comes to
    #[arg(long, value_name = "DIR")]
    pub report: Option<PathBuf>,
    /// Keep the label image in the map as evidence
    #[arg(long)]
    pub keep_labels: bool,
    /// Message of the version
    #[arg(long, value_name = "TEXT")]
    pub message: Option<String>,
    /// Who commits
    #[arg(long, value_name = "NAME", default_value = "resurvey")]
    pub author: String,
}

/// Parses when a photo was taken: a time with its zone, or a date, which is the end of that day.
fn time(text: &str) -> Result<Timestamp, String> {
    let expected = "expected a time with its zone, such as 2026-06-01T10:28:00+08:00, or a date";
    parse_moment(text).map_err(|_| format!("{expected}, found {text:?}"))
}
