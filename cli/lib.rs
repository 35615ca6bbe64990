//! The command line of resurvey as a library, so that examples and tests run what users run.
#![forbid(unsafe_code)]

mod args;
mod commands;
mod conflict;
mod console;
mod document;
mod failure;
mod interrupt;
mod matching;
mod out_file;
mod output;
mod plain;
mod prior;
mod region;
mod report;
mod request;
mod segment;
mod tools;

use args::{Cli, Command};
use clap::Parser;
use commands::{
    apply, changes, diff, eval, evidence, export, fsck, gc, generate, import, init, localize, log, plugins, proposals,
    query, render, replay, revert, tag, update,
};
use console::Console;
use failure::{Failure, INPUT, INTERRUPTED, USAGE};
pub use interrupt::Interrupt;
use output::Output;
use plain::plain_lines;
use std::ffi::OsString;
use std::io::Write;
use std::path::PathBuf;

/// Runs one command line, `args[0]` being the program's name, and returns the exit code that `docs/cli.md` documents.
pub fn run<I>(args: I, out: &mut dyn Write, err: &mut dyn Write) -> u8
where
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    run_as(Host::default(), args, out, err)
}

/// What the program around a command line knows of itself.
#[derive(Clone, Debug, Default)]
pub struct Host {
    /// Whether progress bars go to standard error.
    pub shows_progress: bool,
    /// The `resurvey` program, which runs plugins from files in processes of their own; without it they are refused.
    pub program: Option<PathBuf>,
    /// How the user ends a run before it has ended.
    pub interrupt: Interrupt,
}

/// The same, for a program that says more of itself.
pub fn run_as<I>(host: Host, args: I, out: &mut dyn Write, err: &mut dyn Write) -> u8
where
    I: IntoIterator,
    I::Item: Into<OsString> + Clone,
{
    let mut cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => return explain(&error, out, err),
    };
    cli.plugins.program = host.program;
    let interrupt = host.interrupt;
    let mut output = Output::new(out);
    let mut console = Console::new(&mut output, err, cli.json, host.shows_progress).interrupted_by(interrupt.clone());
    let result = dispatch(&cli, &mut console)
        .map_err(|failure| match failure.code() {
            code if interrupt.is_asked() && code != INTERRUPTED => Failure::interrupted(failure),
            _ => failure,
        })
        .map_err(|failure| tell(failure, &mut console));
    let done = console.take_done();
    exit_code(result, &done, output, err)
}

/// Prints the document of a failure that has one, for machines.
fn tell(mut failure: Failure, console: &mut Console<'_>) -> Failure {
    match failure.take_document().filter(|_| console.is_json()) {
        Some(document) => console.document(&document).err().unwrap_or(failure),
        None => failure,
    }
}

/// The code of a result; says on standard error why it is none, and what was `done` where `output` could not say it. A
/// closed standard error is nobody's loss.
fn exit_code(result: Result<u8, Failure>, done: &[String], mut output: Output<'_>, err: &mut dyn Write) -> u8 {
    let code = result.unwrap_or_else(|failure| {
        // On a terminal what came of the run stands before why it ended. This stream tells its failures at its end.
        let _ = output.flush();
        let _ = writeln!(err, "resurvey: {}", plain_lines(&failure.to_string()));
        failure.code()
    });
    let Err(error) = output.finish() else { return code };
    let done: String = done.iter().map(|done| format!("{done}; ")).collect();
    let _ = writeln!(err, "resurvey: {done}standard output: {error}");
    if code == 0 { INPUT } else { code }
}

/// Prints help to standard output, a usage error to standard error.
fn explain(error: &clap::Error, out: &mut dyn Write, err: &mut dyn Write) -> u8 {
    let text = error.render();
    if error.use_stderr() {
        let _ = write!(err, "{text}");
        return USAGE;
    }
    let mut output = Output::new(out);
    let written = write!(output, "{text}");
    exit_code(written.map(|()| 0).map_err(Failure::from), &[], output, err)
}

fn dispatch(cli: &Cli, console: &mut Console<'_>) -> Result<u8, Failure> {
    match &cli.command {
        Command::Init(options) => init::run(options, console),
        Command::Import(options) => import::run(options, console),
        Command::Localize(options) => localize::run(options, &cli.plugins, console),
        Command::Render(options) => render::run(options, console),
        Command::Update(options) => update::run(options, &cli.plugins, console),
        Command::Query(options) => query::run(options, console),
        Command::Log(options) => log::run(options, console),
        Command::Diff(options) => diff::run(options, console),
        Command::Replay(options) => replay::run(options, &cli.plugins, console),
        Command::Revert(options) => revert::run(options, console),
        Command::Tag(options) => tag::run(options, console),
        Command::Why(options) => evidence::run(options, console),
        Command::Proposals(options) => proposals::run(options, console),
        Command::Changes(options) => changes::run(options, console),
        Command::Apply(options) => apply::run(options, console),
        Command::Export(options) => export::run(options, console),
        Command::Eval(options) => eval::run(options, &cli.plugins, console),
        Command::Plugins(command) => plugins::run(command, &cli.plugins, console),
        Command::Fsck(options) => fsck::run(options, console),
        Command::Gc(options) => gc::run(options, console),
        Command::Completions(options) => generate::completions(options, console),
        Command::Man(options) => generate::man(options, console),
    }
}
