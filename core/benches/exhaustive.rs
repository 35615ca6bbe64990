//! Rates of rendering and of the exact search: `cargo bench -p resurvey-core --bench exhaustive`, with `-- --full` for
//! the whole of the paper's grid, and with a number of triangles for that city alone. Beside them parry ray by ray and, where its Python package can be imported (by
//! `python3`, or what `RESURVEY_PYTHON` names), Open3D.
//!
//! The best of several runs, pose by pose: on a shared machine the best is the least wrong.

#[path = "../tests/support/city.rs"]
mod city;

use nalgebra::Vector3;
use resurvey_core::camera::{Pinhole, world_from_camera};
use resurvey_core::capture::Capture;
use resurvey_core::image::{LabelImage, Raster};
use resurvey_core::localize::{ExhaustiveRequest, Silent, World, exhaustive};
use resurvey_core::mesh::{Object, Surface};
use resurvey_core::metrics::ComparedPhoto;
use resurvey_core::render::{RayCaster, Renderer, Scene, SolidMask, view};
use resurvey_core::version::Digest;
use resurvey_schema::service::{ClassCounts, ClassSet, CompareRequest, Prior};
use resurvey_schema::{ClassTable, GridPoint, Pose};
use std::hint::black_box;
use std::time::Instant;

const CLASSES: usize = 9;
/// 0.75 % of the diagonal (Csurka et al. 2013).
const TOLERANCE_PX: f64 = 9.0;

fn main() {
    let full = std::env::args().any(|argument| argument == "--full");
    println!("{} threads; milliseconds a frame are of one core, 960 x 720", rayon::current_num_threads());
    let only: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let sizes = if only.is_empty() { vec![20_000, 200_000, 2_000_000] } else { only };
    for triangles in sizes {
        let objects = city::objects(triangles);
        let with_ids: Vec<(u64, &Object)> = (1..).zip(&objects).collect();
        let before = Instant::now();
        let world = World::new(city::ORIGIN, &with_ids, Vec::new(), ClassTable::default());
        let scene = world.scene(true);
        let made_s = before.elapsed().as_secs_f64() / 2.0;
        println!("\ncity of {} triangles, scene made in {made_s:.2} s", scene.positions().len());
        frames(scene);
        rays(scene);
        open3d(scene);
        if (100_000..400_000).contains(&triangles) {
            metrics(scene);
            search(&world, full);
        }
    }
}

fn turned(prior: Pose, by_deg: f64) -> Pose {
    Pose { yaw_rad: prior.yaw_rad + by_deg.to_radians(), ..prior }
}

fn frames(scene: &Scene) {
    let camera = city::camera().pinhole().expect("a pinhole");
    let poses: Vec<Pose> = (-40..=40).map(|step| turned(city::prior(), f64::from(step))).collect();
    let mut labels = LabelImage::filled(camera.width(), camera.height(), 0);
    let mut depths_m = Raster::filled(camera.width(), camera.height(), 0.0);
    for (name, fresh) in [("best", Renderer::new as fn() -> Renderer), ("baseline", Renderer::baseline)] {
        let mut renderer = fresh();
        let classes_ms = mean_of_best_ms(&poses, |pose| renderer.render_labels(scene, &camera, pose, &mut labels));
        let both_ms = mean_of_best_ms(&poses, |pose| {
            renderer.render_labels_and_depths(scene, &camera, pose, (&mut labels, &mut depths_m));
        });
        let alone_ms = mean_of_best_ms(&poses[..8], |pose| fresh().render_labels(scene, &camera, pose, &mut labels));
        println!("  {name:<9} class {classes_ms:.3} ms, class and depth {both_ms:.3} ms, first image {alone_ms:.3} ms");
    }
    let view_ms = mean_of_best_ms(&poses[..8], |pose| {
        black_box(view(scene, &city::camera(), pose));
    });
    println!("  view (class, range, point, feature), all threads, first image {view_ms:.3} ms");
}

/// Mean over `poses` of the best of several runs.
fn mean_of_best_ms(poses: &[Pose], mut run: impl FnMut(&Pose)) -> f64 {
    let mut best_s = vec![f64::INFINITY; poses.len()];
    for _ in 0..10 {
        for (pose, best_s) in poses.iter().zip(&mut best_s) {
            let before = Instant::now();
            run(pose);
            *best_s = best_s.min(before.elapsed().as_secs_f64());
        }
    }
    best_s.iter().sum::<f64>() / best_s.len() as f64 * 1e3
}

/// Parry, one ray at a time: every 7th pixel of every 7th row.
fn rays(scene: &Scene) {
    let (camera, prior) = (city::camera(), city::prior());
    let caster = RayCaster::new(scene);
    let map_from_camera = world_from_camera(&prior);
    let pixels = (0..camera.height()).step_by(7).flat_map(|v| (0..camera.width()).step_by(7).map(move |u| (u, v)));
    let ray = |(u, v)| camera.ray(f64::from(u) + 0.5, f64::from(v) + 0.5).expect("a pinhole has a ray everywhere");
    let directions: Vec<[f64; 3]> = pixels.map(|pixel| (map_from_camera * ray(pixel)).into()).collect();
    let sample_ms = mean_of_best_ms(&[prior], |pose| {
        for direction in &directions {
            black_box(caster.cast(pose.position, *direction, f64::INFINITY));
        }
    });
    let frame_ms = sample_ms / directions.len() as f64 * f64::from(camera.width() * camera.height());
    println!("  parry, ray by ray: {frame_ms:.0} ms a frame, from {} rays", directions.len());
}

fn open3d(scene: &Scene) {
    let python = std::env::var_os("RESURVEY_PYTHON").unwrap_or_else(|| "python3".into());
    let imports = std::process::Command::new(&python).args(["-c", "import open3d"]).output();
    if !imports.is_ok_and(|output| output.status.success()) {
        println!("  SKIPPED Open3D: {} cannot import open3d", python.display());
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, bytes: Vec<u8>| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path
    };
    let corners = scene.positions().iter().flatten().flatten().flat_map(|value| value.to_le_bytes()).collect();
    let class = |triangle: usize| match scene.surface(triangle) {
        Surface::Class(class) => class.0,
        Surface::Texture(_) => 0,
    };
    let classes = (0..scene.positions().len()).map(class).collect();
    let files = [write("corners", corners), write("classes", classes), write("rays", rays_of(scene))];
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/open3d_rays.py");
    let output = std::process::Command::new(&python).arg(script).args(files).output().expect("started");
    let found = String::from_utf8_lossy(&output.stdout);
    match found.trim().parse::<f64>() {
        Ok(ms) => println!("  Open3D, all threads, without label textures: {ms:.1} ms a frame"),
        Err(_) => println!("  SKIPPED Open3D: {}", String::from_utf8_lossy(&output.stderr).trim()),
    }
}

/// Origin and direction of every pixel's ray at the prior.
fn rays_of(scene: &Scene) -> Vec<u8> {
    let (camera, prior) = (city::camera(), city::prior());
    let map_from_camera = world_from_camera(&prior);
    let eye = Vector3::from(scene.offset(prior.position));
    let pixels = (0..camera.height()).flat_map(|v| (0..camera.width()).map(move |u| (u, v)));
    let rays = pixels.flat_map(|(u, v)| {
        let ray = camera.ray(f64::from(u) + 0.5, f64::from(v) + 0.5).expect("a pinhole has a ray everywhere");
        let ray = map_from_camera * ray;
        [eye.x, eye.y, eye.z, ray.x, ray.y, ray.z]
    });
    rays.flat_map(|value| (value as f32).to_le_bytes()).collect()
}

/// A photo from a place and heading that are no candidate, with something before the street that the map has not.
fn photo(scene: &Scene) -> LabelImage {
    let prior = city::prior();
    let GridPoint { easting_m, northing_m, height_m } = prior.position;
    let here = GridPoint::new(easting_m + 3.4, northing_m - 2.3, height_m);
    let mut labels = view(scene, &city::camera(), &Pose { position: here, ..turned(prior, 7.3) }).labels;
    for (u, v) in (330..520).flat_map(|v| (600..690).map(move |u| (u, v))) {
        labels.set(u, v, 7);
    }
    labels
}

fn metrics(scene: &Scene) {
    let camera: Pinhole = city::camera().pinhole().expect("a pinhole");
    let (none, mut ignored) = (ClassSet::default(), ClassSet::default());
    ignored.insert(resurvey_schema::ClassId(7));
    for (name, tolerance_px) in [("Dice and Jaccard", 0.0), ("and boundary F1", TOLERANCE_PX)] {
        let photo = ComparedPhoto::new(&photo(scene), CLASSES, tolerance_px, &ignored, &none);
        let (mut planes, mut counts) = (photo.planes(), vec![ClassCounts::default(); CLASSES]);
        let mut rows = Vec::new();
        Renderer::new().render_rows(scene, &camera, &city::prior(), |_, row| rows.push(row.to_vec()));
        let planes_ms = mean_of_best_ms(&[city::prior()], |_| {
            rows.iter().enumerate().for_each(|(v, row)| planes.set_row(v, row));
        });
        let count_ms = mean_of_best_ms(&[city::prior(); 10], |_| photo.count(&mut planes, black_box(&mut counts)));
        println!("  {name}: planes {planes_ms:.3} ms, counts {count_ms:.3} ms an image");
    }
}

fn search(world: &World, full: bool) {
    let prior = city::prior();
    let capture = Capture {
        labels: photo(world.scene(true)),
        label_bytes: Vec::new(),
        camera: city::camera(),
        prior: Prior {
            pose: prior,
            position_sigma_m: 10.0,
            height_sigma_m: 0.1,
            yaw_sigma_rad: 0.3,
            tilt_sigma_rad: 0.02,
        },
        taken_at: None,
        digest: Digest::of(b"bench"),
    };
    let mut ignored_in_photo = ClassSet::default();
    ignored_in_photo.insert(resurvey_schema::ClassId(7));
    let compare = CompareRequest {
        stride: 1,
        ignored_in_photo,
        ignored_in_view: ClassSet::default(),
        boundary_tolerance_px: TOLERANCE_PX,
    };
    let spacing_m = if full { 1.0 } else { 8.0 };
    let request = ExhaustiveRequest { radius_m: 40.0, spacing_m, yaw_range_deg: 40.0, yaw_step_deg: 1.0, compare };
    let before = Instant::now();
    let found = exhaustive(world, &capture, &request, &[&mean_of_three], &Silent).expect("not cancelled");
    let took_s = before.elapsed().as_secs_f64();
    let (best, score) = found.best(0).expect("candidates");
    let (scored, skipped) = (found.candidates(), found.skipped());
    println!("  exact search: {scored} candidates scored, {skipped} inside buildings, {took_s:.1} s");
    let each_us = took_s / scored as f64 * 1e6;
    println!("  {each_us:.0} µs a candidate; best {score:.4} at {best:?}");
    if !full {
        let mask = SolidMask::at_height(world.scene(false), prior.position.height_m);
        let free = disc(prior.position).filter(|position| !mask.contains(*position)).count() * 81;
        println!("  EXTRAPOLATED to the {free} of 407025 that are not inside: {:.1} s", each_us * free as f64 / 1e6);
    }
}

fn disc(centre: GridPoint) -> impl Iterator<Item = GridPoint> {
    let offsets = (-40..=40).flat_map(|north| (-40..=40).map(move |east| (f64::from(east), f64::from(north))));
    offsets.filter(|(east, north)| east.hypot(*north) <= 40.0).map(move |(east_m, north_m)| {
        GridPoint::new(centre.easting_m + east_m, centre.northing_m + north_m, centre.height_m)
    })
}

/// The paper's score: Dice, Jaccard and boundary F1, each averaged over the classes in either image.
fn mean_of_three(counts: &[ClassCounts]) -> f64 {
    let (mut sum, mut classes) = (0.0, 0.0);
    for count in counts.iter().filter(|count| count.photo + count.view > 0) {
        let both = f64::from(count.both);
        let either = f64::from(count.photo + count.view);
        let share = |part: u32, of: u32| if of == 0 { 0.0 } else { f64::from(part) / f64::from(of) };
        let precision = share(count.view_boundary_matched, count.view_boundary);
        let recall = share(count.photo_boundary_matched, count.photo_boundary);
        let boundary = if precision + recall > 0.0 { 2.0 * precision * recall / (precision + recall) } else { 0.0 };
        sum += (2.0 * both / either + both / (either - both) + boundary) / 3.0;
        classes += 1.0;
    }
    if classes > 0.0 { sum / classes } else { 0.0 }
}
