//! Writes and syncs that fail: the map is at the old version or the new one, whole, and takes the next change.

use crate::job::{Job, copy, jobs, sample};
use crate::observed::{Observed, run};
use crate::strace::{self, Fault};

/// Places of failure per command and fault.
const SAMPLED: usize = 10;

#[test]
fn a_writer_that_is_killed_leaves_the_old_version_or_the_new_one() {
    fails(Fault::Kill, SAMPLED);
}

#[test]
fn a_write_that_the_disk_refuses_leaves_the_old_version_or_the_new_one_and_is_told() {
    fails(Fault::Broken, SAMPLED);
}

#[test]
fn a_disk_that_is_full_leaves_the_old_version_or_the_new_one_and_is_told() {
    fails(Fault::Full, SAMPLED);
}

#[test]
#[ignore = "every write and sync of every command: minutes"]
fn every_write_may_be_the_last() {
    for fault in [Fault::Kill, Fault::Broken, Fault::Full] {
        fails(fault, usize::MAX);
    }
}

fn fails(fault: Fault, most: usize) {
    if !strace::is_there() {
        return;
    }
    for job in &jobs().all {
        let directory = tempfile::tempdir().unwrap();
        let calls = strace::run(job, &copy(&job.template, directory.path()), None).calls;
        assert!(calls > 10, "{} makes {calls} calls", job.command);
        let places = if most < calls { sample(calls, most) } else { (1..=calls).collect() };
        let (mut old, mut new) = (0, 0);
        for &nth in &places {
            if fails_at(job, fault, nth) { new += 1 } else { old += 1 }
        }
        println!("{fault:?} {}: {} of {calls} calls; old version {old}, new version {new}", job.command, places.len());
        assert!(old > 0, "{fault:?} {}: the first write decides nothing yet", job.command);
    }
}

/// Lets the `nth` call of `job` fail, and says whether the map is what it is when all goes well.
fn fails_at(job: &Job, fault: Fault, nth: usize) -> bool {
    let directory = tempfile::tempdir().unwrap();
    let map = copy(&job.template, directory.path());
    let done = strace::run(job, &map, Some((fault, nth)));
    let place = format!("{fault:?} at call {nth} of {}: {done:?}", job.command);
    let found = Observed::of(&map);
    assert!(found == job.before || found == job.after, "{place}: neither the old version nor the new one");
    let is_new = found == job.after;
    match done.code {
        None => assert_eq!(fault, Fault::Kill, "{place}"),
        Some(0) => assert!(is_new, "{place}: said to be done"),
        Some(code) => {
            // The map's disk: docs/cli.md.
            assert_eq!(code, 13, "{place}");
            let said = &done.messages;
            assert!(said.contains("map.rsv") && !said.contains("this is a bug"), "{place}");
            assert!(["disk is full", "the disk refused"].iter().any(|words| said.contains(words)), "{place}");
            assert!(!is_new || !said.contains("unchanged"), "{place}: said to be unchanged");
        }
    }
    let next = run("apply", &map, &[crate::common::path(&jobs().chair)]);
    assert_eq!((next.code, next.json["version"].as_u64()), (0, Some(found.head + 1)), "{place}: then {next:?}");
    is_new
}
