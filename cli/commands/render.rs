//! `resurvey render`.

use super::{crs_of, write_file};
use crate::args::Render;
use crate::console::Console;
use crate::failure::Failure;
use resurvey_core::camera::Camera;
use resurvey_core::capture::{Capture, read_pose};
use resurvey_core::image::{Raster, write_grey16_png, write_label_png};
use resurvey_core::render::{lidar, view};
use resurvey_core::store::MapFile;
use resurvey_core::update::world_around;
use resurvey_schema::CameraFile;
use serde_json::json;

/// Spacing of the virtual LIDAR, metres (Lee & Hsu, §3.5).
const LIDAR_SPACING_M: f64 = 0.1;
/// A grey level of `depth.png`, metres: 16 bits reach 655 m.
const DEPTH_STEP_M: f64 = 0.01;

/// Draws the map from a pose.
pub fn run(options: &Render, console: &mut Console<'_>) -> Result<u8, Failure> {
    if options.capture.is_none() && options.pose.is_none() {
        return Err(Failure::usage("expected a capture.json, or --pose with a pose to draw from"));
    }
    let map = MapFile::open_read_only(&options.map)?;
    let snapshot = map.snapshot(map.resolve(&options.at)?)?;
    let crs = crs_of(&map)?;
    let capture = options.capture.as_deref().map(|path| Capture::read(path, snapshot.classes(), crs)).transpose()?;
    let given = options.pose.as_deref().map(read_pose).transpose()?;
    let pose = given.or(capture.as_ref().map(|capture| capture.prior.pose));
    let pose = pose.expect("one of both is given: checked above");
    let camera = match capture {
        Some(capture) => capture.camera,
        None => paper_camera()?,
    };
    let stage = console.stage("render");
    let world = world_around(&snapshot, pose.position)?;
    let view = view(world.scene(true), &camera, &pose);
    let points = lidar::scan(&view, LIDAR_SPACING_M);
    let depth: Vec<u16> = view.range_m.values().iter().map(|range_m| grey(f64::from(*range_m))).collect();
    let depth = Raster::from_values(view.range_m.width(), view.range_m.height(), depth).expect("one level per pixel");
    std::fs::create_dir_all(&options.out)
        .map_err(|error| Failure::input(format!("{}: {error}", options.out.display())))?;
    write_file(&options.out.join("class.png"), &write_label_png(&view.labels, snapshot.classes())?)?;
    write_file(&options.out.join("depth.png"), &write_grey16_png(&depth)?)?;
    write_file(&options.out.join("points.ply"), &lidar::write_ply(&points, snapshot.classes()))?;
    let document = json!({
        "version": snapshot.version().0,
        "pose": pose,
        "width": camera.width(),
        "height": camera.height(),
        "class": "class.png",
        "depth": { "file": "depth.png", "unit_m": DEPTH_STEP_M, "nothing": 0, "along": "ray" },
        "points": { "file": "points.ply", "count": points.len(), "spacing_m": LIDAR_SPACING_M },
    });
    write_file(&options.out.join("view.json"), &serde_json::to_vec_pretty(&document)?)?;
    console.finish(&stage);
    if console.is_json() {
        console.document(&document)?;
    } else {
        let (out, count) = (options.out.display(), points.len());
        console.line(format_args!("{out}: class.png, depth.png, points.ply ({count} points), view.json"))?;
    }
    Ok(0)
}

/// Grey level of a range; 0 for nothing, the last level for anything further.
fn grey(range_m: f64) -> u16 {
    if range_m.is_finite() { (range_m / DEPTH_STEP_M).round().clamp(1.0, f64::from(u16::MAX)) as u16 } else { 0 }
}

/// The camera of Lee & Hsu: 960×720 with a 120° diagonal.
fn paper_camera() -> Result<Camera, Failure> {
    let file = CameraFile {
        model: "pinhole".to_owned(),
        width: 960,
        height: 720,
        fx: None,
        fy: None,
        cx: None,
        cy: None,
        distortion: None,
        diagonal_fov_deg: Some(120.0),
    };
    Camera::from_file(&file).map_err(Failure::input)
}
