//! How pose and changes suffer from worse labels and a worse prior: captures with the same poses and changes at every
//! level of one noise, the others as under light noise. Prints a table and draws the curves as SVG.
//!
//! `cargo run --release --example noise_sweeps -- --count 24 --out out/sweeps`

#[path = "sweep/mod.rs"]
mod sweep;
#[path = "synthetic/mod.rs"]
mod synthetic;

use anyhow::Context;
use clap::Parser;
use std::fs;
use std::path::PathBuf;
use sweep::{Noise, Sweep, charts, table};
use synthetic::SceneKind;

/// Writes maps, captures, sweeps.csv and six drawings under OUT.
#[derive(Parser)]
struct Arguments {
    /// street, alley, blocks or hall.
    #[arg(long, default_value = "street")]
    scene: SceneKind,
    /// Captures at each level, every other one without a change.
    #[arg(long, default_value_t = 24)]
    count: usize,
    /// The place and the captures follow from it.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// One sweep alone: jitter, blobs or prior.
    #[arg(long)]
    only: Option<Noise>,
    /// Directory to write to.
    #[arg(long, default_value = "target/sweeps")]
    out: PathBuf,
}

fn main() -> anyhow::Result<()> {
    let Arguments { scene, count, seed, only, out } = Arguments::parse();
    fs::create_dir_all(&out).with_context(|| format!("making {}", out.display()))?;
    let sweeps = Noise::ALL.into_iter().filter(|noise| only.is_none_or(|only| only == *noise));
    let mut csv = table::header();
    for noise in sweeps {
        println!("{}", noise.label());
        println!("{}", table::HEADS);
        let sweep = Sweep { noise, scene, seed, count };
        let mut levels = Vec::new();
        for value in noise.values() {
            let level = sweep.level(*value, &out)?;
            println!("{}", table::row(&level));
            csv += &table::csv_row(noise, &level);
            levels.push(level);
        }
        for (name, chart) in charts::charts(noise, &levels) {
            let path = out.join(format!("{name}.svg"));
            fs::write(&path, chart.svg()).with_context(|| format!("writing {}", path.display()))?;
            println!("{}", path.display());
        }
    }
    let path = out.join("sweeps.csv");
    fs::write(&path, csv).with_context(|| format!("writing {}", path.display()))?;
    println!("{}", path.display());
    Ok(())
}
