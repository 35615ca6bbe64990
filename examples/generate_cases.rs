//! Writes captures with known truth of an invented place, and its map.
//!
//! `cargo run --release --example generate_cases -- --scene street --count 20 --noise light --seed 1 --out out/cases`

#[path = "synthetic/mod.rs"]
mod synthetic;

use clap::Parser;
use std::path::PathBuf;
use synthetic::{ChangeKind, NoiseLevel, SceneKind, Suite, write_suite};

/// Writes maps/SCENE and one directory a capture under OUT.
#[derive(Parser)]
struct Arguments {
    /// street, alley, blocks or hall.
    #[arg(long, default_value = "street")]
    scene: SceneKind,
    /// ideal, light or field.
    #[arg(long, default_value = "light")]
    noise: NoiseLevel,
    /// One kind of change (none, banner, banner_removed, facade, pedestrian, two_chairs, chair_removed); all in turn when
    /// left out.
    #[arg(long)]
    change: Option<ChangeKind>,
    /// Number of captures.
    #[arg(long, default_value_t = 10)]
    count: usize,
    /// The place and the captures follow from it.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Directory to write to.
    #[arg(long, default_value = "target/cases")]
    out: PathBuf,
}

fn main() -> anyhow::Result<()> {
    let Arguments { scene, noise, change, count, seed, out } = Arguments::parse();
    for folder in write_suite(&Suite { scene, seed, count, noise, change }, &out)? {
        println!("{}", folder.display());
    }
    Ok(())
}
