//! The run: every contender on every capture, then the tables.

use super::attempt::{Record, Runner};
use super::cases::{self, Case};
use super::contender::Field;
use super::groups::groups;
use super::maps::{Maps, check};
use super::parallel::in_order;
use super::progress::{Portion, Progress};
use super::{csv, document, table_v, text};
use crate::args::{Eval, Experiment, PluginSearch};
use crate::console::Console;
use crate::failure::Failure;
use crate::out_file::{check_file, write_file};
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
    /// Captures that were worked on at a time.
    pub jobs: usize,
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
        maps.prepare(&case.scene)?;
        if let Some(changes) = case.base_changes() {
            check(&changes)?;
        }
    }
    if let Some(path) = &options.csv {
        check_file(path)?;
    }
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let jobs = match options.jobs {
        Some(jobs) => usize::from(jobs),
        // Times are compared where only poses are; there a capture has the machine to itself.
        None if options.updates => cores,
        None => 1,
    };
    let runner = Runner::new(&field, maps, options.updates)?;
    let records = records(&runner, &cases, jobs, console)?;
    let bootstrap = Bootstrap { seed: options.seed, ..Bootstrap::default() };
    let results = Results { field: &field, records: &records, bootstrap, cores, jobs, with_updates: options.updates };
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

fn records(
    runner: &Runner<'_>,
    cases: &[Case],
    jobs: usize,
    console: &mut Console<'_>,
) -> Result<Vec<Record>, Failure> {
    let stage = console.stage("evaluate");
    let progress = Progress::new(cases.len());
    let records = in_order(cases.len(), jobs, |index| {
        let case = &cases[index];
        let place = case.name.clone();
        let whole = Portion { progress: &progress, stage: &stage, capture: index, start: 0.0, share: 1.0, place };
        runner.record(case, &whole)
    });
    progress.tell(&stage);
    console.finish(&stage);
    records
}
