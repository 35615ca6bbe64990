//! One capture, one matcher, one answer with its doubt.

use super::fused::Matching;
use super::gate::{GateLimits, reason};
use super::panel::Panel;
use super::search::{SearchLimits, search};
use super::services::SceneServices;
use crate::plugin::{MatcherForm, PhotoInput, PluginError, Services};
use crate::render::inside_solid;
use crate::version::Gate;
use resurvey_schema::Localization;

/// A localization and whether it may change the map.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// The matcher's answer.
    pub localization: Localization,
    /// What the reliability gate measured.
    pub gates: Vec<Gate>,
    /// Why the pose is not reliable; empty when it is.
    pub reasons: Vec<String>,
}

impl Located {
    /// `localization` as the gate with `limits` sees it.
    pub fn new(localization: Localization, limits: &GateLimits) -> Self {
        let gates = limits.measure(&localization);
        let reasons = gates.iter().filter_map(|gate| reason(gate, &localization)).collect();
        Self { localization, gates, reasons }
    }

    /// The same, of a pose inside a building: what it sees from there is no street. `pose` says whose it is.
    pub fn inside_building(mut self, pose: &str) -> Self {
        self.gates.push(inside_building(false));
        self.reasons.push(format!("{pose} lies inside a building of the map"));
        self
    }

    /// Whether every gate passed.
    pub fn is_reliable(&self) -> bool {
        self.reasons.is_empty()
    }
}

/// The gate on whether a pose is outside of every building.
pub fn inside_building(passed: bool) -> Gate {
    Gate {
        name: "inside-building".to_owned(),
        measured: f64::from(u8::from(!passed)),
        limit: 0.0,
        unit: "count".to_owned(),
        passed,
    }
}

/// The pose of the capture that `services` are about, by a matcher in either form or by several.
pub fn localize(
    matching: &mut Matching,
    services: &SceneServices<'_>,
    limits: &GateLimits,
    search_limits: &SearchLimits,
) -> Result<Located, PluginError> {
    let capture = services.capture();
    let camera = capture.camera.intrinsics();
    let photo = PhotoInput { labels: &capture.labels, camera: &camera, prior: &capture.prior };
    let localization = match matching {
        Matching::Plugin(matcher) => match matcher.form() {
            MatcherForm::Search => matcher.search(services, &photo)?,
            MatcherForm::Score => search(&mut Panel::of_one(matcher), services, search_limits)?,
        },
        Matching::Fused(fused) => search(&mut fused.panel(), services, search_limits)?,
    };
    services.progress(1.0);
    let located = Located::new(localization, limits);
    // A search of the host tries none there; a plugin that searches by itself may.
    let is_inside = inside_solid(services.world().scene(true), located.localization.pose.position);
    Ok(if is_inside { located.inside_building("the pose that the matcher found") } else { located })
}
