//! The same photos through two VPS matchers: class regions and boundaries against the skyline alone.
//!
//! `cargo run --release --example 03_swap_matcher`

#[path = "session/mod.rs"]
mod session;
#[path = "synthetic/mod.rs"]
mod synthetic;

use session::{Session, pose_error};
use std::collections::BTreeMap;
use synthetic::{Case, Changes, NoiseLevel, Scene, SceneKind, Suite};

fn main() -> anyhow::Result<()> {
    let session = Session::start("swap_matcher")?;
    let suite = Suite {
        scene: SceneKind::Street,
        seed: 11,
        capture_seed: 11,
        count: 5,
        noise: NoiseLevel::LIGHT,
        changes: Changes::InTurn,
    };
    let scene = Scene::new(suite.scene, suite.seed);
    session.import(&scene)?;

    let mut errors: BTreeMap<&str, Vec<(f64, f64)>> = BTreeMap::new();
    for spec in suite.specs(&scene) {
        let case = Case::new(&scene, spec)?;
        let capture = session.receive(&case)?;
        for matcher in ["semantic", "skyline"] {
            let found = session.json("localize", &[&capture, "--matcher", matcher])?;
            let error = pose_error(&found, &case.truth)?;
            println!("  {:.2} m, {:+.2}°, reliable: {}", error.0, error.1, found["reliable"]);
            errors.entry(matcher).or_default().push(error);
        }
    }
    println!();
    for (matcher, errors) in errors {
        let count = errors.len();
        let close = errors.iter().filter(|(metres, degrees)| *metres <= 2.0 && degrees.abs() <= 2.0).count();
        let mean = errors.iter().map(|(metres, _)| metres).sum::<f64>() / count as f64;
        println!("{matcher:10} {close} of {count} within 2 m and 2°, mean error {mean:.2} m");
    }
    Ok(())
}
