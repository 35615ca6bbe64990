//! `resurvey render`.

use super::crs_of;
use crate::args::Render;
use crate::console::Console;
use crate::failure::Failure;
use crate::out_file::{make_directory, write_files};
use crate::prior::{Placed, read_placed};
use resurvey_core::camera::Camera;
use resurvey_core::capture::read_pose;
use resurvey_core::image::{Raster, write_grey16_png, write_label_png};
use resurvey_core::render::{lidar, view};
use resurvey_core::store::{History, MapFile};
use resurvey_core::update::world_around;
use resurvey_schema::CameraFile;
use serde_json::json;

/// Spacing of the virtual LIDAR, metres (Lee & Hsu, §3.5).
const LIDAR_SPACING_M: f64 = 0.1;
/// A grey level of `depth.png`, metres: 16 bits reach 655 m.
const DEPTH_STEP_M: f64 = 0.01;

/// Draws the map from a pose.
pub fn run(options: &Render, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open_read_only(&options.map)?;
    let snapshot = map.snapshot(map.resolve(&options.at)?)?;
    let crs = crs_of(&map)?;
    let given = options.pose.as_deref().map(read_pose).transpose()?;
    let stage = console.stage("render");
    let (camera, pose, world) = match (&options.capture, given) {
        (Some(path), given) => {
            let Placed { capture, world, .. } =
                read_placed(path, (&options.prior, None), given, (&snapshot, crs), console)?;
            (capture.camera, given.unwrap_or(capture.prior.pose), world)
        }
        (None, Some(_)) if options.prior.is_given() => {
            return Err(Failure::usage("expected a capture.json beside --nmea or --photo: they say no pitch and roll"));
        }
        (None, Some(pose)) => (paper_camera()?, pose, world_around(&snapshot, pose.position)?),
        (None, None) => return Err(Failure::usage("expected a capture.json, or --pose with a pose to draw from")),
    };
    let view = view(world.scene(true), &camera, &pose);
    let points = lidar::scan(&view, LIDAR_SPACING_M);
    let depth: Vec<u16> = view.range_m.values().iter().map(|range_m| grey(f64::from(*range_m))).collect();
    let depth = Raster::from_values(view.range_m.width(), view.range_m.height(), depth).expect("one level per pixel");
    make_directory(&options.out)?;
    let document = json!({
        "version": snapshot.version().0,
        "pose": pose,
        "width": camera.width(),
        "height": camera.height(),
        "class": "class.png",
        "depth": { "file": "depth.png", "unit_m": DEPTH_STEP_M, "nothing": 0, "along": "ray" },
        "points": { "file": "points.ply", "count": points.len(), "spacing_m": LIDAR_SPACING_M },
    });
    let place = |name: &str| options.out.join(name);
    write_files(&[
        (&place("class.png"), &write_label_png(&view.labels, snapshot.classes())?),
        (&place("depth.png"), &write_grey16_png(&depth)?),
        (&place("points.ply"), &lidar::write_ply(&points, snapshot.classes())),
        (&place("view.json"), &serde_json::to_vec_pretty(&document)?),
    ])?;
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
pub(super) fn paper_camera() -> Result<Camera, Failure> {
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
