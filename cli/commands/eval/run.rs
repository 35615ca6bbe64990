//! The run: every contender on every capture, then the tables.

use super::attempt::{Portion, Record, Runner};
use super::cases::{self, Case};
use super::contender::Field;
use super::groups::groups;
use super::maps::{Maps, check};
use super::{csv, document, table_v, text};
use crate::args::{Eval, Experiment, PluginSearch};
use crate::commands::write_file;
use crate::console::Console;
use crate::failure::Failure;
use resurvey_core::evaluate::Bootstrap;

/// What a run came to, for tables and documents.
pub struct Results<'a> {
    /// The plugins.
    pub field: &'a Field,
    /// Captures in their order.
    pub records: &'a [Record],
    /// How intervals were made.
    pub bootstrap: Bootstrap,
    /// Processors that the seconds were measured on.
    pub cores: usize,
    /// Whether updates were run.
    pub with_updates: bool,
}

/// Compares matchers on captures with truth, or runs the experiment that is named.
pub fn run(options: &Eval, plugins: &PluginSearch, console: &mut Console<'_>) -> Result<u8, Failure> {
    if let Some(Experiment::TableV(options)) = &options.experiment {
        return table_v::run(options, plugins, console);
    }
    let field = Field::load(options, plugins)?;
    for [one, other] in field.twins() {
        console.message(&format!("warning: {one} and {other} are one plugin with the same settings"));
    }
    let cases = cases::find(options)?;
    let mut maps = Maps::new()?;
    // Whatever is wrong with a file is said before hours are spent on the others.
    for case in &cases {
        maps.of_scene(&case.scene)?;
        if let Some(changes) = case.base_changes() {
            check(&changes)?;
        }
    }
    if let Some(path) = &options.csv {
        write_file(path, b"")?;
    }
    let mut runner = Runner::new(&field, maps, options.updates)?;
    let records = records(&mut runner, cases, console)?;
    let bootstrap = Bootstrap { seed: options.seed, ..Bootstrap::default() };
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let results = Results { field: &field, records: &records, bootstrap, cores, with_updates: options.updates };
    let groups = groups(&records, &field.contenders, &bootstrap);
    if let Some(path) = &options.csv {
        write_file(path, csv::csv(&results).as_bytes())?;
    }
    if console.is_json() {
        console.document(&document::document(&results, &groups)?)?;
    } else {
        text::print(&results, &groups, options.table, console)?;
    }
    Ok(0)
}

fn records(runner: &mut Runner<'_>, cases: Vec<Case>, console: &mut Console<'_>) -> Result<Vec<Record>, Failure> {
    let share = 1.0 / cases.len() as f64;
    let stage = console.stage("evaluate");
    let mut records = Vec::with_capacity(cases.len());
    for (index, case) in cases.into_iter().enumerate() {
        let portion = Portion { stage: &stage, start: share * index as f64, share, place: case.name.clone() };
        records.push(runner.record(case, &portion)?);
    }
    console.finish(&stage);
    Ok(records)
}
