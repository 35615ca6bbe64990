//! Runs the binary under `strace`, which makes one of its system calls fail.

use crate::job::Job;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Command;

/// The system calls with which SQLite changes files.
const CALLS: &str = "pwrite64,fsync,fdatasync,ftruncate";

/// How a call fails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The process is killed as it makes the call.
    Kill,
    /// The call reports that the disk is broken; the next ones work.
    Broken,
    /// This call and all later ones report that the disk is full.
    Full,
}

/// What a run gave.
#[derive(Debug)]
pub struct Run {
    /// The exit code; none when the process was killed.
    pub code: Option<i32>,
    /// Standard error.
    pub messages: String,
    /// Calls that change files, up to the end of the process.
    pub calls: usize,
}

/// Whether `strace` can be used here; else says what is missing, and that the test passes without having tested.
pub fn is_there() -> bool {
    let works = Command::new("strace").args(["-qq", "-e", "trace=none", "true"]).output();
    let works = works.is_ok_and(|output| output.status.success());
    if !works {
        // Past the capture of test output, which shows nothing of a test that passes.
        let said =
            "SKIPPED: strace is missing or may not trace (Debian: apt-get install strace); NO FAULT WAS TESTED\n";
        let _ = std::io::stderr().write_all(said.as_bytes());
    }
    works
}

/// Runs `job` on `map`; the `nth` call that changes a file fails, counted from 1.
pub fn run(job: &Job, map: &Path, fault: Option<(Fault, usize)>) -> Run {
    let trace = map.with_file_name("trace");
    let mut command = Command::new("strace");
    command.args(["-f", "-qq", "-o"]).arg(&trace).arg("-e").arg(format!("trace={CALLS}"));
    if let Some((fault, nth)) = fault {
        let how = match fault {
            Fault::Kill => format!("signal=KILL:when={nth}"),
            Fault::Broken => format!("error=EIO:when={nth}"),
            Fault::Full => format!("error=ENOSPC:when={nth}+"),
        };
        command.arg("-e").arg(format!("inject={CALLS}:{how}"));
    }
    let output = command.arg(env!("CARGO_BIN_EXE_resurvey")).arg(job.command).arg(map).args(&job.arguments).output();
    let output = output.unwrap();
    let is_call = |line: &&str| CALLS.split(',').any(|call| line.contains(&format!(" {call}(")));
    Run {
        code: output.status.code(),
        messages: String::from_utf8_lossy(&output.stderr).into_owned(),
        calls: fs::read_to_string(&trace).unwrap_or_default().lines().filter(is_call).count(),
    }
}
