//! The `resurvey` binary.
#![forbid(unsafe_code)]

use resurvey::{Host, Interrupt};
use resurvey_core::plugin::{SERVE, serve};
use std::io::IsTerminal;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    if arguments.next().is_some_and(|first| first == SERVE) {
        return ExitCode::from(serve(arguments));
    }
    let mut out = std::io::BufWriter::new(std::io::stdout());
    let mut err = std::io::stderr();
    // Where the system does not say what is running, plugins from files say so.
    let program = std::env::current_exe().ok();
    // Without a handler Ctrl-C ends the program as ever.
    let interrupt = Interrupt::of_terminal().unwrap_or_default();
    let host = Host { shows_progress: err.is_terminal(), program, interrupt };
    let code = resurvey::run_as(host, std::env::args_os(), &mut out, &mut err);
    ExitCode::from(code)
}
