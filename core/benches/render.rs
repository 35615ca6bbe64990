//! Median times of one image on one core: `cargo bench -p resurvey-core --bench render`.
//!
//! The street of `shared/cases` (skipped where it is missing) and a made-up city of boxes with label textures.

#[path = "../tests/support/mod.rs"]
mod support;

use resurvey_core::camera::{Camera, Pinhole};
use resurvey_core::image::LabelImage;
use resurvey_core::mesh::{LabelTexture, Mesh, Object, Surface, Wrap};
use resurvey_core::render::{Renderer, Scene, view};
use resurvey_schema::{CameraModel, ClassId, ClassTable, GridPoint, Intrinsics, Pose};
use std::hint::black_box;
use std::time::Instant;

/// Subsampling of the 960 × 720 image, and the name of what is left.
const SIZES: [(u32, &str); 4] = [(1, "960x720"), (2, "480x360"), (4, "240x180"), (8, "120x90")];

fn main() {
    println!("{:<28}{:>10}{:>12}{:>12}", "scene", "image", "median", "triangles");
    if let Some(cases) = support::cases() {
        let (_, camera, pose) = support::capture(&cases.join("street-ideal"));
        let (scene, _) = support::scene(&cases.join("maps/street"));
        report("street", &scene, &camera, &pose);
    }
    for side in [10, 32, 141] {
        let scene = city(side);
        let middle = f64::from(side) * 10.0 + 4.0;
        let position = GridPoint::new(ORIGIN.easting_m + middle, ORIGIN.northing_m + middle, ORIGIN.height_m + 1.6);
        let pose = Pose { position, yaw_rad: 0.3, pitch_rad: 0.15, roll_rad: 0.01 };
        report(&format!("city of {} boxes", side * side), &scene, &wide(), &pose);
    }
}

fn report(name: &str, scene: &Scene, camera: &Camera, pose: &Pose) {
    let triangles = scene.positions().len();
    let line = |what: &str, size: &str, micros: f64, triangles: usize| {
        println!("{:<28}{size:>10}{micros:>9.0} µs{triangles:>12}", format!("{name}, {what}"));
    };
    for (stride, size) in SIZES {
        let small = camera.subsampled(stride).pinhole().expect("pinhole");
        let (whole, visible, shown) = labels(scene, &small, pose);
        line("labels", size, whole, triangles);
        line("labels, visible only", size, visible, shown);
    }
    line("view, all cores", "960x720", median(|| black_box(view(scene, camera, pose))), triangles);
}

fn labels(scene: &Scene, camera: &Pinhole, pose: &Pose) -> (f64, f64, usize) {
    let mut renderer = Renderer::new();
    let mut image = LabelImage::filled(camera.width(), camera.height(), 0);
    let whole = median(|| renderer.render_labels(scene, camera, pose, black_box(&mut image)));
    let visible = renderer.visible_triangles(scene, camera, pose);
    let culled = median(|| renderer.render_labels_of((scene, &visible), camera, pose, black_box(&mut image)));
    (whole, culled, visible.len())
}

/// Median of at least 30 runs, microseconds; `RESURVEY_BENCH_BEST` set: the best, for a busy machine.
fn median<T>(mut run: impl FnMut() -> T) -> f64 {
    let mut times = Vec::new();
    let start = Instant::now();
    while times.len() < 30 || (start.elapsed().as_millis() < 400 && times.len() < 2000) {
        let before = Instant::now();
        black_box(run());
        times.push(before.elapsed().as_secs_f64() * 1e6);
    }
    times.sort_by(f64::total_cmp);
    if std::env::var_os("RESURVEY_BENCH_BEST").is_some() { times[0] } else { times[times.len() / 2] }
}

const ORIGIN: GridPoint = GridPoint::new(836_000.0, 818_000.0, 4.5);

fn wide() -> Camera {
    let (fx, fy, cx, cy) = (346.410_162, 346.410_162, 480.0, 360.0);
    let (width, height, model) = (960, 720, CameraModel::Pinhole);
    Camera::new(Intrinsics { model, width, height, fx, fy, cx, cy, distortion: [0.0; 5] }).expect("valid")
}

/// `side × side` boxes of 12 m on a 20 m grid, 6–60 m high, 10 triangles each, every other one textured.
fn city(side: i32) -> Scene {
    let labels = LabelImage::from_values(8, 8, (0..64).map(|texel| texel % 3).collect()).expect("64 texels");
    let texture = LabelTexture { name: "t".into(), labels, wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat };
    let mut objects = vec![building([-900.0, -900.0], 1800.0, -0.01, Surface::Class(ClassId(8)))];
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        let height = 6.0 + ((i * 37 + j * 91) % 55) as f32;
        let textured = (i + j) % 2 == 0;
        let surface = if textured { Surface::Texture(texture.clone()) } else { Surface::Class(ClassId(0)) };
        objects.push(building([20.0 * i as f32 + 8.0, 20.0 * j as f32 + 8.0], 12.0, height, surface));
    }
    let with_ids: Vec<(u64, &Object)> = objects.iter().enumerate().map(|(fid, object)| (fid as u64, object)).collect();
    Scene::new(ORIGIN, &with_ids, &[], &ClassTable::default())
}

fn building([east, north]: [f32; 2], size: f32, height: f32, surface: Surface) -> Object {
    let plan = [[east, north], [east + size, north], [east + size, north + size], [east, north + size]];
    let mut mesh = Mesh {
        origin: ORIGIN,
        vertices: Vec::new(),
        uvs: Vec::new(),
        triangles: Vec::new(),
        triangle_surfaces: Vec::new(),
        surfaces: vec![surface],
    };
    let walls = (0..4).map(|k| [(k, 0.0), ((k + 1) % 4, 0.0), ((k + 1) % 4, height), (k, height)]);
    for face in walls.chain([[(0, height), (1, height), (2, height), (3, height)]]) {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(face.map(|(corner, up): (usize, f32)| [plan[corner][0], plan[corner][1], up]));
        mesh.uvs.extend([[0.0, 1.0], [3.0, 1.0], [3.0, 0.0], [0.0, 0.0]]);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        mesh.triangle_surfaces.extend([0, 0]);
    }
    Object { name: "box".into(), mesh }
}
