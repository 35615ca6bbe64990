//! The process of a plugin: started, watched, ended with all it has started.

use super::Isolation;
use super::memory::SharedMemory;
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process, kill_process_group, waitid};
use std::ffi::OsStr;
use std::io::{self, Read};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, mpsc};
use std::time::{Duration, Instant};

/// The first argument of this program when it is to be the process of a plugin.
pub const SERVE: &str = "serve-plugin";

/// Time for a process whose wire has ended to end itself, so that it can be said how.
const LEAVING: Duration = Duration::from_millis(500);
/// Time for the last words to arrive after the end.
const HEARING: Duration = Duration::from_millis(100);
/// Bytes of the last words that are kept, and shown.
const KEPT_WORDS: usize = 4096;
const SHOWN_WORDS: usize = 300;

/// A running process.
#[derive(Debug)]
pub(super) struct Child {
    process: std::process::Child,
    words: Arc<Mutex<Words>>,
    is_ended: bool,
}

/// What the process wrote to descriptor 2.
#[derive(Debug, Default)]
struct Words {
    last: Vec<u8>,
    is_closed: bool,
}

impl Child {
    /// Starts the program of `isolation` for the plugin file at `path`, with its end of the wire and the memory.
    pub(super) fn start(
        isolation: &Isolation,
        arguments: &[&OsStr],
        wire: UnixStream,
        memory: &SharedMemory,
    ) -> io::Result<Self> {
        let Some(program) = &isolation.program else {
            return Err(io::Error::other("this program has not said which program runs plugins"));
        };
        let mut command = Command::new(program);
        command
            .arg(SERVE)
            .args(arguments)
            .process_group(0)
            .stdin(Stdio::from(OwnedFd::from(memory.file()?)))
            .stdout(Stdio::from(OwnedFd::from(wire)))
            .stderr(Stdio::piped());
        let process = spawn(command)?;
        // From here on an error ends the process, because it drops the child.
        let mut child = Self { process, words: Arc::default(), is_ended: false };
        if let Some(pipe) = child.process.stderr.take() {
            let words = Arc::clone(&child.words);
            std::thread::Builder::new().name("plugin words".to_owned()).spawn(move || listen(pipe, &words))?;
        }
        Ok(child)
    }

    /// Waits for a process that has closed its wire, ends it, and says how it went.
    pub(super) fn autopsy(&mut self) -> String {
        let started = Instant::now();
        while !self.has_left() && started.elapsed() < LEAVING {
            std::thread::sleep(Duration::from_millis(1));
        }
        let has_left = self.has_left();
        let status = self.end();
        let how = match status.filter(|_| has_left) {
            Some(status) => describe(status),
            None => "its process closed the wire and went on".to_owned(),
        };
        format!("{how}{}", self.last_words())
    }

    /// Whether the process has ended; it stays to be waited for, so that its number is not given to another.
    pub(super) fn has_left(&self) -> bool {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        self.group().is_none_or(|pid| !matches!(waitid(WaitId::Pid(pid), options), Ok(None)))
    }

    /// The number of the process, which is that of its group.
    fn group(&self) -> Option<Pid> {
        i32::try_from(self.process.id()).ok().and_then(Pid::from_raw)
    }

    /// The last line that the process wrote, as part of a sentence.
    pub(super) fn last_words(&self) -> String {
        let started = Instant::now();
        loop {
            let words = self.words.lock().unwrap_or_else(PoisonError::into_inner);
            if words.is_closed || started.elapsed() > HEARING {
                return quoted(&words.last);
            }
            drop(words);
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Kills the process and its group and waits for its end.
    pub(super) fn end(&mut self) -> Option<ExitStatus> {
        if self.is_ended {
            return None;
        }
        self.is_ended = true;
        // The number is still that of process and group: nobody has waited for the process yet, which may have gone to
        // another group.
        if let Some(group) = self.group() {
            let _ = kill_process_group(group, Signal::KILL);
            let _ = kill_process(group, Signal::KILL);
        }
        self.process.wait().ok()
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        self.end();
    }
}

/// A thread that starts all processes and never ends: on Linux the signal that a process gets when its parent dies comes
/// when the *thread* that started it does.
fn spawn(command: Command) -> io::Result<std::process::Child> {
    type Job = (Command, mpsc::Sender<io::Result<std::process::Child>>);
    static STARTER: OnceLock<mpsc::Sender<Job>> = OnceLock::new();
    let starter = STARTER.get_or_init(|| {
        let (sender, jobs) = mpsc::channel::<Job>();
        // Without the thread the channel is closed, which is said below.
        let _ = std::thread::Builder::new().name("plugin starter".to_owned()).spawn(move || {
            for (mut command, answer) in jobs {
                let _ = answer.send(command.spawn());
            }
        });
        sender
    });
    let gone = || io::Error::other("the thread that starts plugins is gone");
    let (sender, answer) = mpsc::channel();
    starter.send((command, sender)).map_err(|_| gone())?;
    answer.recv().map_err(|_| gone())?
}

/// Keeps the end of what comes through `pipe`.
fn listen(mut pipe: impl Read, words: &Mutex<Words>) {
    let mut chunk = [0; KEPT_WORDS];
    loop {
        let read = pipe.read(&mut chunk);
        let mut words = words.lock().unwrap_or_else(PoisonError::into_inner);
        match read {
            Ok(bytes) if bytes > 0 => {
                words.last.extend_from_slice(&chunk[..bytes]);
                let excess = words.last.len().saturating_sub(KEPT_WORDS);
                words.last.drain(..excess);
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            _ => {
                words.is_closed = true;
                return;
            }
        }
    }
}

fn quoted(words: &[u8]) -> String {
    let text = String::from_utf8_lossy(words);
    let line = text.trim().replace(|letter: char| letter.is_control(), " ");
    if line.is_empty() {
        return String::new();
    }
    let skipped = line.chars().count().saturating_sub(SHOWN_WORDS);
    let dots = if skipped > 0 { "…" } else { "" };
    format!("; its last words: {dots}{}", line.chars().skip(skipped).collect::<String>())
}

fn describe(status: ExitStatus) -> String {
    match (status.signal(), status.code()) {
        (Some(signal), _) => format!("its process was ended by signal {signal}{}", signal_name(signal)),
        (None, Some(code)) => format!("its process left with exit code {code}"),
        (None, None) => "its process ended".to_owned(),
    }
}

fn signal_name(signal: i32) -> &'static str {
    match Signal::from_named_raw(signal) {
        Some(Signal::ABORT) => " (SIGABRT: it aborted; where memory was short, --plugin-memory MIB gives it more)",
        Some(Signal::SEGV) => " (SIGSEGV: it used memory that is not its own)",
        Some(Signal::BUS) => " (SIGBUS)",
        Some(Signal::FPE) => " (SIGFPE)",
        Some(Signal::ILL) => " (SIGILL)",
        Some(Signal::KILL) => " (SIGKILL: somebody, perhaps the system for want of memory, killed it)",
        Some(Signal::TERM) => " (SIGTERM)",
        Some(Signal::SYS) => " (SIGSYS)",
        Some(Signal::XFSZ) => " (SIGXFSZ)",
        _ => "",
    }
}
