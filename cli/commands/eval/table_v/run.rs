//! The command: both experiments, then what was asked for of them.

use super::experiment::Experiment;
use super::output;
use crate::args::{PluginSearch, TableV};
use crate::console::Console;
use crate::document;
use crate::failure::Failure;
use crate::out_file::write_file;
use crate::tools::{Choices, Tool, load, registry};
use resurvey_core::version::PluginUse;
use serde_json::Value;

/// Runs both experiments, prints them, and draws them into `--out`.
pub fn run(options: &TableV, plugins: &PluginSearch, console: &mut Console<'_>) -> Result<u8, Failure> {
    let registry = registry(plugins)?;
    let names = [options.detector.as_str(), options.estimator.as_str()];
    let choices = Choices::read(&options.settings, &names)?;
    let tool = |name: &str| -> Result<Tool, Failure> { choices.tool(&load(&registry, name)?) };
    let tools = [tool(names[0])?, tool(names[1])?];
    let mut detector = tools[0].plugin.detector(&tools[0].settings)?;
    let mut estimator = tools[1].plugin.estimator(&tools[1].settings)?;
    let experiments =
        [Experiment::pedestrian(&mut detector, &mut estimator)?, Experiment::banner(&mut detector, &mut estimator)?];
    let mut files = Vec::new();
    if let Some(out) = &options.out {
        std::fs::create_dir_all(out).map_err(|error| Failure::input(format!("{}: {error}", out.display())))?;
        for experiment in &experiments {
            let file = out.join(format!("table-v-{}.svg", experiment.name));
            write_file(&file, output::chart(experiment).svg().as_bytes())?;
            files.push(file);
        }
    }
    if console.is_json() {
        let used: Vec<PluginUse> = tools.iter().map(Tool::used).collect::<Result<_, _>>()?;
        let used: Vec<Value> = used.iter().map(document::plugin_use).collect();
        console.document(&output::document(&experiments, &used, &files))?;
    } else {
        output::print(&experiments, console)?;
    }
    Ok(0)
}
