//! Writes captures with known truth of an invented place, and its map.
//!
//! `cargo run --release --example generate_cases -- --scene street --count 20 --noise light --seed 1 --out out/cases`
//!
//! With `--suite` of every place at light and field noise, every other capture without a change, all into one directory
//! that `resurvey eval OUT --updates` reads:
//!
//! `cargo run --release --example generate_cases -- --suite --seed 1 --out out/suite`
//!
//! With `--every` instead of every place with every kind of change, the hard ones as well: changes of what the map
//! knew, several at once, things that touch, are cut by the border or hidden. `--second` adds a second photo of the same
//! changed place to each capture, as CASE/second.

#[path = "synthetic/mod.rs"]
mod synthetic;

use clap::Parser;
use std::path::PathBuf;
use synthetic::{
    ChangeKind, Changes, NoiseLevel, SceneKind, Suite, every_suite, full_suite, write_suite, write_suite_with_seconds,
};

/// Captures of each place and noise of `--suite`: 208 in all.
const SUITE_COUNT: usize = 26;
/// Captures of each kind, place and noise of `--every`.
const EVERY_COUNT: usize = 1;
/// Captures of one place.
const COUNT: usize = 10;

/// Writes maps/SCENE and one directory a capture under OUT.
#[derive(Parser)]
struct Arguments {
    /// Every place at light and field noise, every other capture without a change.
    #[arg(long, conflicts_with_all = ["scene", "noise", "change", "kinds"])]
    suite: bool,
    /// Every place at light and field noise with every kind of change in turn, the hard ones as well.
    #[arg(long, conflicts_with_all = ["suite", "scene", "noise", "change", "kinds"])]
    every: bool,
    /// street, alley, blocks or hall.
    #[arg(long, default_value = "street")]
    scene: SceneKind,
    /// ideal, light or field.
    #[arg(long, default_value = "light")]
    noise: NoiseLevel,
    /// One kind of change: none, banner, banner_removed, facade, pedestrian, two_chairs, chair_removed; or a hard one:
    /// banner_replaced, banner_grown, chair_moved, touching, several, cut_by_border, banner_cut, hidden, known.
    #[arg(long, conflicts_with = "kinds")]
    change: Option<ChangeKind>,
    /// Which kinds in turn: simple, half (of the captures none, the others simple) or every (the hard ones as well).
    #[arg(long, default_value = "simple")]
    kinds: Changes,
    /// Number of captures, 10 when left out; with --suite of each place and noise, 26 when left out (208 in all); with
    /// --every of each kind, place and noise, 1 when left out.
    #[arg(long)]
    count: Option<usize>,
    /// Each capture gets a second photo of the same changed place, as CASE/second, where a pose 3 to 8 m away shows it.
    #[arg(long)]
    second: bool,
    /// The place and the captures follow from it.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Directory to write to.
    #[arg(long, default_value = "target/cases")]
    out: PathBuf,
}

fn main() -> anyhow::Result<()> {
    let Arguments { suite, every, scene, noise, change, kinds, count, second, seed, out } = Arguments::parse();
    let changes = change.map_or(kinds, Changes::Only);
    let suites = if suite {
        full_suite(seed, count.unwrap_or(SUITE_COUNT))
    } else if every {
        every_suite(seed, count.unwrap_or(EVERY_COUNT))
    } else {
        vec![Suite { scene, seed, capture_seed: seed, count: count.unwrap_or(COUNT), noise, changes }]
    };
    for suite in suites {
        let folders = if second { write_suite_with_seconds(&suite, &out)? } else { write_suite(&suite, &out)? };
        for folder in folders {
            println!("{}", folder.display());
        }
    }
    Ok(())
}
