//! The map at any version: what was there then, which versions changed a region, and why a descriptor is where it is.
//!
//! `cargo run --release --example 02_query_history`

#[path = "session/mod.rs"]
mod session;
#[path = "synthetic/mod.rs"]
mod synthetic;

use anyhow::Context;
use session::{Session, text};
use synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, SceneKind};

fn main() -> anyhow::Result<()> {
    let session = Session::start("query_history")?;
    let scene = Scene::new(SceneKind::Hall, 3);
    session.import(&scene)?;

    // Version 2: two surveyed chairs. Version 3: a photo shows that one of them is gone.
    let spec = CaseSpec {
        name: "capture".to_owned(),
        change: ChangeKind::ChairRemoved,
        noise: NoiseLevel::LIGHT,
        seed: 3,
        grid_prior: false,
    };
    let case = Case::new(&scene, spec)?;
    let capture = session.receive(&case)?;
    session.json("update", &[&capture])?;

    let [e, n, _] = case.truth.changes[0].position.context("a chair has a position")?;
    let around = [e - 3.0, n - 3.0, e + 3.0, n + 3.0].map(|number| format!("{number:.1}")).join(",");
    println!("\nchairs around the place, version by version:");
    for version in ["1", "2", "3"] {
        session.show("query", &["--bbox", &around, "--class", "chair", "--at", version])?;
    }
    println!("\nversions that changed something inside this square:");
    session.show("log", &["--bbox", &around])?;

    let left = session.json("query", &["--bbox", &around, "--class", "chair"])?;
    let feature = &left["features"][0]["fid"];
    println!("\nwhere the chair that is left comes from:");
    session.show("why", &[&feature.to_string()])?;
    println!("\nthe whole map in version 1, as it was surveyed:");
    session.show("export", &[&text(&session.path("version-1.glb"))?, "--at", "1"])?;
    Ok(())
}
