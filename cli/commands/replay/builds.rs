//! The recorded plugins: the very builds where they are to be had.

use crate::args::Replay;
use crate::commands::plugins::installed::build_of;
use crate::failure::{Failure, INPUT, MISSING, PLUGIN};
use crate::matching::MatchingTool;
use crate::tools::{self, Choices, Tool};
use anyhow::anyhow;
use resurvey_core::localize::FUSED;
use resurvey_core::plugin::Registry;
use resurvey_core::store::RecordedObservation;
use resurvey_core::version::PluginUse;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The recorded plugins, as they are to be had now.
pub(super) struct Tools {
    /// `None` where the pose was given.
    pub(super) matcher: Option<MatchingTool>,
    pub(super) detector: Tool,
    pub(super) estimator: Tool,
    /// What the document says of each.
    pub(super) builds: Vec<Value>,
}

impl Tools {
    /// Loads them, with the recorded settings.
    pub(super) fn load(
        recorded: &RecordedObservation,
        registry: &mut Registry,
        options: &Replay,
    ) -> Result<Self, Failure> {
        let plugins = &recorded.observation.plugins;
        let choices = Choices::recorded(plugins, &options.file)?;
        let named = |kind: &str| plugins.iter().find(|used| used.kind == kind).map(|used| used.name.as_str());
        let (Some(detector), Some(estimator)) = (named("detector"), named("estimator")) else {
            let id = recorded.id;
            return Err(Failure::new(MISSING, anyhow!("observation {id} names no detector and estimator to replay")));
        };
        // The labels that a segmenter made are what was seen; it is not asked again.
        let asked: Vec<&PluginUse> = plugins.iter().filter(|used| used.kind != "segmenter").collect();
        for used in asked.iter().filter(|used| used.name != FUSED) {
            find_build(used, registry)?;
        }
        let matcher = named("matcher").map(|name| MatchingTool::load(registry, &choices, name)).transpose()?;
        let [detector, estimator] =
            [detector, estimator].map(|name| tools::load(registry, name).and_then(|plugin| choices.tool(&plugin)));
        let (detector, estimator) = (detector?, estimator?);
        let mut found = matcher.as_ref().map(MatchingTool::used).transpose().map_err(moved)?.unwrap_or_default();
        found.extend([detector.used().map_err(moved)?, estimator.used().map_err(moved)?]);
        let builds = asked.iter().map(|used| build(used, &found, options.any_build)).collect::<Result<_, _>>()?;
        Ok(Self { matcher, detector, estimator, builds })
    }
}

/// A file that a setting names may lie elsewhere today.
fn moved(failure: Failure) -> Failure {
    if failure.code() != INPUT {
        return failure;
    }
    Failure::input(format!("{failure}; say where it lies now: --file PLUGIN.KEY=PATH"))
}

/// Sees to it that `registry` has the build that was `used`, where that is installed, or another one of its name.
fn find_build(used: &PluginUse, registry: &mut Registry) -> Result<(), Failure> {
    let PluginUse { kind, name, version, .. } = used;
    let Some(sha256) = used.sha256 else { return Ok(()) };
    let now = registry.list().into_iter().find(|info| info.name == *name);
    if now.as_ref().is_some_and(|info| info.builtin || info.sha256 == sha256) {
        return Ok(());
    }
    if let Some(file) = build_of(sha256) {
        return Ok(registry.prefer(&file)?);
    }
    let was_refused = registry.skipped().iter().any(|skipped| skipped.name.as_ref() == Some(name));
    if now.is_some() || was_refused {
        return Ok(());
    }
    Err(Failure::new(
        MISSING,
        anyhow!(
            "{kind} {name}: expected the recorded build {sha256} (version {version}), found no plugin of that name; install \
             that build, or name its directory: --plugin-dir DIR"
        ),
    ))
}

/// Whether what was `used` is among what is `found` now.
fn build(used: &PluginUse, found: &[PluginUse], any_build: bool) -> Result<Value, Failure> {
    let (kind, name) = (&used.kind, &used.name);
    let now = found.iter().find(|now| now.kind == *kind && now.name == *name);
    let sha256 = |used: &PluginUse| used.sha256.map(|digest| digest.to_string());
    let has_same_files = now.is_none_or(|now| now.files == used.files);
    let has_same_settings = now.is_none_or(|now| settings(now) == settings(used));
    let is_same_build = now.is_some_and(|now| used.sha256.is_none() || used.sha256 == now.sha256);
    let is_same = is_same_build && has_same_files && has_same_settings;
    if !is_same && !any_build {
        let text = |used: &PluginUse| format!("{} (version {})", sha256(used).unwrap_or_default(), used.version);
        let of_files = if has_same_files { "" } else { ", with other files" };
        let of_settings = if has_same_settings { "" } else { ", with other settings" };
        return Err(Failure::new(
            PLUGIN,
            anyhow!(
                "{kind} {name}: expected the recorded build {}, found {}{of_files}{of_settings}; {}, or compare with this \
                 one: --any-build",
                text(used),
                now.map_or_else(|| "none".to_owned(), text),
                if is_same_build { "give the recorded files: --file PLUGIN.KEY=PATH" } else { "install that build" },
            ),
        ));
    }
    Ok(json!({
        "kind": kind, "name": name, "sha256": sha256(used), "found_sha256": now.and_then(sha256), "same": is_same,
        "same_files": has_same_files, "same_settings": has_same_settings,
    }))
}

/// The settings of a plugin but for the paths of files, whose contents count.
fn settings(used: &PluginUse) -> BTreeMap<&str, &Value> {
    let all = used.settings.as_object().into_iter().flatten().map(|(key, value)| (key.as_str(), value));
    all.filter(|(key, _)| !used.files.iter().any(|file| file.setting == *key)).collect()
}
