//! A write-ahead log that is cut, lost or left behind, as after a power cut or a careless copy.

use crate::common::path;
use crate::job::{Job, copy, jobs, sample};
use crate::observed::{Observed, run};
use crate::strace::{self, Fault};
use resurvey_core::store::MapFile;
use std::fs;
use std::path::{Path, PathBuf};

/// Versions in the log.
const LOGGED: usize = 3;
const SAMPLED: usize = 40;

/// A map with its log as an open writer leaves it, and what it was after each version in the log.
struct Logged {
    directory: tempfile::TempDir,
    map: Vec<u8>,
    log: Vec<u8>,
    /// The first is what it was before.
    steps: Vec<Observed>,
}

impl Logged {
    fn new() -> Self {
        let directory = tempfile::tempdir().unwrap();
        let map = copy(&jobs().eventful, directory.path());
        let mut steps = vec![Observed::of(&map)];
        // While somebody has it open, the log stays.
        let reader = MapFile::open(&map).unwrap();
        for _ in 0..LOGGED {
            let answer = run("apply", &map, &[path(&jobs().chair)]);
            assert_eq!(answer.code, 0, "{answer:?}");
            steps.push(Observed::of(&map));
        }
        let log = fs::read(log_of(&map)).unwrap();
        let bytes = fs::read(&map).unwrap();
        drop(reader);
        Self { directory, map: bytes, log, steps }
    }

    /// The map with another log.
    fn with_log(&self, log: &[u8]) -> PathBuf {
        let map = self.directory.path().join("cut.rsv");
        let _ = fs::remove_file(map.with_extension("rsv-shm"));
        fs::write(&map, &self.map).unwrap();
        fs::write(log_of(&map), log).unwrap();
        map
    }
}

fn log_of(map: &Path) -> PathBuf {
    map.with_extension("rsv-wal")
}

fn is_cut_anywhere(most: usize) {
    let logged = Logged::new();
    let whole = Observed::of(&logged.with_log(&logged.log));
    assert_eq!(whole, logged.steps[LOGGED], "the log holds all versions");
    let lengths =
        if most < logged.log.len() { sample(logged.log.len(), most) } else { (1..=logged.log.len()).collect() };
    let mut last = 0;
    for length in lengths {
        let found = Observed::of(&logged.with_log(&logged.log[..length - 1]));
        let step = logged.steps.iter().position(|step| *step == found);
        let step = step.unwrap_or_else(|| panic!("log of {length} bytes: no version of this map"));
        assert!(step >= last, "a longer log holds no less: {step} after {last}");
        last = step;
    }
    assert!(last > 0);
}

#[test]
fn a_log_that_is_cut_leaves_the_last_version_that_is_whole_in_it() {
    is_cut_anywhere(SAMPLED);
}

#[test]
#[ignore = "a log of every length: hours"]
fn a_log_that_is_cut_at_any_byte_leaves_the_last_version_that_is_whole_in_it() {
    is_cut_anywhere(usize::MAX);
}

#[test]
fn a_log_with_noise_in_it_leaves_a_version_before_the_noise() {
    let logged = Logged::new();
    for place in sample(logged.log.len(), SAMPLED) {
        let mut log = logged.log.clone();
        log[place - 1] ^= 0x10;
        let found = Observed::of(&logged.with_log(&log));
        assert!(logged.steps.contains(&found), "noise at byte {place}: no version of this map");
    }
}

#[test]
fn a_map_without_its_log_is_the_version_before() {
    let logged = Logged::new();
    let map = logged.with_log(&[]);
    fs::remove_file(log_of(&map)).unwrap();
    assert_eq!(Observed::of(&map), logged.steps[0]);
    // An empty one is none.
    assert_eq!(Observed::of(&logged.with_log(&[])), logged.steps[0]);
    assert!(!log_of(&map).exists(), "who reads takes it away");
    let next = run("apply", &map, &[path(&jobs().chair)]);
    assert_eq!(next.json["version"].as_u64(), Some(logged.steps[1].head), "{next:?}");
}

/// While the log is written back, the file alone is neither the old version nor the new one.
#[test]
fn a_map_copied_without_its_log_while_it_is_written_back_is_whole_or_found_damaged() {
    if !strace::is_there() {
        return;
    }
    let (mut whole, mut damaged) = (0, 0);
    for job in jobs().all.iter().filter(|job| ["apply", "revert", "update"].contains(&job.command)) {
        let calls = calls(job);
        for nth in calls.saturating_sub(14)..=calls {
            let directory = tempfile::tempdir().unwrap();
            let map = copy(&job.template, directory.path());
            strace::run(job, &map, Some((Fault::Kill, nth)));
            let _ = fs::remove_file(log_of(&map));
            let _ = fs::remove_file(map.with_extension("rsv-shm"));
            let place = format!("{} killed at call {nth}, log lost", job.command);
            let answer = run("fsck", &map, &[]);
            match answer.code {
                0 => {
                    let found = Observed::of(&map);
                    assert!(found.is(&job.before) || found.is(&job.after), "{place}: silently another map");
                    whole += 1;
                }
                13 => damaged += 1,
                _ => panic!("{place}: {answer:?}"),
            }
        }
    }
    println!("copied without the log: {whole} times whole, {damaged} times found to be damaged");
    assert!(whole > 0 && damaged > 0);
}

fn calls(job: &Job) -> usize {
    let directory = tempfile::tempdir().unwrap();
    strace::run(job, &copy(&job.template, directory.path()), None).calls
}
