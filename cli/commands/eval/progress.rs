//! How far a run over captures is, several of them at a time.

use crate::console::Stage;
use resurvey_core::localize::Listener;
use resurvey_schema::service::Level;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

/// Parts that a capture is counted in.
const PARTS: f64 = 1000.0;

/// The bar of a run, and what plugins say of its captures.
pub struct Progress {
    /// How much of each capture is done, of [`PARTS`].
    done: Vec<AtomicU32>,
    /// Warnings about each capture.
    warnings: Vec<Mutex<Vec<String>>>,
}

impl Progress {
    /// Nothing yet of this many captures.
    pub fn new(captures: usize) -> Self {
        let done = std::iter::repeat_with(AtomicU32::default).take(captures).collect();
        Self { done, warnings: std::iter::repeat_with(Mutex::default).take(captures).collect() }
    }

    /// Hands the warnings on, capture by capture: their order says nothing of which one was done first.
    pub fn tell(&self, stage: &Stage) {
        for warnings in &self.warnings {
            for warning in warnings.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
                stage.log(Level::Warning, &warning);
            }
        }
    }

    fn share(&self) -> f64 {
        let sum: f64 = self.done.iter().map(|done| f64::from(done.load(Ordering::Relaxed))).sum();
        sum / (PARTS * self.done.len().max(1) as f64)
    }
}

/// The part of a run that one matcher on one capture is.
pub struct Portion<'a> {
    /// The whole run.
    pub progress: &'a Progress,
    /// Its bar.
    pub stage: &'a Stage,
    /// Which capture.
    pub capture: usize,
    /// Where it begins within the capture, 0–1.
    pub start: f64,
    /// Its part of the capture, 0–1.
    pub share: f64,
    /// Capture and matcher.
    pub place: String,
}

impl Listener for Portion<'_> {
    fn log(&self, level: Level, text: &str) {
        if level == Level::Warning
            && let Some(warnings) = self.progress.warnings.get(self.capture)
        {
            let line = format!("{}: {text}", self.place);
            warnings.lock().unwrap_or_else(PoisonError::into_inner).push(line);
        }
    }

    fn progress(&self, fraction: f64) {
        if let Some(done) = self.progress.done.get(self.capture) {
            // A second search of the same capture begins anew, the bar does not.
            let parts = PARTS * (self.start + self.share * fraction.clamp(0.0, 1.0));
            done.fetch_max(parts as u32, Ordering::Relaxed);
            self.stage.progress(self.progress.share());
        }
    }

    fn cancelled(&self) -> bool {
        false
    }
}
