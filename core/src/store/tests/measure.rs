//! Figures for docs/file-format.md: `cargo test --release -p resurvey-core --lib -- --ignored --nocapture the_store_at`.

use super::*;
use crate::version::{BoxMm, Delta};
use std::time::{Duration, Instant};

const FEATURES: usize = 200_000;
/// Side of the square they stand in, metres: 724 of them in 100 m × 100 m.
const SIDE_M: f64 = 1662.0;
const HOT_VERSIONS: u64 = 2000;
const CHANGES: usize = 20;

/// Pseudo-random numbers in 0…1 (Marsaglia's xorshift), the same in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn banner(&mut self, side_m: f64) -> FeatureState {
        let (e, n) = (836_000.0 + side_m * self.next(), 818_000.0 + side_m * self.next());
        let corner = |de, dh| GridPoint::new(e + de, n, 8.0 + dh);
        FeatureState::Descriptor(Descriptor::Material(MaterialDescriptor {
            class: ClassId(3),
            corners: [corner(0.0, 0.0), corner(3.0, 0.0), corner(3.0, 2.0), corner(0.0, 2.0)],
            normal: [0.0, -1.0, 0.0],
            sigma: Some(Uncertainty { position_m: 0.1, size_m: Some(0.1), area_m2: Some(0.3) }),
        }))
    }
}

/// Median of 101 runs.
fn median(mut run: impl FnMut() -> usize) -> (Duration, usize) {
    let mut rows = 0;
    let mut times: Vec<Duration> = (0..101)
        .map(|_| {
            let start = Instant::now();
            rows = run();
            start.elapsed()
        })
        .collect();
    times.sort_unstable();
    (times[50], rows)
}

fn square(side_m: f64) -> BoxMm {
    let (e, n) = (836_000.0 + (SIDE_M - side_m) / 2.0, 818_000.0 + (SIDE_M - side_m) / 2.0);
    BoxMm::of_plan(e, n, e + side_m, n + side_m).unwrap()
}

fn bytes(scratch: &Scratch) -> u64 {
    scratch.map.connection.execute_batch("PRAGMA wal_checkpoint(TRUNCATE)").unwrap_or(());
    std::fs::metadata(scratch.map.path()).unwrap().len()
}

#[test]
#[ignore = "prints figures; takes a minute"]
fn the_store_at_200_000_descriptors() {
    let (scratch, mut random) = (Scratch::new(), Random(7));
    let mut load = transaction(0);
    load.additions = (0..FEATURES).map(|_| random.banner(SIDE_M)).collect();
    let start = Instant::now();
    scratch.map.commit(&load, at(1)).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let loaded = bytes(&scratch);
    println!("bulk load: {:.0} features/s, {} B each", FEATURES as f64 / seconds, loaded / FEATURES as u64);

    for side_m in [80.0, 100.0, 500.0] {
        let snapshot = scratch.map.snapshot(VersionId(1)).unwrap();
        let (time, rows) = median(|| snapshot.features(Some(&square(side_m))).unwrap().len());
        println!("region of {side_m} m: {time:?} for {rows} rows");
    }
    let mut base = 1;
    let (time, _) = median(|| {
        let mut update = transaction(base);
        update.additions = (0..10).map(|_| random.banner(SIDE_M)).collect();
        base += 1;
        scratch.map.commit(&update, at(2)).unwrap().0 as usize
    });
    println!("commit of 10: {time:?}");
    let snapshot = scratch.map.snapshot(VersionId(base)).unwrap();
    let (time, _) = median(|| usize::from(snapshot.bounds().unwrap().is_some()));
    println!("bounds: {time:?}");
    hot_spot(&scratch, base, &mut random);
    let start = Instant::now();
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
    println!("fsck: {:?}", start.elapsed());
}

/// Many versions of the same 100 m: every one moves 20 of its descriptors.
fn hot_spot(scratch: &Scratch, mut base: u64, random: &mut Random) {
    let first = base;
    let before = bytes(scratch);
    let region = square(100.0);
    let mut live = scratch.map.snapshot(VersionId(base)).unwrap().features(Some(&region)).unwrap();
    let start = Instant::now();
    for _ in 0..HOT_VERSIONS {
        let mut update = transaction(base);
        for _ in 0..CHANGES {
            let which = (random.next() * live.len() as f64) as usize;
            let feature = live.swap_remove(which);
            let FeatureState::Descriptor(Descriptor::Material(mut banner)) = feature.state.clone() else { panic!() };
            banner.sigma = Some(Uncertainty { position_m: random.next(), size_m: None, area_m2: None });
            let after = FeatureState::Descriptor(Descriptor::Material(banner));
            update.deltas.push(Delta::modify(feature.fid, feature.state, after));
        }
        base = scratch.map.commit(&update, at(3)).unwrap().0;
        for delta in &update.deltas {
            live.push(scratch.map.snapshot(VersionId(base)).unwrap().feature(delta.fid()).unwrap());
        }
    }
    let commits = HOT_VERSIONS as f64 / start.elapsed().as_secs_f64();
    let growth = (bytes(scratch) - before) / (HOT_VERSIONS * CHANGES as u64);
    println!(
        "{HOT_VERSIONS} versions × {CHANGES} changes of the same 100 m: {commits:.0} commits/s, {growth} B a change"
    );
    for version in [first, (first + base) / 2, base] {
        let snapshot = scratch.map.snapshot(VersionId(version)).unwrap();
        let (time, rows) = median(|| snapshot.features(Some(&region)).unwrap().len());
        println!("the same 100 m at version {version}: {time:?} for {rows} rows");
    }
    for (a, b) in [(first, base), (base - 10, base)] {
        let difference = || scratch.map.changes(VersionId(a), VersionId(b), Some(&square(50.0))).unwrap().len();
        let (time, rows) = median(difference);
        println!("difference of 50 m over {} versions: {time:?} for {rows} deltas", b - a);
    }
    let (time, rows) = median(|| scratch.map.log(Some(&square(20.0))).unwrap().len());
    println!("log of 20 m: {time:?} for {rows} versions");
}
