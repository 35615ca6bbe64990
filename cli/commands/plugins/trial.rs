//! One test of `plugins check`, in the process that was started for it.

use super::place::Street;
use crate::args::Limits;
use crate::failure::Failure;
use resurvey_core::plugin::Isolation;
use resurvey_core::plugin::examine::{Report, Trial, examine};
use std::fs::OpenOptions;
use std::path::Path;
use std::time::Duration;

/// Makes the trial called `name` on `file` and writes into the report at `report`, which is there and empty.
pub fn run(name: &str, file: &Path, report: &Path, limits: Limits) -> Result<u8, Failure> {
    let trial = Trial::named(name).ok_or_else(|| Failure::usage(format!("there is no trial {name:?}")))?;
    let opened = OpenOptions::new().append(true).open(report);
    let opened = opened.map_err(|error| Failure::input(format!("{}: {error}", report.display())))?;
    let isolation = Isolation {
        program: std::env::current_exe().ok(),
        call_limit: Duration::from_secs_f64(limits.time_limit),
        memory_mib: limits.memory_limit,
        forgets: true,
    };
    examine(trial, file, &Street::new(), isolation, &Report::new(opened));
    Ok(0)
}
