//! `resurvey plugins check`: every promise of the plugin line, each in a process of its own.

use super::installed::bytes_of;
use super::{process, trial};
use crate::args::{Check, Limits};
use crate::console::Console;
use crate::failure::{Failure, PLUGIN};
use resurvey_core::plugin::examine::{Finding, Trial};
use resurvey_core::plugin::{Digest, PluginInfo, Registry};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Instant;

/// Checks a file; exit code 12 when a test fails.
pub fn run(options: &Check, console: &mut Console<'_>) -> Result<u8, Failure> {
    if let (Some(name), Some(report)) = (&options.trial, &options.report) {
        return trial::run(name, &options.file, report, options.limits);
    }
    let checked = check(&options.file, options.limits, console)?;
    if console.is_json() {
        console.document(&checked.document())?;
    } else {
        checked.print(console)?;
        let file = options.file.display();
        let last = match checked.failed() {
            0 => format!("{file} passes; \"resurvey plugins install {file}\" makes it one of yours"),
            failed => format!("{file} fails {failed} of {} tests", Trial::ALL.len()),
        };
        console.line(last)?;
    }
    Ok(if checked.failed() == 0 { 0 } else { PLUGIN })
}

/// What came out of all tests of a file.
pub struct Checked {
    sha256: Digest,
    info: Option<PluginInfo>,
    rows: Vec<Row>,
}

struct Row {
    trial: Trial,
    /// `None`: not made, because an earlier one failed.
    finding: Option<Finding>,
    seconds: f64,
}

/// Makes every test on `file`.
pub fn check(file: &Path, limits: Limits, console: &mut Console<'_>) -> Result<Checked, Failure> {
    let sha256 = Digest::of(&bytes_of(file)?);
    let stage = console.stage("check");
    let mut rows: Vec<Row> = Vec::new();
    let mut is_closed = false;
    for (index, trial) in Trial::ALL.into_iter().enumerate() {
        let start = Instant::now();
        let finding = if is_closed { None } else { Some(process::make(trial, file, limits)?.finding()) };
        is_closed |= trial.is_gate() && matches!(finding, Some(Finding::Failed { .. }));
        rows.push(Row { trial, finding, seconds: start.elapsed().as_secs_f64() });
        resurvey_core::localize::Listener::progress(&stage, (index + 1) as f64 / Trial::ALL.len() as f64);
    }
    console.finish(&stage);
    Ok(Checked { sha256, info: Registry::inspect(file).ok(), rows })
}

impl Checked {
    /// How many tests failed.
    pub fn failed(&self) -> usize {
        self.rows.iter().filter(|row| matches!(row.finding, Some(Finding::Failed { .. }))).count()
    }

    /// A line per test.
    pub fn print(&self, console: &mut Console<'_>) -> Result<(), Failure> {
        if let Some(info) = &self.info {
            console.line(format_args!("{} {} ({}), SHA-256 {}", info.name, info.version, info.kind, self.sha256))?;
        }
        for row in &self.rows {
            let (result, words) = row.words();
            console.line(format_args!("  {:12} {result:8} {words}", row.trial.name()))?;
        }
        Ok(())
    }

    /// For machines.
    pub fn document(&self) -> Value {
        let plugin = self.info.as_ref().map(|info| {
            json!({ "name": info.name, "kind": info.kind.to_string(), "version": info.version, "summary": info.summary })
        });
        json!({
            "ok": self.failed() == 0,
            "sha256": self.sha256.to_string(),
            "plugin": plugin,
            "tests": self.rows.iter().map(Row::document).collect::<Vec<_>>(),
        })
    }
}

impl Row {
    fn words(&self) -> (&'static str, String) {
        match &self.finding {
            None => ("not run", String::new()),
            Some(Finding::Passed(note)) => ("ok", note.clone()),
            Some(Finding::Failed { problem, advice }) => ("FAILED", format!("{problem} · {advice}")),
            Some(Finding::NotApplicable(why)) => ("–", why.clone()),
        }
    }

    fn document(&self) -> Value {
        let (result, note, problem, advice) = match &self.finding {
            None => ("not-run", None, None, None),
            Some(Finding::Passed(note)) => ("ok", Some(note), None, None),
            Some(Finding::Failed { problem, advice }) => ("failed", None, Some(problem), Some(advice)),
            Some(Finding::NotApplicable(why)) => ("not-applicable", Some(why), None, None),
        };
        json!({
            "test": self.trial.name(),
            "promise": self.trial.promise(),
            "result": result,
            "note": note,
            "problem": problem,
            "advice": advice,
            "seconds": (self.seconds * 1e3).round() / 1e3,
        })
    }
}
