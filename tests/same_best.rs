//! The default search against the exact one: is the best candidate the same? Long, so only on request:
//!
//! `cargo test --release --test same_best -- --ignored --nocapture`
//!
//! `RESURVEY_CAPTURES` sets the number of captures (52). The search is 8 m wide around a prior that is off by up to 6 m,
//! so that the exact one takes seconds, not minutes, for each of them.

#[path = "common/mod.rs"]
mod common;
#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

use common::{Answer, Place, path};
use serde_json::{Value, json};
use synthetic::{ChangeKind, NoiseLevel, Scene, SceneKind};

/// Position and heading of the best candidate.
fn best(place: &Place, capture: &str, exhaustive: bool) -> (f64, [f64; 3]) {
    let mut arguments = vec![capture];
    for setting in ["refine=false", "use_prior=false", "radius_m=8", "widen=false"] {
        arguments.extend(["--set", Box::leak(format!("semantic.{setting}").into_boxed_str())]);
    }
    if exhaustive {
        arguments.push("--exhaustive");
    }
    let Answer { code, json, messages } = place.run("localize", &arguments);
    assert!(matches!(code, 0 | 22), "exit code {code}: {messages}");
    let number = |key: &str| json["pose"][key].as_f64().expect("a number");
    (json["score"].as_f64().expect("a score"), [number("easting"), number("northing"), number("yaw_deg")])
}

/// Moves the prior of `capture` to at most 6 m from the truth, on no lattice of its own.
fn bring_near(capture: &std::path::Path, truth: &Value, index: u64) {
    let text = std::fs::read_to_string(capture).expect("the capture is there");
    let mut document: Value = serde_json::from_str(&text).expect("JSON");
    let (angle, far_m) = (index as f64 * 2.4, 1.0 + (index % 6) as f64);
    let prior = document["prior"].as_object_mut().expect("a prior");
    prior.remove("latitude");
    prior.remove("longitude");
    prior.insert("easting".into(), json!(truth["easting"].as_f64().expect("a number") + far_m * angle.sin()));
    prior.insert("northing".into(), json!(truth["northing"].as_f64().expect("a number") + far_m * angle.cos()));
    std::fs::write(capture, document.to_string()).expect("the capture is written");
}

#[test]
#[ignore = "minutes: compares with every candidate at full size"]
fn the_default_search_finds_the_best_candidate_of_the_exact_one() {
    let wanted: u64 = std::env::var("RESURVEY_CAPTURES").ok().and_then(|text| text.parse().ok()).unwrap_or(52);
    let kinds = [SceneKind::Street, SceneKind::Alley, SceneKind::Blocks, SceneKind::Hall];
    let (mut same, mut worst_loss) = (0, 0.0_f64);
    for (index, kind) in (0..wanted).zip(kinds.iter().cycle()) {
        let noise = [NoiseLevel::LIGHT, NoiseLevel::FIELD][(index / 4 % 2) as usize];
        let place = Place::new(Scene::new(*kind, 4), "glb");
        let (case, capture) = place.capture(ChangeKind::None, noise, 5000 + index);
        bring_near(&capture, &case.truth.json["pose"], index);
        let (fast, at_fast) = best(&place, path(&capture), false);
        let (exact, at_exact) = best(&place, path(&capture), true);
        let is_same = at_fast.iter().zip(at_exact).all(|(a, b)| (a - b).abs() < 1e-6);
        same += u64::from(is_same);
        worst_loss = worst_loss.max(exact - fast);
        if !is_same {
            println!(
                "{} {index}: {fast:.5} at {at_fast:?}, the exact search has {exact:.5} at {at_exact:?}",
                kind.name()
            );
        }
    }
    println!("{same} of {wanted} the same; the others lose at most {worst_loss:.5} of the score");
    assert!(same * 100 >= wanted * 95, "{same} of {wanted} are the same");
}
