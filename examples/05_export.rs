//! The map for other programs: the updated model as glTF, whole and cut to a region, at two versions.
//!
//! `cargo run --release --example 05_export`

#[path = "session/mod.rs"]
mod session;
#[path = "synthetic/mod.rs"]
mod synthetic;

use anyhow::Context;
use session::{Session, text};
use std::fs;
use synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, SceneKind};

fn main() -> anyhow::Result<()> {
    let session = Session::start("export")?;
    let scene = Scene::new(SceneKind::Street, 5);
    session.import(&scene)?;
    let spec = CaseSpec {
        name: "capture".to_owned(),
        change: ChangeKind::Banner,
        noise: NoiseLevel::IDEAL,
        seed: 5,
        grid_prior: false,
    };
    let case = Case::new(&scene, spec)?;
    let capture = session.receive(&case)?;
    session.json("update", &[&capture])?;

    let [e, n, _] = case.truth.changes[0].position.context("a banner has a position")?;
    let around = [e - 40.0, n - 40.0, e + 40.0, n + 40.0].map(|number| format!("{number:.1}")).join(",");
    for (name, options) in [
        ("surveyed.glb", vec!["--at", "1"]),
        ("updated.glb", vec![]),
        ("around-the-banner.glb", vec!["--bbox", &around]),
    ] {
        let path = session.path(name);
        let arguments: Vec<String> =
            std::iter::once(text(&path)?).chain(options.into_iter().map(str::to_owned)).collect();
        session.show("export", &arguments.iter().map(String::as_str).collect::<Vec<_>>())?;
        let bytes = fs::metadata(&path).with_context(|| format!("{name} was not written"))?.len();
        println!("  {name}: {bytes} bytes\n");
    }
    Ok(())
}
