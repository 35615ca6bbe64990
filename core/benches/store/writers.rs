//! Several processes that commit to one map at once. A writer is this program with other arguments.

use super::banners::{Random, new_map, now, side_m, transaction};
use resurvey_core::store::{CommitError, History, MapFile, StoreError};
use resurvey_core::version::VersionId;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// First argument of a writer; the map, its number and the seconds follow.
pub const WRITER: &str = "--writer";
const ADDED: usize = 10;
/// Every so many commits one is sent again, as a phone without an answer does.
const SENT_AGAIN: u64 = 5;

/// Commits for some time and prints every version it made, then how often the map was busy for too long.
pub fn write(arguments: &[String]) {
    let [path, number, seconds] = <&[String; 3]>::try_from(arguments).expect("map, number and seconds");
    let map = MapFile::open(Path::new(path)).expect("the map opens");
    let number: u64 = number.parse().expect("a number");
    let end = Instant::now() + Duration::from_secs_f64(seconds.parse().expect("seconds"));
    let (mut random, mut sent, mut busy) = (Random(number + 1), 0_u64, 0);
    while Instant::now() < end {
        let mut update = transaction(map.head().expect("a head"));
        update.additions = (0..ADDED).map(|_| random.banner(side_m(100_000), [0.0, 1.0])).collect();
        update.idempotency_key = Some(format!("{number}-{sent}"));
        let made = loop {
            match map.commit(&update, now()) {
                Ok(version) => break version,
                Err(error) => {
                    assert!(matches!(error, CommitError::Store(StoreError::Busy { .. })), "{error}");
                    busy += 1;
                }
            }
        };
        if sent.is_multiple_of(SENT_AGAIN) {
            assert_eq!(map.commit(&update, now()), Ok(made), "the same key makes the same version");
        }
        sent += 1;
        println!("{}", made.0);
    }
    println!("busy {busy}");
}

/// Lets `writers` processes commit for `seconds`, and checks that nothing was lost or doubled.
pub fn measure(directory: &Path, writers: usize, seconds: u64) {
    let path = directory.join(format!("writers-{writers}.rsv"));
    let map = new_map(&path);
    let this = std::env::current_exe().expect("this program");
    let start = Instant::now();
    let children: Vec<_> = (0..writers)
        .map(|number| {
            let mut command = Command::new(&this);
            command.args([WRITER.as_ref(), path.as_os_str()]).args([number.to_string(), seconds.to_string()]);
            command.stdout(Stdio::piped()).spawn().expect("a writer starts")
        })
        .collect();
    let (mut made, mut busy) = (Vec::new(), 0);
    for child in children {
        let output = child.wait_with_output().expect("a writer ends");
        assert!(output.status.success(), "a writer failed");
        for line in String::from_utf8(output.stdout).expect("text").lines() {
            match line.strip_prefix("busy ") {
                Some(count) => busy += count.parse::<u64>().expect("a count"),
                None => made.push(line.parse::<u64>().expect("a version")),
            }
        }
    }
    let rate = made.len() as f64 / start.elapsed().as_secs_f64();
    let distinct: BTreeSet<u64> = made.iter().copied().collect();
    assert_eq!(distinct.len(), made.len(), "a version was made twice");
    let head = map.head().expect("a head");
    assert_eq!(head, VersionId(made.len() as u64), "a commit was lost or doubled");
    let features = map.snapshot(head).and_then(|snapshot| snapshot.features(None)).expect("features");
    assert_eq!(features.len(), ADDED * made.len(), "a feature was lost or doubled");
    assert_eq!(map.fsck(), Ok(Vec::new()));
    println!(
        "  {writers} processes for {seconds} s: {} commits of {ADDED}, {rate:.0}/s, busy {busy} times; head is the \
         number of commits, fsck finds nothing",
        made.len()
    );
}
