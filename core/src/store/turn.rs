//! Turns of writers: one commits at a time, and nobody else meanwhile.
//!
//! SQLite before 3.51.3, and the bundled one is, can lose what was committed when one connection moves the log into the file
//! while another begins the log anew (<https://sqlite.org/wal.html#walresetbug>). It moves the log at the end of a commit,
//! so no two commits may overlap, ends included. The lock is one of the system on the log, which SQLite itself never locks;
//! it goes with the process that has it.

use super::error::{Fault, StoreError};
use std::fs::{self, File, TryLockError};
use std::path::Path;
use std::time::Duration;

const FIRST_PAUSE: Duration = Duration::from_micros(200);
const LONGEST_PAUSE: Duration = Duration::from_millis(5);

/// The lock by which the writers of a map take turns.
#[derive(Debug)]
pub(super) struct Turns(File);

/// A writer's turn, until it is dropped.
pub(super) struct Turn<'a>(&'a File);

impl Turns {
    /// Those of the map at `path`, which a connection of this process has read with a write-ahead log: the log stays as long
    /// as one has it open.
    pub(super) fn of(path: &Path) -> Result<Self, Fault> {
        // Links are followed, as SQLite does to find the log.
        let log = fs::canonicalize(path).map(|map| {
            let mut log = map.into_os_string();
            log.push("-wal");
            log
        });
        match log.and_then(File::open) {
            Ok(log) => Ok(Self(log)),
            Err(error) => Err(StoreError::NoWriteAheadLog { path: path.to_owned(), detail: error.to_string() }.into()),
        }
    }

    /// Waits for a turn, `patience` at most: then there is none.
    pub(super) fn take(&self, patience: Duration) -> Result<Option<Turn<'_>>, std::io::Error> {
        let (mut waited, mut pause) = (Duration::ZERO, FIRST_PAUSE);
        loop {
            match self.0.try_lock() {
                Ok(()) => return Ok(Some(Turn(&self.0))),
                Err(TryLockError::WouldBlock) if waited >= patience => return Ok(None),
                Err(TryLockError::WouldBlock) => std::thread::sleep(pause),
                Err(TryLockError::Error(error)) => return Err(error),
            }
            waited += pause;
            pause = (2 * pause).min(LONGEST_PAUSE);
        }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        // Of a lock that is held it does not fail; closing the log would free it too.
        let _ = self.0.unlock();
    }
}
