//! The other end of the wire: this program as the process of a plugin.

use super::fingerprint::Fingerprint;
use super::memory::SharedMemory;
use super::talk::{Ends, Talk};
use super::wire::{Silence, Wire};
use crate::plugin::declaration::{Fault, read_library};
use crate::plugin::error::Stage;
use crate::plugin::info::Digest;
use crate::plugin::instance::Instance;
use crate::plugin::open::{Code, Plugin};
use crate::plugin::settings::Settings;
use crate::plugin::{Kind, MatcherForm, PluginError};
use resurvey_schema::wire::{Hello, Invalid, Refused, ToHost, ToPlugin, WIRE_VERSION};
use rustix::process::{Resource, Rlimit, Signal, getppid, getrlimit, set_parent_process_death_signal, setrlimit};
use std::ffi::OsString;
use std::fs::File;
use std::io;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;

/// What this program was told to run.
struct Task {
    is_library: bool,
    memory_mib: u64,
    /// The process that asked for it.
    host: u32,
    fingerprint: String,
    path: PathBuf,
}

/// Becomes the process of a plugin: `arguments` are those after [`SERVE`](super::SERVE). Returns the exit code when the host
/// has ended the wire. It must be called before the program has started any thread.
pub fn serve(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    const NOT_STARTED: u8 = 1;
    match Task::read(arguments).ok_or_else(not_for_people).and_then(|task| run(&task)) {
        Ok(()) => 0,
        Err(error) => {
            // The pipe that the host listens to; without it nobody can be told.
            let _ = rustix::io::write(rustix::stdio::stderr(), format!("{error}\n").as_bytes());
            NOT_STARTED
        }
    }
}

fn not_for_people() -> io::Error {
    io::Error::other("this command is how resurvey starts a plugin in a process of its own; it is not for people")
}

impl Task {
    fn read(arguments: impl IntoIterator<Item = OsString>) -> Option<Self> {
        let arguments: Vec<OsString> = arguments.into_iter().collect();
        let [mode, memory_mib, host, fingerprint, path] = <[OsString; 5]>::try_from(arguments).ok()?;
        Some(Self {
            is_library: mode == "library",
            memory_mib: memory_mib.to_str()?.parse().ok()?,
            host: host.to_str()?.parse().ok()?,
            fingerprint: fingerprint.into_string().ok()?,
            path: path.into(),
        })
    }
}

fn run(task: &Task) -> io::Result<()> {
    limit(task)?;
    if !task.is_library {
        // Becomes the plugin, or says why it cannot.
        let fault = check_unchanged(task).err().unwrap_or_else(|| not_started(&Command::new(&task.path).exec()));
        take_descriptors()?.refuse(fault);
        return Ok(());
    }
    let mut ends = take_descriptors()?;
    match open(task) {
        Ok(plugin) => {
            let hello = hello(&plugin);
            converse(&plugin, ends, &hello);
        }
        Err(fault) => ends.refuse(fault),
    }
    Ok(())
}

fn not_started(error: &io::Error) -> Fault {
    let advice = "is the interpreter that its first line names there, and does the file run by itself?".to_owned();
    (Stage::File, format!("it cannot be started: {error}"), advice)
}

impl Ends {
    /// Says why there is no plugin, in place of its first words.
    fn refuse(&mut self, (stage, reason, advice): Fault) {
        let refused = Refused { stage: stage.to_string(), reason, advice };
        // Without a host nobody is to be told.
        let _ = self.wire.send(&ToHost::Refused(refused), || true);
    }
}

/// Ends with the host, leaves no dump of its memory, and takes no more than it may.
fn limit(task: &Task) -> io::Result<()> {
    set_parent_process_death_signal(Some(Signal::KILL))?;
    if getppid().is_none_or(|parent| parent.as_raw_nonzero().get().unsigned_abs() != task.host) {
        return Err(io::Error::other("the host has gone"));
    }
    at_most(Resource::Core, 0)?;
    if task.memory_mib > 0 {
        let bytes = task.memory_mib.saturating_mul(1 << 20);
        at_most(Resource::As, bytes)?;
        // A file in memory, such as the one that it shares with the host, is no address space until it is mapped.
        at_most(Resource::Fsize, bytes)?;
    }
    Ok(())
}

/// Limits a resource, which the system may have limited further: nobody may raise that.
fn at_most(resource: Resource, wanted: u64) -> io::Result<()> {
    let most = getrlimit(resource).maximum.map_or(wanted, |hard| hard.min(wanted));
    Ok(setrlimit(resource, Rlimit { current: Some(most), maximum: Some(most) })?)
}

/// Moves wire and memory out of the reach of a plugin that prints or reads.
fn take_descriptors() -> io::Result<Ends> {
    use rustix::io::fcntl_dupfd_cloexec;
    use rustix::stdio::{dup2_stdin, dup2_stdout, stderr, stdin, stdout};
    const ABOVE: i32 = 3;
    let memory = File::from(fcntl_dupfd_cloexec(stdin(), ABOVE)?);
    let wire = UnixStream::from(fcntl_dupfd_cloexec(stdout(), ABOVE)?);
    dup2_stdin(File::open("/dev/null")?)?;
    dup2_stdout(stderr())?;
    Ok(Ends { wire: Wire::patient(wire), memory: SharedMemory::open(memory)? })
}

fn open(task: &Task) -> Result<Plugin, Fault> {
    check_unchanged(task)?;
    let unreadable = |error: io::Error| (Stage::File, error.to_string(), "check path and permissions".to_owned());
    let declared = read_library(&std::fs::read(&task.path).map_err(unreadable)?)?;
    // The digest is the host's affair, which has read the file.
    Plugin::open(&task.path, declared, Digest::of(&[]))
}

/// The file must be the one that the host has read.
fn check_unchanged(task: &Task) -> Result<(), Fault> {
    let found = Fingerprint::of(&task.path);
    if found.is_ok_and(|found| found.as_str() == task.fingerprint) {
        return Ok(());
    }
    let reason = "it was changed between its check and its start".to_owned();
    Err((Stage::File, reason, "find out who changes the file, and try again".to_owned()))
}

fn hello(plugin: &Plugin) -> Hello {
    let info = plugin.info();
    let form = match plugin.code().form() {
        MatcherForm::Score => "score",
        MatcherForm::Search => "search",
    };
    Hello {
        wire: WIRE_VERSION,
        name: info.name.clone(),
        version: info.version.clone(),
        kind: info.kind.to_string(),
        summary: info.summary.clone(),
        form: (info.kind == Kind::Matcher).then(|| form.to_owned()),
        settings_schema: info.settings_schema.clone().unwrap_or_default(),
    }
}

/// Answers calls until the host ends the wire.
fn converse(plugin: &Plugin, ends: Ends, hello: &Hello) {
    let Ok(talk) = Talk::new(ends) else { return };
    if talk.say(&ToHost::Hello(hello.clone())).is_err() {
        return;
    }
    let mut instance = None;
    loop {
        let answer = match talk.hear() {
            Ok(ToPlugin::Create { settings }) => match create(plugin, settings) {
                Ok(made) => {
                    instance = Some(made);
                    ToHost::Done { localization: None }
                }
                Err(error) => refusal(error),
            },
            Ok(ToPlugin::Destroy {}) => {
                instance = None;
                ToHost::Done { localization: None }
            }
            Ok(call) => match &mut instance {
                Some(instance) => talk.call(instance, &call).unwrap_or_else(refusal),
                None => ToHost::Failed { text: "the host has a bug: it calls before it creates".to_owned() },
            },
            Err(Silence::Waiting) => continue,
            Err(_) => return,
        };
        if talk.say(&answer).is_err() {
            return;
        }
    }
}

fn create(plugin: &Plugin, settings: String) -> Result<Instance, PluginError> {
    match plugin.code() {
        Code::Here(table) => Instance::create(plugin.clone(), *table, &Settings::completed(settings)),
        Code::Apart(_) => Err(PluginError::Poisoned { plugin: plugin.info().name.clone() }),
    }
}

/// The end of a call without an answer.
fn refusal(error: PluginError) -> ToHost {
    match error {
        PluginError::Panicked { text, .. } => ToHost::Panicked { text },
        PluginError::Failed { text, .. } => ToHost::Failed { text },
        PluginError::Cancelled { .. } => ToHost::Cancelled {},
        PluginError::InvalidOutput { field, value, expected, .. } => {
            ToHost::Invalid(Invalid { field, value, expected })
        }
        other => ToHost::Failed { text: other.to_string() },
    }
}
