//! What is told of one capture: the document, and the same in words.

use super::{Committed, Outcome, Run, Work};
use crate::commands::diff::Sides;
use crate::commands::localize::pose_text;
use crate::console::Console;
use crate::document;
use crate::failure::{Failure, NOTHING, UNRELIABLE};
use crate::plain::plain;
use resurvey_core::plugin::PluginInfo;
use resurvey_core::store::History;
use resurvey_core::update::Change;
use resurvey_core::version::{Decision, PluginUse};
use resurvey_schema::ClassTable;
use serde_json::{Value, json};
use std::path::Path;

/// What is told of one capture.
pub(super) struct Told {
    /// Of the run.
    pub(super) document: Value,
    /// What the capture saw change, in the order of the resolution.
    pub(super) own: Vec<Value>,
    /// Its exit code.
    pub(super) code: u8,
}

impl Run<'_> {
    pub(super) fn told(
        &self,
        path: &Path,
        work: &Work,
        outcome: &Outcome,
        committed: &Committed,
        (matcher, used): (&PluginInfo, &[PluginUse]),
    ) -> Result<Told, Failure> {
        let snapshot = self.map.snapshot(work.base)?;
        let classes = snapshot.classes();
        let own = own_changes(outcome, committed, classes);
        let changes = match &committed.did {
            Some(deltas) => {
                let sides = Sides { before: classes, after: classes };
                deltas.iter().map(|delta| sides.document(delta)).collect::<Result<_, _>>()?
            }
            None => own.clone(),
        };
        let (decision, code) = match committed.decision {
            Decision::Unreliable => ("unreliable", UNRELIABLE),
            Decision::Nothing => ("nothing", NOTHING),
            _ if self.recording.dry_run => ("dry-run", 0),
            Decision::Proposed => ("proposed", 0),
            _ => ("committed", 0),
        };
        let rejections = outcome.resolution.rejections.iter();
        let mut document = json!({
            "capture": path.display().to_string(),
            "base_version": work.base.0,
            "version": committed.version.map(|version| version.0),
            "decision": decision,
            "localization": document::located(&outcome.located, matcher, self.crs, (&work.prior, &self.timings)),
            "changes": changes,
            "rejections": rejections.map(|rejection| document::rejection(rejection, classes)).collect::<Vec<_>>(),
            "plugins": used.iter().map(document::plugin_use).collect::<Vec<_>>(),
            "timings_ms": self.timings,
        });
        if !committed.proposals.is_empty() {
            document["proposals"] = json!(committed.proposals);
        }
        if !committed.decided.is_empty() {
            let one = |(id, status): &(u64, &str)| json!({ "id": id, "status": status });
            document["decided"] = committed.decided.iter().map(one).collect();
        }
        document::say_repeated(&mut document, committed.repeated);
        Ok(Told { document, own, code })
    }
}

/// What the capture saw change, with the numbers that the map gave.
fn own_changes(outcome: &Outcome, committed: &Committed, classes: &ClassTable) -> Vec<Value> {
    let mut fids = committed.fids.iter().copied();
    let document = |change: &Change| {
        let fid = if matches!(change, Change::Add(_)) { fids.next() } else { None };
        document::change(change, fid, classes)
    };
    outcome.resolution.changes.iter().map(document).collect()
}

pub(super) fn summary(
    path: &Path,
    document: &Value,
    outcome: &Outcome,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let decision = document["decision"].as_str().unwrap_or_default();
    let version = document["version"].as_u64().map_or_else(String::new, |version| format!(", version {version}"));
    console.line(format_args!("{}: {decision}{version}", path.display()))?;
    for id in document["proposals"].as_array().into_iter().flatten() {
        let mut decided = document["decided"].as_array().into_iter().flatten();
        let status = decided.find(|one| one["id"] == *id).and_then(|one| one["status"].as_str());
        let status = status.map_or_else(String::new, |status| format!(", {status} before"));
        console.line(format_args!("  proposal  {id}{status}"))?;
    }
    console.line(format_args!("  pose      {}", pose_text(&outcome.located.localization.pose)))?;
    for reason in &outcome.located.reasons {
        console.line(format_args!("  doubt     {}", plain(reason)))?;
    }
    for change in document["changes"].as_array().into_iter().flatten() {
        let (op, class) =
            (change["op"].as_str().unwrap_or_default(), plain(change["class"].as_str().unwrap_or_default()));
        let fid = change["fid"].as_u64().map_or_else(String::new, |fid| format!(" {fid}"));
        let state = if change["after"].is_null() { &change["before"] } else { &change["after"] };
        console.line(format_args!("  {op:9} {class}{fid} {}", place(state)))?;
    }
    for rejection in document["rejections"].as_array().into_iter().flatten() {
        let text = |key: &str| plain(rejection[key].as_str().unwrap_or_default());
        let number = |key: &str| rejection[key].as_f64().unwrap_or_default();
        console.line(format_args!(
            "  rejected  {} -> {}, {} px: {} is {:.3} {}, limit {:.3}",
            text("class_before"),
            text("class_after"),
            number("pixels"),
            text("requirement"),
            number("measured"),
            text("unit"),
            number("limit"),
        ))?;
    }
    Ok(())
}

/// Where a descriptor is and how large, in a few words.
fn place(state: &Value) -> String {
    let at = if state["centre"].is_null() { &state["position"] } else { &state["centre"] };
    let number = |value: &Value| value.as_f64().unwrap_or_default();
    let mut text = format!("at E {:.2} N {:.2} H {:.2}", number(&at[0]), number(&at[1]), number(&at[2]));
    if let (Some(width), Some(height)) = (state["width_m"].as_f64(), state["height_m"].as_f64()) {
        text += &format!(", {width:.2} x {height:.2} m");
    }
    if let Some(sigma) = state["sigma_m"].as_f64() {
        text += &format!(", 1 sigma {sigma:.2} m");
    }
    text
}
