//! `resurvey plugins list` and `resurvey plugins info`.

use super::installed::{Installed, Older, builds_in, first_file};
use crate::console::Console;
use crate::document;
use crate::failure::Failure;
use crate::tools::{data_directory, load};
use comfy_table::{Table, presets};
use resurvey_core::plugin::Registry;
use serde_json::json;

/// Lists what can be loaded, and with `is_verbose` where it was looked for and why a file was skipped.
pub fn list(registry: &Registry, is_verbose: bool, console: &mut Console<'_>) -> Result<u8, Failure> {
    let plugins = registry.list();
    let older = data_directory().map(|data| builds_in(&data).1).unwrap_or_default();
    let missing = Installed::of_this_user().ok().map(|installed| installed.plugins()).filter(|home| !home.exists());
    let path_of = |build: &Older| first_file(&build.directory).unwrap_or_else(|| build.directory.clone());
    if console.is_json() {
        let skipped: Vec<_> = (registry.skipped().iter())
            .map(|skipped| json!({ "path": skipped.path.display().to_string(), "reason": skipped.refusal.to_string() }))
            .collect();
        let directories: Vec<_> = registry.directories().iter().map(|path| path.display().to_string()).collect();
        console.document(&json!({
            "plugins": plugins.iter().map(document::plugin_info).collect::<Vec<_>>(),
            "directories": directories,
            "not_there_yet": missing.as_ref().map(|home| home.display().to_string()),
            "skipped": skipped,
            "older": older.iter().map(|build| json!({
                "name": build.name, "sha256": build.sha256.to_string(), "path": path_of(build).display().to_string(),
            })).collect::<Vec<_>>(),
        }))?;
        return Ok(0);
    }
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(["name", "kind", "version", "from", "what it does"]);
    for plugin in &plugins {
        let from = plugin.path.as_ref().map_or_else(|| "built in".to_owned(), |path| path.display().to_string());
        table.add_row([
            plugin.name.clone(),
            plugin.kind.to_string(),
            plugin.version.clone(),
            from,
            plugin.summary.clone(),
        ]);
    }
    console.line(table.trim_fmt())?;
    if is_verbose {
        for directory in registry.directories() {
            console.line(format_args!("searched {}", directory.display()))?;
        }
        if let Some(home) = &missing {
            console.line(format_args!("searched {}, which is not there yet: nothing is installed", home.display()))?;
        }
        for skipped in registry.skipped() {
            console.line(&skipped.refusal)?;
        }
        for build in &older {
            console.line(format_args!("kept {}, an older build of {}", path_of(build).display(), build.name))?;
        }
    }
    Ok(0)
}

/// Describes one plugin.
pub fn info(registry: &Registry, name: &str, console: &mut Console<'_>) -> Result<u8, Failure> {
    let plugin = load(registry, name)?;
    let info = plugin.info();
    let settings = plugin.schema().iter();
    if console.is_json() {
        let mut document = document::plugin_info(info);
        let schema = info.settings_schema.as_deref().and_then(|text| serde_json::from_str(text).ok());
        document["settings_schema"] = schema.unwrap_or(serde_json::Value::Null);
        console.document(&document)?;
        return Ok(0);
    }
    console.line(format_args!("{} {} ({}): {}", info.name, info.version, info.kind, info.summary))?;
    console.line(format_args!("sha256 {}", info.sha256))?;
    for (key, setting) in settings {
        console.line(format_args!(
            "  {name}.{key}={}  {} ({})",
            setting.default,
            setting.description,
            setting.expected()
        ))?;
    }
    Ok(0)
}
