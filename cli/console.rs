//! Where results and messages go: results to standard output, everything else to standard error.

use crate::failure::Failure;
use crate::interrupt::Interrupt;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};
use resurvey_core::localize::Listener;
use resurvey_schema::service::Level;
use serde::Serialize;
use std::io::Write;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The two streams of one run.
pub struct Console<'a> {
    out: &'a mut dyn Write,
    err: &'a mut dyn Write,
    is_json: bool,
    shows_progress: bool,
    interrupt: Interrupt,
    done: Vec<String>,
}

impl<'a> Console<'a> {
    /// A console; `is_json` is the `--json` option.
    pub fn new(out: &'a mut dyn Write, err: &'a mut dyn Write, is_json: bool, shows_progress: bool) -> Self {
        Self { out, err, is_json, shows_progress, interrupt: Interrupt::default(), done: Vec::new() }
    }

    /// Lets `interrupt` end what [`listens`](Self::listen).
    pub fn interrupted_by(self, interrupt: Interrupt) -> Self {
        Self { interrupt, ..self }
    }

    /// From now on the command ends by itself where the user asks for it, and not in the middle of something.
    pub fn listen(&self) {
        self.interrupt.listen();
    }

    /// An error where the user has asked to end.
    pub fn go_on(&self) -> Result<(), Failure> {
        if self.interrupt.is_asked() { Err(Failure::interrupted("before the next step")) } else { Ok(()) }
    }

    /// Whether results are JSON.
    pub fn is_json(&self) -> bool {
        self.is_json
    }

    /// Standard output.
    pub fn out(&mut self) -> &mut dyn Write {
        self.out
    }

    /// Prints one JSON document.
    pub fn document(&mut self, document: &impl Serialize) -> Result<(), Failure> {
        serde_json::to_writer_pretty(&mut *self.out, document).map_err(std::io::Error::from)?;
        Ok(writeln!(self.out)?)
    }

    /// Prints a line of a result.
    pub fn line(&mut self, text: impl std::fmt::Display) -> Result<(), Failure> {
        Ok(writeln!(self.out, "{text}")?)
    }

    /// Tells the user something that is not a result. A closed standard error is nobody's loss.
    pub fn message(&mut self, text: &str) {
        let _ = writeln!(self.err, "{text}");
    }

    /// Notes what is on disk now, for a user who cannot be told the result.
    pub fn did(&mut self, what: impl std::fmt::Display) {
        self.done.push(what.to_string());
    }

    /// What was noted.
    pub fn take_done(self) -> Vec<String> {
        self.done
    }

    /// A stage with a progress bar, when standard error is a terminal.
    pub fn stage(&self, name: &'static str) -> Stage {
        let target = if self.shows_progress { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(1000), target).with_message(name);
        // What ends early leaves no bar behind.
        let bar = bar.with_finish(ProgressFinish::AndClear);
        let style = ProgressStyle::with_template("{msg:10} [{bar:40}] {percent:3} % {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
        if self.shows_progress {
            bar.enable_steady_tick(Duration::from_millis(200));
        }
        Stage { bar, lines: Mutex::default(), start: Instant::now(), interrupt: self.interrupt.clone() }
    }

    /// Ends `stage`, prints what plugins said in it, and returns its duration in milliseconds.
    pub fn finish(&mut self, stage: &Stage) -> f64 {
        stage.bar.finish_and_clear();
        let lines = std::mem::take(&mut *stage.lines.lock().unwrap_or_else(PoisonError::into_inner));
        for line in lines {
            self.message(&line);
        }
        milliseconds(stage.start.elapsed())
    }
}

/// Milliseconds, to the microsecond.
pub fn milliseconds(duration: Duration) -> f64 {
    (duration.as_secs_f64() * 1e6).round() / 1e3
}

/// One stage of a run; hears what plugins say and how far they are.
pub struct Stage {
    bar: ProgressBar,
    lines: Mutex<Vec<String>>,
    start: Instant,
    interrupt: Interrupt,
}

impl Listener for Stage {
    fn log(&self, level: Level, text: &str) {
        if level != Level::Debug {
            // What a plugin says is shown, and does not speak to the terminal.
            let text = text.replace(char::is_control, " ");
            let line = if level == Level::Warning { format!("warning: {text}") } else { text };
            self.lines.lock().unwrap_or_else(PoisonError::into_inner).push(line);
        }
    }

    fn progress(&self, fraction: f64) {
        self.bar.set_position((fraction.clamp(0.0, 1.0) * 1000.0) as u64);
    }

    fn cancelled(&self) -> bool {
        self.interrupt.is_asked()
    }
}
