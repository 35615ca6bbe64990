//! Rates of the store: `cargo bench -p resurvey-core --bench store`, with numbers of features for those sizes alone
//! (`-- 200000`), or `-- --full` for 1 and 10 million (ten minutes, and 4 GB of disk).
//!
//! Medians of 101 warm runs by the clock, and means on a processor, which count where others use the machine too. The
//! temporary directory should be on the disk that is to be measured.

#[path = "store/banners.rs"]
mod banners;
#[path = "store/designs.rs"]
mod designs;
#[path = "store/writers.rs"]
mod writers;

use banners::{Random, new_map, now, side_m, square, transaction};
use designs::{Copy, Design};
use resurvey_core::store::{History, MapFile};
use resurvey_core::version::{BoxMm, Delta, Feature, FeatureState, Fid, VersionId};
use std::collections::BTreeSet;
use std::fmt;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

const RUNS: usize = 101;
/// The obvious design takes a hundred times as long.
const OBVIOUS_RUNS: usize = 7;
/// Of more features the copies in other designs would take too much of a disk.
const COMPARED: usize = 2_000_000;
/// A transaction holds its features in memory.
const LOADED_AT_ONCE: usize = 500_000;
const HOT_VERSIONS: u64 = 10_000;
const CHANGES: usize = 20;
/// Of the changes of a version, those in the hot square.
const HOT_SHARE: f64 = 0.9;
const WRITER_SECONDS: u64 = 10;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some((writers::WRITER, rest)) = arguments.split_first().map(|(first, rest)| (first.as_str(), rest)) {
        return writers::write(rest);
    }
    let mut sizes: Vec<usize> = arguments.iter().filter_map(|argument| argument.parse().ok()).collect();
    if sizes.is_empty() {
        sizes.push(1_000_000);
        sizes.extend(arguments.iter().any(|argument| argument == "--full").then_some(10_000_000));
    }
    let directory = tempfile::tempdir().expect("a temporary directory");
    println!("a write of 4 KiB and its sync alone: {}", sync(directory.path()));
    for features in sizes {
        measure(directory.path(), features);
    }
    println!("\ncommits of several processes to an empty map");
    for processes in [1, 8] {
        writers::measure(directory.path(), processes, WRITER_SECONDS);
    }
}

/// Where the features of one transaction of a load stand.
#[derive(Clone, Copy)]
enum Order {
    /// In a strip of the square, as a survey comes in tiles.
    Strips,
    /// Anywhere in it: each transaction changes nearly every cell of the index.
    Everywhere,
}

impl Order {
    /// From which share of the side to which, of the transaction that begins after `start` of `features`.
    fn strip(self, start: usize, count: usize, features: usize) -> [f64; 2] {
        match self {
            Self::Strips => [start, start + count].map(|end| end as f64 / features as f64),
            Self::Everywhere => [0.0, 1.0],
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Strips => "strip by strip",
            Self::Everywhere => "everywhere at once",
        }
    }
}

/// A map while it is measured.
struct Bench {
    map: MapFile,
    random: Random,
    side_m: f64,
    head: VersionId,
}

fn measure(directory: &Path, features: usize) {
    println!("\n{features} features");
    let strips = directory.join("strips.rsv");
    Bench::new(&strips, features).load(features, Order::Strips);
    std::fs::remove_file(&strips).expect("the map is removed");
    let mut bench = Bench::new(&directory.join(format!("{features}.rsv")), features);
    bench.load(features, Order::Everywhere);
    let first = bench.head;
    let elsewhere = square(bench.side_m, 0.25, 100.0);
    bench.region("100 m", &elsewhere, first);
    bench.commits();
    bench.hot_spot();
    let hot = square(bench.side_m, 0.5, 100.0);
    let middle = VersionId(u64::midpoint(first.0, bench.head.0));
    println!("  after {HOT_VERSIONS} versions of {CHANGES} changes, {:.0} % of them in one 100 m", HOT_SHARE * 100.0);
    let versions = [first, middle, bench.head];
    for version in versions {
        bench.region("100 m elsewhere", &elsewhere, version);
    }
    let here = versions.map(|version| bench.region("hot 100 m", &hot, version));
    for side in [50.0, 100.0] {
        let region = square(bench.side_m, 0.5, side);
        let (time, rows) = median(RUNS, || bench.map.changes(first, bench.head, Some(&region)).expect("changes").len());
        println!("    difference of the hot {side} m over {HOT_VERSIONS} versions: {time} for {rows} deltas");
    }
    let (time, rows) = median(RUNS, || bench.map.changes(first, bench.head, Some(&elsewhere)).expect("changes").len());
    println!("    difference of 100 m elsewhere: {time} for {rows} deltas");
    if features > COMPARED {
        return;
    }
    compare(&bench, directory, &versions.into_iter().zip(here).collect::<Vec<_>>(), &hot);
}

/// Asks other designs the same. Last: the bundled SQLite shares one page cache among the connections of a process.
fn compare(bench: &Bench, directory: &Path, here: &[(VersionId, (Times, usize))], region: &BoxMm) {
    let path = bench.map.path();
    for (name, design, runs) in [
        ("3-D R*Tree with version filter", Design::VersionFilter, OBVIOUS_RUNS),
        ("4-D R*Tree, a version as 1 mm", Design::FourthAxis { version_mm: 1 }, RUNS),
        ("4-D R*Tree, a version as 256 mm", Design::FourthAxis { version_mm: 256 }, RUNS),
    ] {
        let file = directory.join("other-design.db");
        let copy = Copy::of(path, &file, design);
        for (version, (time, rows)) in here {
            let (other, found) = median(runs, || copy.features_in(region, *version));
            assert_eq!(*rows, found, "all designs find the same");
            let ratio = other.cpu_s / time.cpu_s;
            println!("    {name} at version {}: {other}, {ratio:.1} times as long", version.0);
        }
        drop(copy);
        std::fs::remove_file(&file).expect("the copy is removed");
    }
}

impl Bench {
    fn new(path: &Path, features: usize) -> Self {
        Self { map: new_map(path), random: Random(7), side_m: side_m(features), head: VersionId(0) }
    }

    fn load(&mut self, features: usize, order: Order) {
        let (mut seconds, mut cpu_seconds) = (0.0, 0.0);
        for start in (0..features).step_by(LOADED_AT_ONCE) {
            let mut load = transaction(self.head);
            let count = LOADED_AT_ONCE.min(features - start);
            let strip = order.strip(start, count, features);
            load.additions = (0..count).map(|_| self.random.banner(self.side_m, strip)).collect();
            let (start, cpu_start) = (Instant::now(), cpu_s());
            self.head = self.map.commit(&load, now()).expect("a commit");
            seconds += start.elapsed().as_secs_f64();
            cpu_seconds += cpu_s() - cpu_start;
        }
        let each = self.bytes() as f64 / features as f64;
        let [wall, cpu] = [seconds, cpu_seconds].map(|seconds| features as f64 / seconds);
        let order = order.words();
        println!("  bulk load, {order}: {wall:.0} features/s, {cpu:.0} per second on a processor, {each:.0} B each");
    }

    fn commits(&mut self) {
        let before = self.bytes();
        let (time, _) = median(RUNS, || {
            let mut update = transaction(self.head);
            update.additions = (0..10).map(|_| self.random.banner(self.side_m, [0.0, 1.0])).collect();
            self.head = self.map.commit(&update, now()).expect("a commit");
            0
        });
        let growth = (self.bytes() - before) as f64 / (10 * RUNS) as f64;
        println!("  commit of 10 new ones, synced: {time}, {growth:.0} B each");
    }

    /// Commits [`HOT_VERSIONS`], most of whose changes lie in the same 100 m.
    fn hot_spot(&mut self) {
        let before = self.bytes();
        let live = |region: &BoxMm| -> Vec<(Fid, FeatureState)> {
            let found = self.map.snapshot(self.head).and_then(|snapshot| snapshot.features(Some(region)));
            found.expect("features").into_iter().map(|Feature { fid, state, .. }| (fid, state)).collect()
        };
        let mut hot = live(&square(self.side_m, 0.5, 100.0));
        let mut cold = live(&square(self.side_m, 0.1, 500.0));
        let in_hot: BTreeSet<Fid> = hot.iter().map(|(fid, _)| *fid).collect();
        cold.retain(|(fid, _)| !in_hot.contains(fid));
        let mut seconds = 0.0;
        for _ in 0..HOT_VERSIONS {
            let mut update = transaction(self.head);
            while update.deltas.len() < CHANGES {
                let place = if self.random.next() < HOT_SHARE { &mut hot } else { &mut cold };
                let which = self.random.index(place.len());
                let (fid, state) = &mut place[which];
                if update.deltas.iter().all(|delta| delta.fid() != *fid) {
                    let after = self.random.measured_again(state);
                    update.deltas.push(Delta::modify(*fid, std::mem::replace(state, after.clone()), after));
                }
            }
            let start = Instant::now();
            self.head = self.map.commit(&update, now()).expect("a commit");
            seconds += start.elapsed().as_secs_f64();
        }
        let growth = (self.bytes() - before) as f64 / (HOT_VERSIONS as usize * CHANGES) as f64;
        println!("  hot spot: {:.0} commits/s, {growth:.0} B a change", HOT_VERSIONS as f64 / seconds);
    }

    fn features_in(&self, region: &BoxMm, version: VersionId) -> usize {
        self.map.snapshot(version).and_then(|snapshot| snapshot.features(Some(region))).expect("features").len()
    }

    fn region(&self, name: &str, region: &BoxMm, version: VersionId) -> (Times, usize) {
        let (time, rows) = median(RUNS, || self.features_in(region, version));
        println!("    {name} at version {}: {time} for {rows} rows", version.0);
        (time, rows)
    }

    /// Size of the map when its log is written back.
    fn bytes(&self) -> u64 {
        let connection = rusqlite::Connection::open(self.map.path()).expect("the map opens");
        connection.query_row("PRAGMA wal_checkpoint(TRUNCATE)", [], |_| Ok(())).expect("a checkpoint");
        std::fs::metadata(self.map.path()).expect("the map").len()
    }
}

/// Seconds that this thread was on a processor, on Linux: on a shared machine it waits for one most of the time.
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|nanoseconds| nanoseconds.parse::<f64>().ok()).unwrap_or(f64::NAN) / 1e9
}

/// Median time by the clock, and mean on a processor: the system counts that in steps too long for a single run.
struct Times {
    wall_s: f64,
    cpu_s: f64,
}

impl fmt::Display for Times {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:.2} ms ({:.2} on a processor)", self.wall_s * 1e3, self.cpu_s * 1e3)
    }
}

/// Times of `runs`, and what the last one found.
fn median(runs: usize, mut run: impl FnMut() -> usize) -> (Times, usize) {
    let (mut wall_s, mut found, cpu_start) = (Vec::new(), 0, cpu_s());
    for _ in 0..runs {
        let start = Instant::now();
        found = run();
        wall_s.push(start.elapsed().as_secs_f64());
    }
    wall_s.sort_by(f64::total_cmp);
    (Times { wall_s: wall_s[runs / 2], cpu_s: (cpu_s() - cpu_start) / runs as f64 }, found)
}

/// Median time of the least that a synced commit can do.
fn sync(directory: &Path) -> Times {
    let mut file = File::create(directory.join("sync")).expect("a file");
    let write = || {
        file.write_all(&[7; 4096]).and_then(|()| file.sync_data()).expect("a synced write");
        0
    };
    median(RUNS, write).0
}
