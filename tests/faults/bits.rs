//! Bits that flip in the file: `fsck` finds it, or what the map holds is the same; nothing crashes.

use crate::job::{copy, jobs};
use crate::observed::{Observed, run};
use std::fs;
use std::path::Path;

const SAMPLED: usize = 100;
const MANY: usize = 8_000;

/// Pseudo-random numbers (Marsaglia's xorshift), the same in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, count: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % count
    }
}

fn flips(template: &Path, count: usize, seed: u64) {
    let directory = tempfile::tempdir().unwrap();
    let map = copy(template, directory.path());
    let (bytes, whole) = (fs::read(&map).unwrap(), Observed::of(&map));
    let (mut random, mut found, mut harmless) = (Random(seed), 0, 0);
    for round in 0..count {
        // A quarter of them in the first pages, which hold the tables' roots.
        let reach = if round % 4 == 0 { bytes.len().min(40 * 4096) } else { bytes.len() };
        let (byte, bit) = (random.below(reach), random.below(8));
        let mut flipped = bytes.clone();
        flipped[byte] ^= 1 << bit;
        fs::write(&map, flipped).unwrap();
        let place = format!("bit {bit} of byte {byte} (page {})", byte / 4096 + 1);
        let answer = run("fsck", &map, &[]);
        match answer.code {
            0 => {
                let now = Observed::without_check(&map).unwrap_or_else(|answer| panic!("{place}: {answer:?}"));
                assert!(now == whole, "{place}: fsck finds nothing and the map is another");
                harmless += 1;
            }
            13 => {
                found += 1;
                // The answer may be wrong now, but it is an answer or a refusal.
                let answer = Observed::without_check(&map);
                let code = answer.as_ref().map_or_else(|answer| answer.code, |_| 0);
                assert!([0, 11, 13].contains(&code), "{place}: {answer:?}");
            }
            _ => panic!("{place}: {answer:?}"),
        }
    }
    println!("{count} bits flipped: {found} found by fsck, {harmless} harmless");
    assert!(found > 0);
}

#[test]
fn a_bit_that_flips_is_found_or_harmless() {
    flips(&jobs().eventful, SAMPLED, 5);
}

#[test]
fn a_bit_that_flips_in_a_map_that_forgot_is_found_or_harmless() {
    flips(&jobs().forgetful, SAMPLED, 7);
}

#[test]
#[ignore = "an hour"]
fn thousands_of_bits_that_flip_are_found_or_harmless() {
    flips(&jobs().eventful, MANY, 11);
}

#[test]
#[ignore = "an hour"]
fn thousands_of_bits_that_flip_in_a_map_that_forgot_are_found_or_harmless() {
    flips(&jobs().forgetful, MANY, 13);
}
