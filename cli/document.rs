//! The JSON documents of the command line; `docs/cli.md` documents every key.

use crate::failure::Failure;
use resurvey_core::crs::Crs;
use resurvey_core::localize::Located;
use resurvey_core::plugin::PluginInfo;
use resurvey_core::update::Change;
use resurvey_core::version::{Feature, FeatureState, PluginUse, VersionRecord, descriptor_to_file};
use resurvey_schema::{ClassTable, Descriptor, Rejection};
use serde_json::{Map, Value, json};

/// The document of `localize --json`.
pub fn located(
    located: &Located,
    matcher: &PluginInfo,
    crs: Crs,
    (prior, timings_ms): (&Value, &Map<String, Value>),
) -> Value {
    let localization = &located.localization;
    let position = crs.wgs84_from_grid(localization.pose.position).ok();
    json!({
        "pose": localization.pose,
        "latitude": position.map(|position| position.latitude_deg),
        "longitude": position.map(|position| position.longitude_deg),
        "score": localization.score,
        "covariance": localization.covariance,
        "alignment": localization.alignment,
        "reliable": located.is_reliable(),
        "reasons": located.reasons,
        "gates": gates(&located.gates),
        "runner_up": localization.runner_up.map(|other| json!({
            "distance_m": other.distance_m,
            "score_ratio": other.score_ratio,
        })),
        "candidates": localization.candidates,
        "skipped": localization.skipped,
        "matcher": { "name": matcher.name, "version": matcher.version, "sha256": matcher.sha256.to_string() },
        "prior": prior,
        "timings_ms": timings_ms,
    })
}

/// Limits with what was measured.
pub fn gates(gates: &[resurvey_core::version::Gate]) -> Value {
    let gate = |gate: &resurvey_core::version::Gate| {
        let measured = if gate.measured.is_finite() { json!(gate.measured) } else { Value::Null };
        json!({ "name": gate.name, "measured": measured, "limit": gate.limit, "unit": gate.unit, "passed": gate.passed })
    };
    gates.iter().map(gate).collect()
}

/// One entry of `changes`.
pub fn change(change: &Change, added_fid: Option<u64>, classes: &ClassTable) -> Value {
    let side = |descriptor: &Descriptor| of_descriptor(descriptor, classes);
    let (op, fid, before, after) = match change {
        Change::Add(after) => ("add", added_fid, None, Some(after)),
        Change::Modify { fid, before, after } => ("modify", Some(*fid), Some(before), Some(after)),
        Change::Remove { fid, before } => ("remove", Some(*fid), Some(before), None),
    };
    let (before, after) = (before.map(side), after.map(side));
    let class = after.as_ref().or(before.as_ref()).map(|state| state["class"].clone());
    json!({ "op": op, "fid": fid, "class": class, "before": before, "after": after })
}

/// One entry of `rejections`.
pub fn rejection(rejection: &Rejection, classes: &ClassTable) -> Value {
    json!({
        "class_before": classes.name(rejection.class_before),
        "class_after": classes.name(rejection.class_after),
        "pixels": rejection.pixels,
        "requirement": rejection.requirement,
        "measured": rejection.measured,
        "limit": rejection.limit,
        "unit": rejection.unit,
    })
}

/// One entry of `plugins` in a result.
pub fn plugin_use(used: &PluginUse) -> Value {
    json!({
        "kind": used.kind,
        "name": used.name,
        "version": used.version,
        "sha256": used.sha256.map(|digest| digest.to_string()),
        "settings": used.settings,
        "settings_sha256": used.settings_sha256.map(|digest| digest.to_string()),
        "files": used.files,
    })
}

/// One entry of `plugins list`.
pub fn plugin_info(info: &PluginInfo) -> Value {
    json!({
        "name": info.name,
        "kind": info.kind.to_string(),
        "version": info.version,
        "summary": info.summary,
        "sha256": info.sha256.to_string(),
        "path": info.path.as_ref().map(|path| path.display().to_string()),
        "builtin": info.builtin,
        "process": info.is_apart,
    })
}

/// One entry of `versions` in `log`.
pub fn version(record: &VersionRecord) -> Value {
    json!({
        "version": record.version.0,
        "kind": record.kind.name(),
        "committed_at": record.committed_at.to_string(),
        "observed_at": record.observed_at.map(|time| time.to_string()),
        "author": record.author,
        "message": record.message,
        "base_version": record.base.map(|base| base.0),
        "reverts": record.reverts.map(|version| version.0),
        "added": record.counts.map(|counts| counts.added),
        "modified": record.counts.map(|counts| counts.modified),
        "removed": record.counts.map(|counts| counts.removed),
        "hash": record.hash.to_string(),
    })
}

/// Says in the document of a request that it was sent before.
pub fn say_repeated(document: &mut Value, repeated: bool) {
    if repeated {
        document["repeated"] = json!(true);
    }
}

/// A feature as `query` shows it.
pub fn feature(feature: &Feature, classes: &ClassTable) -> Result<Map<String, Value>, Failure> {
    let mut fields = Map::new();
    fields.insert("fid".to_owned(), json!(feature.fid.0));
    fields.insert("from".to_owned(), json!(feature.from.0));
    fields.insert("to".to_owned(), json!(feature.to.map(|version| version.0)));
    for (key, value) in state(&feature.state, classes)? {
        fields.insert(key, value);
    }
    Ok(fields)
}

/// The fields of a state: its kind, and those of a descriptor, or name, geometry and box of an object.
pub fn state(state: &FeatureState, classes: &ClassTable) -> Result<Map<String, Value>, Failure> {
    match state {
        FeatureState::Descriptor(descriptor) => Ok(of_descriptor(descriptor, classes)),
        FeatureState::Object { name, geometry, bounds } => {
            let [min, max] = bounds.corners();
            let value = json!({
                "kind": state.kind_name(), "class": null, "name": name, "geometry": geometry.to_string(),
                "min": min, "max": max,
            });
            Ok(serde_json::from_value(value)?)
        }
    }
}

fn of_descriptor(descriptor: &Descriptor, classes: &ClassTable) -> Map<String, Value> {
    let kind = FeatureState::Descriptor(descriptor.clone()).kind_name();
    let mut fields = Map::from_iter([("kind".to_owned(), json!(kind))]);
    if let Value::Object(more) = json!(descriptor_to_file(descriptor, classes)) {
        fields.extend(more);
    }
    fields
}
