//! One test of `plugins check`, in the process that was started for it.

use super::place::Street;
use crate::args::Limits;
use crate::failure::Failure;
use resurvey_core::plugin::examine::{Report, Trial, examine};
use std::fs::OpenOptions;
use std::path::Path;

const BYTES_PER_MIB: u64 = 1 << 20;

/// Makes the trial called `name` on `file` and writes into the report at `report`, which is there and empty.
pub fn run(name: &str, file: &Path, report: &Path, limits: Limits) -> Result<u8, Failure> {
    let trial = Trial::named(name).ok_or_else(|| Failure::usage(format!("there is no trial {name:?}")))?;
    let opened = OpenOptions::new().append(true).open(report);
    let opened = opened.map_err(|error| Failure::input(format!("{}: {error}", report.display())))?;
    examine(trial, file, &Street::new(), limits.memory_limit * BYTES_PER_MIB, &Report::new(opened));
    Ok(0)
}
