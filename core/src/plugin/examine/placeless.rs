//! What a segmenter has of the services of a trial: no more than in a run.

use super::super::services::{Listener, Services};
use resurvey_schema::service::Level;

/// Whoever listens behind `Services`.
pub(super) struct Behind<'a>(pub &'a dyn Services);

impl Listener for Behind<'_> {
    fn log(&self, level: Level, text: &str) {
        self.0.log(level, text);
    }

    fn progress(&self, fraction: f64) {
        self.0.progress(fraction);
    }

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
