//! Crashes of plugins, by the digest of their file: what crashed in two runs is not started again.

use super::declaration::Fault;
use super::error::Stage;
use super::info::Digest;
use super::user_file::{edit_lines, read_lines};
use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Crashes after which a file is refused.
const MOST_CRASHES: usize = 2;

/// A file of the user with a line for every crash: digest, plugin, call.
#[derive(Clone, Debug)]
pub struct CrashLog {
    path: PathBuf,
    /// What crashed in this run: several instances that meet one bug have crashed once.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code))]
    counted: Arc<Mutex<HashSet<Digest>>>,
}

impl CrashLog {
    /// The log at `path`, which need not be there yet, for one run; its clones belong to the same run.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), counted: Arc::default() }
    }

    /// The calls in which the file with this digest crashed, the first first.
    pub fn crashes(&self, sha256: Digest) -> io::Result<Vec<String>> {
        let lines = read_lines(&self.path)?;
        let of_file = lines.iter().filter(|line| digest_of(line) == Some(sha256));
        Ok(of_file.map(|line| line.split_whitespace().nth(2).unwrap_or("a call").to_owned()).collect())
    }

    /// Whether it crashed so often that it is not started again.
    pub fn is_quarantined(&self, sha256: Digest) -> io::Result<bool> {
        Ok(self.crashes(sha256)?.len() >= MOST_CRASHES)
    }

    /// Refuses a file that crashed too often, or of which nobody can say, with what to do.
    pub(super) fn check(&self, sha256: Digest) -> Result<(), Fault> {
        let crashes = self.crashes(sha256).map_err(|error| {
            let log = self.path.display();
            let advice = format!("make {log} readable, or remove it, which trusts every plugin again");
            (Stage::Quarantine, format!("the log of crashes {log} cannot be read: {error}"), advice)
        })?;
        if crashes.len() < MOST_CRASHES {
            return Ok(());
        }
        let calls = crashes.join(" and ");
        let advice = format!(
            "\"resurvey plugins remove {sha256}\" takes it away, \"resurvey plugins install FILE\" trusts it again"
        );
        let reason = format!("its process crashed {} times, in {calls}", crashes.len());
        Err((Stage::Quarantine, reason, advice))
    }

    /// Forgets the crashes of a file, because its user trusts it again or has removed it; gives whether there were any.
    pub fn forget(&self, sha256: Digest) -> io::Result<bool> {
        if self.crashes(sha256)?.is_empty() {
            return Ok(false);
        }
        edit_lines(&self.path, |lines| lines.retain(|line| digest_of(line) != Some(sha256)))?;
        Ok(true)
    }

    /// Adds a crash, unless one of the file was added in this run.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code))]
    pub(super) fn record(&self, sha256: Digest, plugin: &str, call: &str) -> io::Result<()> {
        let is_first = self.counted.lock().unwrap_or_else(std::sync::PoisonError::into_inner).insert(sha256);
        if !is_first {
            return Ok(());
        }
        edit_lines(&self.path, |lines| lines.push(format!("{sha256} {plugin} {call}")))
    }
}

fn digest_of(line: &str) -> Option<Digest> {
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crashes_in_two_runs_are_enough_and_forgetting_clears_one_file_alone() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("data/crashed-plugins");
        let run = || CrashLog::new(&path);
        let (one, other) = (Digest::of(b"one"), Digest::of(b"other"));
        assert!(run().crashes(one).unwrap().is_empty());
        assert!(!run().forget(one).unwrap());
        run().record(one, "agreement", "score").unwrap();
        run().record(other, "agreement", "create").unwrap();
        assert!(!run().is_quarantined(one).unwrap());
        run().record(one, "agreement", "destroy").unwrap();
        assert_eq!(run().crashes(one).unwrap(), ["score", "destroy"]);
        assert!(run().is_quarantined(one).unwrap() && !run().is_quarantined(other).unwrap());
        assert!(run().forget(one).unwrap());
        assert_eq!(run().crashes(one).unwrap().len(), 0);
        assert_eq!(run().crashes(other).unwrap(), ["create"]);
    }

    #[test]
    fn one_bug_that_several_instances_of_a_run_meet_is_one_crash() {
        let directory = tempfile::tempdir().unwrap();
        let log = CrashLog::new(&directory.path().join("crashed-plugins"));
        let sha256 = Digest::of(b"one");
        for of_a_job in [log.clone(), log.clone(), log.clone()] {
            of_a_job.record(sha256, "agreement", "score").unwrap();
        }
        assert_eq!(log.crashes(sha256).unwrap(), ["score"]);
    }

    #[test]
    fn a_log_that_cannot_be_read_does_not_mean_that_nothing_crashed() {
        let directory = tempfile::tempdir().unwrap();
        let log = CrashLog::new(directory.path());
        let (stage, reason, advice) = log.check(Digest::of(b"one")).unwrap_err();
        assert_eq!(stage, Stage::Quarantine);
        assert!(reason.contains("cannot be read") && advice.contains("readable"), "{reason} {advice}");
    }
}
