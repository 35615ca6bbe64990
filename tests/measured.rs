//! A banner of known size from a known pose: ideal labels cast by the generator over its own wall, measured by the built
//! binary with `--pose`. The oracle is the panel itself.

#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

mod common;

use common::{Place, path};
use serde_json::{Value, json};
use synthetic::camera::Camera;
use synthetic::caster::picture;
use synthetic::world::{Block, Offset, Panel, World, class};
use synthetic::{Scene, SceneKind, label_png};

/// North of the origin, metres: the face of the wall.
const WALL_M: f64 = 20.0;
/// How far the banner hangs off it: flush. One photo does not say how far a banner stands off its wall, so at 45° each
/// centimetre of it would be 1.4 cm of its place.
const OFF_WALL_M: f64 = 0.005;
/// The banner: west, east, lowest and highest edge, metres.
const SIDES_M: [f64; 4] = [-3.0, 3.0, 4.0, 8.0];
const AREA_M2: f64 = 24.0;
/// From the camera to the middle of the banner in plan, metres.
const RANGE_M: f64 = 20.0;

/// A long stone wall on level ground.
fn scene() -> Scene {
    let wall = Block {
        name: "wall".to_owned(),
        mapped: true,
        joined: [false; 2],
        ..Block::object(class::STONE, [0.0, WALL_M + 10.0, 0.0], [240.0, 20.0, 40.0], 0.0)
    };
    let world = World { blocks: vec![wall], ground_half_m: 400.0, ..World::default() };
    Scene { world, ..Scene::new(SceneKind::Street, 1) }
}

fn banner() -> Panel {
    let [west, east, low, high] = SIDES_M;
    let north = WALL_M - OFF_WALL_M;
    let corners = [[west, north, low], [east, north, low], [east, north, high], [west, north, high]];
    Panel { class: class::BANNER, corners }
}

/// A camera at eye height that sees the middle of the banner from `off_deg` west of its normal; turned from it by `aim`.
fn camera(off_deg: f64, [yaw_deg, pitch_deg, roll_deg]: [f64; 3]) -> Camera {
    let off = off_deg.to_radians();
    let position: Offset = [-RANGE_M * off.sin(), WALL_M - OFF_WALL_M - RANGE_M * off.cos(), 1.6];
    Camera::new(position, [off_deg + yaw_deg, pitch_deg, roll_deg].map(f64::to_radians))
}

/// What `update --pose` places on the map of `place` when `camera` takes a photo of the banner.
fn placed(place: &Place, camera: &Camera, name: &str) -> Value {
    let world = World { panels: vec![banner()], ..place.scene.world.clone() };
    let labels = picture(&world, camera).labels();
    let folder = place.path(name);
    std::fs::create_dir_all(&folder).expect("a writable directory");
    let write = |file: &str, bytes: &[u8]| std::fs::write(folder.join(file), bytes).expect("a writable file");
    write("labels.png", &label_png::encode(&labels, camera.width as usize).expect("labels are a PNG"));
    let [e, n, h] = [0, 1, 2].map(|axis| place.scene.origin[axis] + camera.position[axis]);
    let [yaw_deg, pitch_deg, roll_deg] = [camera.yaw_rad, camera.pitch_rad, camera.roll_rad].map(f64::to_degrees);
    let (width, height, focal) = (camera.width, camera.height, camera.focal_px);
    let capture = json!({
        "format": "resurvey.capture/1", "labels": "labels.png",
        "camera": {"model": "pinhole", "width": width, "height": height, "fx": focal, "fy": focal,
            "cx": f64::from(width) / 2.0, "cy": f64::from(height) / 2.0},
        "prior": {"easting": e, "northing": n, "height": h, "height_datum": "hkpd", "north": "grid",
            "yaw_deg": yaw_deg, "pitch_deg": pitch_deg, "roll_deg": roll_deg},
    });
    write("capture.json", capture.to_string().as_bytes());
    let pose = json!({"pose": {"easting": e, "northing": n, "height": h, "yaw_deg": yaw_deg.rem_euclid(360.0),
        "pitch_deg": pitch_deg, "roll_deg": roll_deg}});
    write("pose.json", pose.to_string().as_bytes());
    let (capture, pose) = (folder.join("capture.json"), folder.join("pose.json"));
    let answer = place.run("update", &[path(&capture), "--pose", path(&pose), "--dry-run"]);
    assert_eq!(answer.code, 0, "{name}: {} {}", answer.json["rejections"], answer.messages);
    let changes = answer.json["changes"].as_array().expect("a list of changes");
    assert_eq!(changes.len(), 1, "{name}: {changes:?}");
    assert_eq!((changes[0]["op"].as_str(), changes[0]["class"].as_str()), (Some("add"), Some("banner")));
    changes[0]["after"].clone()
}

#[test]
fn a_banner_of_6_by_4_m_at_20_m_is_measured_within_5_cm_and_2_percent() {
    let place = Place::new(scene(), "3ds");
    let [e, n, h] = place.scene.origin;
    let [west, east, low, high] = SIDES_M;
    let truth = [e + (west + east) / 2.0, n + WALL_M - OFF_WALL_M, h + (low + high) / 2.0];
    let mut worst = Vec::new();
    for off_deg in [0.0, 30.0, 45.0] {
        // Level and square to the wall, where edges run along rows of pixels, and as a hand holds it.
        for (index, aim) in
            [[0.0, 0.0, 0.0], [3.0, 8.0, 1.5], [-11.0, 12.0, -2.0], [17.0, 5.0, 0.7]].into_iter().enumerate()
        {
            let name = format!("{off_deg}-{index}");
            let found = placed(&place, &camera(off_deg, aim), &name);
            let number = |value: &Value| value.as_f64().expect("a number");
            let off_m = (0..3).map(|axis| (number(&found["centre"][axis]) - truth[axis]).powi(2)).sum::<f64>().sqrt();
            let area = number(&found["area_m2"]) / AREA_M2 - 1.0;
            let sides = [number(&found["width_m"]) - (east - west), number(&found["height_m"]) - (high - low)];
            println!("{name}: centre {off_m:.3} m, area {:+.2} %, sides {sides:+.3?} m", 100.0 * area);
            if off_m > 0.05 || area.abs() > 0.02 {
                worst.push(format!("{name}: centre {off_m:.3} m off, area {:+.2} %", 100.0 * area));
            }
        }
    }
    assert!(worst.is_empty(), "{worst:#?}");
}
