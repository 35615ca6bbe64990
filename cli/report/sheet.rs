//! What a page is made from.

use resurvey_core::capture::Capture;
use resurvey_core::localize::{Located, World};
use resurvey_core::render::View;
use resurvey_core::update::Resolution;
use resurvey_schema::{ChangeRegion, Proposal};
use serde_json::Value;
use std::path::Path;

/// What was seen from a reliable pose, and what the plugins made of it.
pub struct Seen {
    /// The map from the pose.
    pub view: View,
    /// Regions that the detector found.
    pub regions: Vec<ChangeRegion>,
    /// What the estimator proposed for them.
    pub proposals: Vec<Proposal>,
}

/// One capture that came to a result.
pub struct Sheet<'a> {
    /// `capture.json`.
    pub path: &'a Path,
    /// The map.
    pub map: &'a Path,
    /// What `update --json` prints.
    pub document: &'a Value,
    /// What the capture saw change, in the order of `resolution`.
    pub changes: &'a [Value],
    /// The capture.
    pub capture: &'a Capture,
    /// The map around it before the update.
    pub world: &'a World,
    /// The pose.
    pub located: &'a Located,
    /// What changes and what does not.
    pub resolution: &'a Resolution,
    /// `None` where the pose is not reliable: nothing was compared.
    pub seen: Option<&'a Seen>,
}
