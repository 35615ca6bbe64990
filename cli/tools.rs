//! Plugins and their settings as the command line chooses them.

use crate::args::{PluginSearch, Settings};
use crate::commands::plugins::installed::{allowed_in, builds_in};
use crate::failure::Failure;
use crate::matching::with_members;
use anyhow::anyhow;
use resurvey_core::localize::{FUSED, GATE_KEYS, GateLimits, SearchLimits};
use resurvey_core::plugin::{Assignment, CrashLog, Digest, Isolation, Plugin, PluginError, PluginInfo, Registry};
use resurvey_core::version::{ModelFile, PluginUse, SearchRange};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Colon-separated directories of plugin libraries.
const PLUGIN_PATH: &str = "RESURVEY_PLUGIN_PATH";
/// The file in the user's data directory with a line for every crash of a plugin: what crashed twice is not started again.
pub const CRASHED: &str = "crashed-plugins";

/// Names that no plugin may have: what `--matcher`, `--set` and `eval` call something else.
pub const RESERVED: [&str; 4] = [FUSED, GATE, SEARCH, "prior"];

/// Names in `--set NAME.KEY=VALUE` that are not plugins.
const GATE: &str = "gate";
const SEARCH: &str = "search";

/// The built-in plugins and those in the directories of `search`.
pub fn registry(search: &PluginSearch) -> Result<Registry, Failure> {
    let given = search.allow_plugin.iter().map(|text| text.parse::<Digest>());
    let mut allowed = given.collect::<Result<Vec<_>, _>>().map_err(Failure::usage)?;
    let data = data_directory();
    if let Some(data) = &data {
        allowed.extend(allowed_in(data)?);
    }
    let mut registry = Registry::new(allowed);
    if !search.in_process {
        registry.isolate(isolation(search));
    }
    if let Some(data) = &data {
        registry.count_crashes(CrashLog::new(&data.join(CRASHED)));
    }
    if let Some(program) = &search.program {
        registry.of_program(program_digest(program)?);
    }
    for declaration in [
        resurvey_semantic::plugin(),
        resurvey_skyline::plugin(),
        resurvey_pixel::plugin(),
        resurvey_silhouette::plugin(),
        resurvey_edges::plugin(),
        resurvey_class_difference::plugin(),
        resurvey_aligned::plugin(),
        resurvey_descriptors::plugin(),
        resurvey_palette::plugin(),
    ] {
        registry.add_builtin(declaration)?;
    }
    let from_path = std::env::var_os(PLUGIN_PATH).map(|path| std::env::split_paths(&path).collect::<Vec<_>>());
    // Each installed build has a directory of its own.
    let installed = data.as_deref().map(|data| builds_in(data).0).unwrap_or_default();
    let plugins = data.map(|data| data.join("plugins")).filter(|directory| directory.is_dir());
    let own = plugins.into_iter().chain(installed);
    for directory in search.plugin_dir.iter().cloned().chain(from_path.into_iter().flatten()).chain(own) {
        registry.add_directory(&directory);
    }
    Ok(registry)
}

/// The digest of the program at `path`, which is worked out once.
fn program_digest(path: &Path) -> Result<Digest, Failure> {
    static KNOWN: Mutex<BTreeMap<PathBuf, Digest>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(digest) = known.get(path) {
        return Ok(*digest);
    }
    let digest = file_digest(path)?;
    known.insert(path.to_owned(), digest);
    Ok(digest)
}

/// The digest of a file of any size.
fn file_digest(path: &Path) -> Result<Digest, Failure> {
    let wrong = |error: std::io::Error| Failure::input(format!("{}: {error}", path.display()));
    // A pipe or device may have no end.
    if !std::fs::metadata(path).map_err(wrong)?.is_file() {
        return Err(wrong(std::io::Error::other("not a file")));
    }
    std::fs::File::open(path).and_then(Digest::of_all).map_err(wrong)
}

/// How plugins from files are kept apart.
fn isolation(search: &PluginSearch) -> Isolation {
    Isolation {
        program: search.program.clone(),
        call_limit: Duration::from_secs_f64(search.plugin_timeout),
        memory_mib: search.plugin_memory,
        forgets: false,
    }
}

/// The plugin called `name`. Where there is none, a library file of that name that was refused is why.
pub fn load(registry: &Registry, name: &str) -> Result<Plugin, Failure> {
    registry.load(name).map_err(|error| {
        let is_named = |path: &Path| {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy().replace('_', "-");
            stem.strip_prefix("lib").unwrap_or(&stem) == name
        };
        let refused = registry.skipped().iter().find(|skipped| is_named(&skipped.path));
        match (&error, refused) {
            (PluginError::Unknown { .. }, Some(skipped)) => Failure::from(PluginError::from(skipped.refusal.clone())),
            _ => error.into(),
        }
    })
}

/// Where this user's plugins are kept. A relative path counts for nothing, as the XDG base directory specification asks:
/// it would be another directory wherever the program is started.
pub fn data_directory() -> Option<PathBuf> {
    let named = |key: &str| std::env::var_os(key).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = named("XDG_DATA_HOME").or_else(|| Some(named("HOME")?.join(".local/share")))?;
    Some(base.join("resurvey"))
}

/// The `--set` and `--profile` of one run.
pub struct Choices {
    assignments: Vec<Assignment>,
    profile: Option<String>,
    /// Limits of the reliability gate.
    pub gate: GateLimits,
    /// Limits of the host-driven search.
    pub search: SearchLimits,
}

impl Choices {
    /// Reads `settings` for a run of the plugins called `names`.
    pub fn read(settings: &Settings, names: &[&str]) -> Result<Self, Failure> {
        let mut choices = Self {
            assignments: Vec::new(),
            profile: settings.profile.clone(),
            gate: GateLimits::default(),
            search: SearchLimits::default(),
        };
        let parsed = |text: &String| -> Result<Assignment, Failure> {
            text.parse().map_err(|error| Failure::usage(format!("--set {text}: {error}")))
        };
        let assignments = settings.set.iter().map(parsed).collect::<Result<Vec<_>, _>>()?;
        let names = with_members(names, &assignments)?;
        for (text, assignment) in settings.set.iter().zip(assignments) {
            match assignment.plugin.as_str() {
                GATE => choices.set_gate(&assignment)?,
                SEARCH => choices.set_search(&assignment)?,
                name if names.iter().any(|known| known == name) => choices.assignments.push(assignment),
                name => {
                    let used = names.join(", ");
                    return Err(Failure::usage(format!(
                        "--set {text}: this run does not use {name:?}; it uses {used}, {GATE} and {SEARCH}"
                    )));
                }
            }
        }
        Ok(choices)
    }

    /// What a run was recorded with: every setting spelt out, but that `files` say where files lie now.
    pub fn recorded(plugins: &[PluginUse], files: &[String]) -> Result<Self, Failure> {
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let settings = plugins.iter().flat_map(|used| {
            let settings = used.settings.as_object().into_iter().flatten();
            settings.map(|(key, value)| (used.name.clone(), key.clone(), text(value)))
        });
        let mut assignments: Vec<Assignment> =
            settings.map(|(plugin, key, value)| Assignment { plugin, key, value }).collect();
        for file in files {
            let wrong = |error: &dyn std::fmt::Display| Failure::usage(format!("--file {file}: {error}"));
            let moved: Assignment = file.parse().map_err(|error| wrong(&error))?;
            let names_it = |used: &PluginUse| {
                used.name == moved.plugin && used.files.iter().any(|model| model.setting == moved.key)
            };
            if !plugins.iter().any(names_it) {
                return Err(wrong(&"expected a setting that named a file then"));
            }
            assignments.retain(|known| (&known.plugin, &known.key) != (&moved.plugin, &moved.key));
            assignments.push(moved);
        }
        let (gate, search) = (GateLimits::default(), SearchLimits::default());
        Ok(Self { assignments, profile: None, gate, search })
    }

    /// How the evidence records how far the search goes.
    pub fn search_range(&self) -> SearchRange {
        SearchRange { radius_m: self.search.radius_m, yaw_range_deg: self.search.yaw_range_deg }
    }

    /// Makes the matcher called `name` score every candidate at full size.
    pub fn exhaustive(&mut self, registry: &Registry, name: &str) -> Result<(), Failure> {
        const KEY: &str = "exhaustive";
        if name == FUSED || !load(registry, name)?.schema().iter().any(|(key, _)| key == KEY) {
            return Err(Failure::usage(format!(
                "--exhaustive: the matcher {name:?} has no such search; --matcher semantic has"
            )));
        }
        let assignment = format!("{name}.{KEY}=true").parse().map_err(Failure::usage)?;
        self.assignments.push(assignment);
        Ok(())
    }

    fn set_gate(&mut self, assignment: &Assignment) -> Result<(), Failure> {
        let value = number(assignment)?;
        let (largest, expected) = match assignment.key.as_str() {
            "min_score" | "max_runner_up_ratio" => (1.0, "0 to 1"),
            _ => (f64::MAX, "0 or more"),
        };
        if !(0.0..=largest).contains(&value) && GATE_KEYS.contains(&assignment.key.as_str()) {
            return Err(Failure::usage(format!("gate.{}={value}: expected {expected}", assignment.key)));
        }
        if self.gate.set(&assignment.key, value) {
            return Ok(());
        }
        let (key, known) = (&assignment.key, GATE_KEYS.join(", "));
        Err(Failure::usage(format!("gate has no setting {key:?}; it has {known}")))
    }

    fn set_search(&mut self, assignment: &Assignment) -> Result<(), Failure> {
        let value = number(assignment)?;
        match assignment.key.as_str() {
            "radius_m" if (0.0..=500.0).contains(&value) => self.search.radius_m = value,
            "yaw_range_deg" if (0.0..=180.0).contains(&value) => self.search.yaw_range_deg = value,
            key => {
                let expected = "radius_m (0 to 500) and yaw_range_deg (0 to 180)";
                return Err(Failure::usage(format!("search.{key}={value}: expected {expected}")));
            }
        }
        Ok(())
    }

    /// What was set of the plugin called `name`: key and value.
    pub fn given(&self, name: &str) -> Vec<(&str, &str)> {
        let own = self.assignments.iter().filter(|assignment| assignment.plugin == name);
        own.map(|assignment| (assignment.key.as_str(), assignment.value.as_str())).collect()
    }

    /// `plugin` with its settings, and how the evidence records it.
    pub fn tool(&self, plugin: &Plugin) -> Result<Tool, Failure> {
        let mut given = self.given(&plugin.info().name);
        if let Some(profile) = &self.profile
            && plugin.schema().iter().any(|(key, _)| key == "profile")
            && !given.iter().any(|(key, _)| *key == "profile")
        {
            given.push(("profile", profile));
        }
        let settings = plugin.settings(given)?;
        Ok(Tool { plugin: plugin.clone(), settings })
    }
}

fn number(assignment: &Assignment) -> Result<f64, Failure> {
    let Assignment { plugin, key, value } = assignment;
    let parsed = value.parse::<f64>().ok().filter(|number| number.is_finite());
    parsed.ok_or_else(|| Failure::usage(format!("--set {plugin}.{key}={value}: expected a number")))
}

/// A plugin with the settings of this run.
pub struct Tool {
    /// The plugin.
    pub plugin: Plugin,
    /// Complete settings.
    pub settings: resurvey_core::plugin::Settings,
}

impl Tool {
    /// Name and settings: what makes two tools give the same answers.
    pub fn identity(&self) -> (&str, Digest) {
        (&self.plugin.info().name, self.settings.sha256())
    }

    /// How the evidence records it.
    pub fn used(&self) -> Result<PluginUse, Failure> {
        let info: &PluginInfo = self.plugin.info();
        let mut files = Vec::new();
        for (setting, path) in self.settings.files(self.plugin.schema()) {
            let wrong = |failure: Failure| Failure::input(format!("{}.{setting}: {failure}", info.name));
            let sha256 = file_digest(&path).map_err(wrong)?;
            files.push(ModelFile { setting, sha256 });
        }
        Ok(PluginUse {
            kind: info.kind.to_string(),
            name: info.name.clone(),
            version: info.version.clone(),
            sha256: Some(info.sha256),
            settings: serde_json::from_str(self.settings.as_json()).map_err(|error| {
                Failure::new(crate::failure::INTERNAL, anyhow!("settings of {}: {error}", info.name))
            })?,
            settings_sha256: Some(self.settings.sha256()),
            files,
        })
    }
}
