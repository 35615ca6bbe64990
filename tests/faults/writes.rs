//! Writes and syncs that fail: the map is at the old version or the new one, whole, and takes the next change.

use crate::job::{Job, copy, jobs};
use crate::observed::{Observed, run};
use crate::strace::{self, Fault};

#[test]
fn a_writer_that_is_killed_leaves_the_old_version_or_the_new_one() {
    fails(Fault::Kill);
}

#[test]
fn a_write_that_the_disk_refuses_leaves_the_old_version_or_the_new_one_and_is_told() {
    fails(Fault::Broken);
}

#[test]
fn a_disk_that_is_full_leaves_the_old_version_or_the_new_one_and_is_told() {
    fails(Fault::Full);
}

/// Lets every write and sync of every command fail in turn: 420 places.
fn fails(fault: Fault) {
    if !strace::is_there() {
        return;
    }
    for job in &jobs().all {
        let directory = tempfile::tempdir().unwrap();
        let calls = strace::run(job, &copy(&job.template, directory.path()), None).calls;
        assert!(calls > 10, "{} makes {calls} calls", job.command);
        let (mut old, mut new) = (0, 0);
        for nth in 1..=calls {
            if fails_at(job, fault, nth) { new += 1 } else { old += 1 }
        }
        println!("{fault:?} {}: {calls} calls; old version {old}, new version {new}", job.command);
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
    let is_new = found.is(&job.after);
    assert!(is_new || found.is(&job.before), "{place}: neither the old version nor the new one");
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
