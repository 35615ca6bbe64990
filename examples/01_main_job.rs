//! The whole job on an invented street: a map, a phone photo with a new banner in it, the pose, the change, the new
//! version. Every result is printed beside the truth, and pictures of every stage are written.
//!
//! `cargo run --release --example 01_main_job`

#[path = "session/mod.rs"]
mod session;
#[path = "synthetic/mod.rs"]
mod synthetic;

use anyhow::{Context, ensure};
use serde_json::Value;
use session::{Session, area_m2, pose_error, text};
use std::time::Instant;
use synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, SceneKind};

fn main() -> anyhow::Result<()> {
    let session = Session::start("main_job")?;
    let scene = Scene::new(SceneKind::Street, 7);
    session.import(&scene)?;
    println!("map: {} objects at {:?}\n", scene.world.blocks.len(), scene.origin);

    let spec = CaseSpec {
        name: "capture".to_owned(),
        change: ChangeKind::Banner,
        noise: NoiseLevel::LIGHT,
        seed: 7,
        grid_prior: false,
    };
    let case = Case::new(&scene, spec)?;
    let capture = session.receive(&case)?;
    let prior = &case.truth.json["prior_error"];
    println!("capture: the phone's prior is {} m and {}° off\n", prior["position_m"], prior["yaw_deg"]);

    let pose = localize(&session, &case, &capture)?;
    view(&session, &capture, &pose, "before")?;
    update(&session, &case, &capture)?;
    view(&session, &capture, &pose, "after")?;

    let [e, n, _] = case.truth.changes[0].position.context("a banner has a position")?;
    let around = [e - 10.0, n - 10.0, e + 10.0, n + 10.0].map(|number| format!("{number:.1}")).join(",");
    session.show("query", &["--bbox", &around, "--class", "banner"])?;
    let updated = text(&session.path("updated.glb"))?;
    session.show("export", &[&updated])?;

    println!("\nlook at, in this order: capture/labels.png (the photo), heat.png (where it may have been taken),");
    println!("before/class.png and after/class.png (the map at the found pose), updated.glb (any glTF viewer)");
    Ok(())
}

/// Finds the pose; returns the path of `pose.json`.
fn localize(session: &Session, case: &Case, capture: &str) -> anyhow::Result<String> {
    let [heat, pose, truth] = ["heat.png", "pose.json", "capture/truth.json"].map(|name| session.path(name));
    let (heat, pose, truth) = (text(&heat)?, text(&pose)?, text(&truth)?);
    let start = Instant::now();
    let found = session.json("localize", &[capture, "--heatmap", &heat, "--truth", &truth, "--out", &pose])?;
    let seconds = start.elapsed().as_secs_f64();
    let (position_m, yaw_deg) = pose_error(&found, &case.truth)?;
    println!("  found {position_m:.2} m and {yaw_deg:+.2}° off, reliable: {}, in {seconds:.1} s\n", found["reliable"]);
    ensure!(position_m < 2.0 && yaw_deg.abs() < 2.0, "expected a pose within 2 m and 2° of the truth");
    Ok(pose)
}

/// Draws the map at a pose into a directory.
fn view(session: &Session, capture: &str, pose: &str, name: &str) -> anyhow::Result<()> {
    let out = text(&session.path(name))?;
    session.json("render", &[capture, "--pose", pose, "--out", &out])?;
    println!();
    Ok(())
}

/// Updates the map and compares the placed banner with the true one.
fn update(session: &Session, case: &Case, capture: &str) -> anyhow::Result<()> {
    let start = Instant::now();
    let answer = session.json("update", &[capture])?;
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "  version {} from {}, {} in {seconds:.1} s",
        answer["version"], answer["base_version"], answer["decision"]
    );
    let truth = &case.truth.changes[0];
    let changes = answer["changes"].as_array().context("update lists its changes")?;
    for change in changes {
        println!("  {} {} as feature {}", change["op"], change["class"], change["fid"]);
    }
    let placed = changes.iter().find(|change| change["op"] == "add" && change["class"] == truth.class);
    let placed = &placed.context("the banner was not placed")?["after"];
    let (centre, corners) = (numbers::<3>(&placed["centre"])?, corners(&placed["corners"])?);
    let [e, n, h] = truth.position.context("a banner has a position")?;
    let off_m = (centre[0] - e).hypot(centre[1] - n);
    let true_area = area_m2(truth.corners.context("a banner has corners")?);
    let area_percent = 100.0 * (area_m2(corners) / true_area - 1.0);
    let height_m = centre[2] - h;
    println!("  centre {off_m:.2} m off in plan and {height_m:+.2} m in height, area {area_percent:+.1} %\n");
    Ok(())
}

fn numbers<const N: usize>(value: &Value) -> anyhow::Result<[f64; N]> {
    let numbers: Option<Vec<f64>> = value.as_array().into_iter().flatten().map(Value::as_f64).collect();
    numbers.and_then(|numbers| numbers.try_into().ok()).with_context(|| format!("expected {N} numbers, found {value}"))
}

fn corners(value: &Value) -> anyhow::Result<[[f64; 3]; 4]> {
    let corners: Vec<[f64; 3]> = value.as_array().into_iter().flatten().map(numbers).collect::<Result<_, _>>()?;
    corners.try_into().map_err(|_| anyhow::anyhow!("expected 4 corners, found {value}"))
}
