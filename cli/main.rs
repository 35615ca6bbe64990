//! The `resurvey` binary.
#![forbid(unsafe_code)]

use std::io::IsTerminal;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut out = std::io::BufWriter::new(std::io::stdout());
    let mut err = std::io::stderr();
    let shows_progress = err.is_terminal();
    let code = resurvey::run_with_progress(std::env::args_os(), &mut out, &mut err, shows_progress);
    ExitCode::from(code)
}
