//! Starts this program again for one test, and ends it when its time is over.

use crate::args::Limits;
use crate::failure::{Failure, INTERNAL};
use anyhow::{Context, anyhow};
use resurvey_core::plugin::examine::{Ended, How, Trial};
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// As much of an output as is kept.
const KEPT_BYTES: u64 = 64 << 10;
/// How long to wait for the rest of an output; a grandchild may hold it open for ever.
const REST: Duration = Duration::from_millis(500);

/// Makes `trial` on `file` in a process of its own.
pub fn make(trial: Trial, file: &Path, limits: Limits) -> Result<Ended, Failure> {
    attempt(trial, file, limits).map_err(|error| Failure::new(INTERNAL, error))
}

fn attempt(trial: Trial, file: &Path, limits: Limits) -> anyhow::Result<Ended> {
    let program = std::env::current_exe().context("the path of this program")?;
    let report = tempfile::NamedTempFile::new().context("a temporary file for the report of a test")?;
    let mut command = Command::new(&program);
    command.args(["plugins", "check"]).arg(file).args(["--trial", trial.name()]);
    command.arg("--report").arg(report.path()).args(["--memory-limit", &limits.memory_limit.to_string()]);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().with_context(|| format!("starting {}", program.display()))?;
    let (output, messages) = (listen(child.stdout.take()), listen(child.stderr.take()));
    let how = wait(&mut child, Duration::from_secs_f64(limits.time_limit))?;
    let heard = |from: Receiver<Vec<u8>>| {
        let bytes = from.recv_timeout(REST).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    };
    let report = String::from_utf8_lossy(&std::fs::read(report.path())?).into_owned();
    if report.is_empty() && !matches!(how, How::TimedOut(_)) {
        let said = heard(messages);
        return Err(anyhow!("{} was started for a test and did not begin it: {}", program.display(), said.trim()));
    }
    Ok(Ended { how, report, output: heard(output), messages: heard(messages) })
}

/// Reads a stream to its end on a thread, so that nobody who prints much is held up.
fn listen(stream: Option<impl Read + Send + 'static>) -> Receiver<Vec<u8>> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let Some(mut stream) = stream else { return };
        let mut bytes = Vec::new();
        // What was read before an error is still worth showing.
        let _ = stream.by_ref().take(KEPT_BYTES).read_to_end(&mut bytes);
        let _ = std::io::copy(&mut stream, &mut std::io::sink());
        let _ = sender.send(bytes);
    });
    receiver
}

fn wait(child: &mut Child, limit: Duration) -> anyhow::Result<How> {
    let (start, mut pause) = (Instant::now(), Duration::from_millis(1));
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(how(status));
        }
        if start.elapsed() >= limit {
            child.kill()?;
            child.wait()?;
            return Ok(How::TimedOut(limit));
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(20));
    }
}

#[cfg(unix)]
fn how(status: std::process::ExitStatus) -> How {
    use std::os::unix::process::ExitStatusExt;
    status.signal().map_or_else(|| How::Exited(status.code().unwrap_or(-1)), How::Signalled)
}

#[cfg(not(unix))]
fn how(status: std::process::ExitStatus) -> How {
    How::Exited(status.code().unwrap_or(-1))
}
