//! Crashes of plugins, by the digest of their file: what crashed twice is not started again.

use super::declaration::Fault;
use super::error::Stage;
use super::info::Digest;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Crashes after which a file is refused.
const MOST_CRASHES: usize = 2;

/// A file of the user with a line for every crash: digest, plugin, call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CrashLog {
    path: PathBuf,
}

impl CrashLog {
    /// The log at `path`, which need not be there yet.
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// The calls in which the file with this digest crashed, the first first.
    pub fn crashes(&self, sha256: Digest) -> Vec<String> {
        let text = std::fs::read_to_string(&self.path).unwrap_or_default();
        let of_file = text.lines().filter_map(|line| {
            let mut words = line.split_whitespace();
            let digest = words.next()?.parse::<Digest>().ok()?;
            (digest == sha256).then(|| words.nth(1).unwrap_or("a call").to_owned())
        });
        of_file.collect()
    }

    /// Whether it crashed so often that it is not started again.
    pub fn is_quarantined(&self, sha256: Digest) -> bool {
        self.crashes(sha256).len() >= MOST_CRASHES
    }

    /// Refuses a file that crashed too often, with what to do.
    pub(super) fn check(&self, sha256: Digest) -> Result<(), Fault> {
        let crashes = self.crashes(sha256);
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
        if self.crashes(sha256).is_empty() {
            return Ok(false);
        }
        let text = std::fs::read_to_string(&self.path)?;
        let digest = sha256.to_string();
        let kept = text.lines().filter(|line| !line.starts_with(&digest));
        let beside = self.path.with_extension("new");
        std::fs::write(&beside, kept.map(|line| format!("{line}\n")).collect::<String>())?;
        std::fs::rename(&beside, &self.path)?;
        Ok(true)
    }

    /// Adds a crash.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code))]
    pub(super) fn record(&self, sha256: Digest, plugin: &str, call: &str) -> io::Result<()> {
        if let Some(directory) = self.path.parent() {
            std::fs::create_dir_all(directory)?;
        }
        let mut file = std::fs::OpenOptions::new().create(true).append(true).open(&self.path)?;
        // One write, so that lines of several processes do not mix.
        file.write_all(format!("{sha256} {plugin} {call}\n").as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_crashes_are_enough_and_forgetting_clears_one_file_alone() {
        let directory = tempfile::tempdir().unwrap();
        let log = CrashLog::new(&directory.path().join("data/crashed-plugins"));
        let (one, other) = (Digest::of(b"one"), Digest::of(b"other"));
        assert!(log.crashes(one).is_empty());
        assert!(!log.forget(one).unwrap());
        log.record(one, "agreement", "score").unwrap();
        log.record(other, "agreement", "create").unwrap();
        assert!(!log.is_quarantined(one));
        log.record(one, "agreement", "destroy").unwrap();
        assert_eq!(log.crashes(one), ["score", "destroy"]);
        assert!(log.is_quarantined(one) && !log.is_quarantined(other));
        assert!(log.forget(one).unwrap());
        assert_eq!((log.crashes(one).len(), log.crashes(other)), (0, vec!["create".to_owned()]));
    }
}
