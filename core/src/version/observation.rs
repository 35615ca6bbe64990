//! What was seen: the evidence behind a version, and behind an attempt that made none.

use super::Digest;
use jiff::Timestamp;
use resurvey_schema::service::Prior;
use resurvey_schema::{Alignment, Intrinsics, Pose, Rejection, RunnerUp};
use serde::{Deserialize, Serialize};

/// One attempt to update the map from one capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Digest of the capture.
    pub capture: Digest,
    /// Digest of what the photo shows, whatever file it comes in: two captures of one photo share it; maps before 2026-12
    /// do not say.
    pub photo: Option<Digest>,
    /// When the photo was taken.
    pub taken_at: Option<Timestamp>,
    /// The label image as PNG, when it is to be kept.
    pub labels: Option<Vec<u8>>,
    /// The phone's rough pose.
    pub prior: Option<Prior>,
    /// The camera of the label image; maps before 2026-12 do not say.
    pub camera: Option<Intrinsics>,
    /// How far around the prior the pose was looked for; maps before 2026-12 do not say.
    pub search: Option<SearchRange>,
    /// The pose that was found.
    pub localization: Option<LocalizationEvidence>,
    /// What computed it.
    pub plugins: Vec<PluginUse>,
    /// What the reliability gate measured.
    pub gates: Vec<Gate>,
    /// Changes that were seen and not made.
    pub rejections: Vec<Rejection>,
    /// What came of it.
    pub decision: Decision,
    /// Digests of the observations that it was confirmed by, its own among them; empty for a single capture.
    pub confirmations: Vec<Digest>,
}

/// The part of a localization that decisions rest on.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalizationEvidence {
    /// The pose.
    pub pose: Pose,
    /// Its score, 0–1; `None` for a pose that was given.
    pub score: Option<f64>,
    /// Covariance over easting (m), northing (m) and yaw (rad); row-major.
    pub covariance: [[f64; 3]; 3],
    /// What the matcher, or whoever gave the pose, knew beyond that.
    pub alignment: Option<Alignment>,
    /// The strongest other mode.
    pub runner_up: Option<RunnerUp>,
    /// Candidate poses that were scored.
    pub candidates: u64,
}

/// How far around the prior candidates lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchRange {
    /// Distance in plan, metres.
    pub radius_m: f64,
    /// Angle of the heading to either side, degrees.
    pub yaw_range_deg: f64,
}

/// A plugin as it was used.
#[derive(Clone, Debug, PartialEq)]
pub struct PluginUse {
    /// `matcher`, `detector`, `estimator`, …
    pub kind: String,
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// Digest of its file; `None` when it is linked in.
    pub sha256: Option<Digest>,
    /// Its settings, every default spelt out.
    pub settings: serde_json::Value,
    /// Digest of the settings as they were handed over; maps before 2026-12 do not say.
    pub settings_sha256: Option<Digest>,
    /// Files that its settings name, such as the weights of a network.
    pub files: Vec<ModelFile>,
}

/// A file that a plugin read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ModelFile {
    /// The setting that names it.
    pub setting: String,
    /// Digest of its bytes.
    pub sha256: Digest,
}

/// One limit of the reliability gate and what was measured against it.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    /// Short stable name.
    pub name: String,
    /// What was measured; not finite when it could not be.
    pub measured: f64,
    /// The limit.
    pub limit: f64,
    /// Unit of both: `m`, `deg`, `ratio`, …
    pub unit: String,
    /// Whether it was kept.
    pub passed: bool,
}

/// What came of an attempt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Decision {
    /// A version.
    Committed,
    /// A proposal.
    Proposed,
    /// Every change was rejected or none was found.
    Nothing,
    /// The pose was not reliable.
    Unreliable,
    /// The map had changed meanwhile.
    Conflict,
    /// A plugin failed or refused.
    Failed,
}

impl Decision {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Committed, Self::Proposed, Self::Nothing, Self::Unreliable, Self::Conflict, Self::Failed];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Committed => "committed",
            Self::Proposed => "proposed",
            Self::Nothing => "nothing",
            Self::Unreliable => "unreliable",
            Self::Conflict => "conflict",
            Self::Failed => "failed",
        }
    }
}
