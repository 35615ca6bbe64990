//! The exact search against views cast ray by ray and counts made pixel by pixel.

use resurvey_core::camera::{Camera, world_from_camera};
use resurvey_core::capture::Capture;
use resurvey_core::image::LabelImage;
use resurvey_core::localize::{ExhaustiveRequest, Listener, Silent, World, exhaustive};
use resurvey_core::mesh::{Mesh, Object, Surface};
use resurvey_core::metrics::overlap_counts;
use resurvey_core::render::{RayCaster, Scene, SolidMask, view};
use resurvey_core::version::Digest;
use resurvey_schema::service::{ClassCounts, ClassSet, CompareRequest, Level, Prior};
use resurvey_schema::{CameraModel, ClassId, ClassTable, GridPoint, Intrinsics, Pose};

const ORIGIN: GridPoint = GridPoint::new(835_600.0, 817_800.0, 4.5);
const CLASSES: usize = 9;
const TOLERANCE_PX: f64 = 2.0;

/// A box of 4 m × 4 m with a class.
fn block([east, north]: [f32; 2], height: f32, class: u8) -> Object {
    let plan = [[east, north], [east + 4.0, north], [east + 4.0, north + 4.0], [east, north + 4.0]];
    let mut vertices: Vec<[f32; 3]> = plan.iter().map(|[e, n]| [*e, *n, 0.0]).collect();
    vertices.extend(plan.iter().map(|[e, n]| [*e, *n, height]));
    let mut triangles = vec![[4, 5, 6], [4, 6, 7]];
    for (a, b) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
        triangles.extend([[a, b, b + 4], [a, b + 4, a + 4]]);
    }
    object(vertices, triangles, class)
}

fn object(vertices: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>, class: u8) -> Object {
    let triangle_surfaces = vec![0; triangles.len()];
    let surfaces = vec![Surface::Class(ClassId(class))];
    let mesh = Mesh { origin: ORIGIN, vertices, uvs: Vec::new(), triangles, triangle_surfaces, surfaces };
    Object { name: "made up".into(), mesh }
}

fn world() -> World {
    let ground = [[-60.0, -60.0, 0.0], [60.0, -60.0, 0.0], [60.0, 60.0, 0.0], [-60.0, 60.0, 0.0]];
    let mut objects = vec![object(ground.to_vec(), vec![[0, 1, 2], [0, 2, 3]], 8)];
    objects.extend([
        block([-7.0, 9.0], 6.0, 0),
        block([1.0, 13.0], 9.0, 1),
        block([6.0, 6.0], 4.0, 2),
        block([-2.3, -8.4], 5.0, 3),
        block([2.2, -1.3], 3.0, 0),
    ]);
    let with_ids: Vec<(u64, &Object)> = (1..).zip(&objects).collect();
    World::new(ORIGIN, &with_ids, Vec::new(), ClassTable::default())
}

fn camera() -> Camera {
    let (width, height, model) = (100, 72, CameraModel::Pinhole);
    let (fx, fy, cx, cy) = (60.0, 60.0, 50.0, 36.0);
    Camera::new(Intrinsics { model, width, height, fx, fy, cx, cy, distortion: [0.0; 5] }).expect("a valid camera")
}

fn truth() -> Pose {
    let position = GridPoint::new(ORIGIN.easting_m, ORIGIN.northing_m, ORIGIN.height_m + 1.6);
    Pose { position, yaw_rad: 0.1, pitch_rad: 0.05, roll_rad: 0.01 }
}

/// A capture whose prior is off by a whole number of steps.
fn capture(world: &World) -> Capture {
    let mut prior = truth();
    prior.position.easting_m += 1.0;
    prior.position.northing_m -= 2.0;
    prior.yaw_rad -= 4_f64.to_radians();
    Capture {
        labels: view(world.scene(true), &camera(), &truth()).labels,
        label_bytes: Vec::new(),
        camera: camera(),
        prior: Prior {
            pose: prior,
            position_sigma_m: 2.0,
            height_sigma_m: 0.1,
            yaw_sigma_rad: 0.1,
            tilt_sigma_rad: 0.02,
        },
        taken_at: None,
        digest: Digest::of(b"made up"),
    }
}

fn request() -> ExhaustiveRequest {
    let compare = CompareRequest {
        stride: 1,
        ignored_in_photo: ClassSet::default(),
        ignored_in_view: ClassSet::default(),
        boundary_tolerance_px: TOLERANCE_PX,
    };
    ExhaustiveRequest { radius_m: 3.0, spacing_m: 1.0, yaw_range_deg: 4.0, yaw_step_deg: 2.0, compare }
}

fn sum(of: fn(&ClassCounts) -> u32) -> impl Fn(&[ClassCounts]) -> f64 + Sync {
    move |counts| f64::from(counts.iter().map(of).sum::<u32>())
}

const PARTS: [fn(&ClassCounts) -> u32; 4] = [
    |count| count.both,
    |count| count.view_boundary,
    |count| count.photo_boundary_matched,
    |count| count.view_boundary_matched,
];

/// A view of one ray per pixel.
fn cast(scene: &Scene, caster: &RayCaster, pose: &Pose) -> LabelImage {
    let camera = camera();
    let map_from_camera = world_from_camera(pose);
    let mut labels = LabelImage::filled(camera.width(), camera.height(), scene.sky().0);
    for (u, v) in (0..camera.height()).flat_map(|v| (0..camera.width()).map(move |u| (u, v))) {
        let ray = camera.ray(f64::from(u) + 0.5, f64::from(v) + 0.5).expect("a pinhole has a ray everywhere");
        if let Some(hit) = caster.cast(pose.position, (map_from_camera * ray).into(), f64::INFINITY) {
            labels.set(u, v, hit.class.0);
        }
    }
    labels
}

/// Pixels of a class with a 4-neighbour of another.
fn boundary(image: &LabelImage, class: u8) -> Vec<(i32, i32)> {
    let (width, height) = (image.width() as i32, image.height() as i32);
    let is = |u: i32, v: i32| image.at(u as u32, v as u32) == class;
    let pixels = (0..height).flat_map(|v| (0..width).map(move |u| (u, v)));
    let on_edge = |u: i32, v: i32| {
        let beside = [(u - 1, v), (u + 1, v), (u, v - 1), (u, v + 1)];
        beside.iter().any(|&(u, v)| (0..width).contains(&u) && (0..height).contains(&v) && !is(u, v))
    };
    pixels.filter(|&(u, v)| is(u, v) && on_edge(u, v)).collect()
}

fn matched(of: &[(i32, i32)], near: &[(i32, i32)]) -> u32 {
    let is_near = |a: &(i32, i32), b: &(i32, i32)| {
        f64::from((a.0 - b.0).pow(2) + (a.1 - b.1).pow(2)) <= TOLERANCE_PX * TOLERANCE_PX
    };
    of.iter().filter(|a| near.iter().any(|b| is_near(a, b))).count() as u32
}

fn naive_counts(photo: &LabelImage, seen: &LabelImage) -> Vec<ClassCounts> {
    let mut counts = overlap_counts(photo, seen, CLASSES, &ClassSet::default(), &ClassSet::default());
    for (class, count) in counts.iter_mut().enumerate() {
        let (a, b) = (boundary(photo, class as u8), boundary(seen, class as u8));
        count.view_boundary = b.len() as u32;
        count.photo_boundary_matched = matched(&a, &b);
        count.view_boundary_matched = matched(&b, &a);
    }
    counts
}

#[test]
fn counts_of_every_candidate_are_those_of_rays_and_definitions() {
    let world = world();
    let (scene, capture) = (world.scene(true), capture(&world));
    let parts = PARTS.map(sum);
    let scores = [0, 1, 2, 3].map(|part| &parts[part] as &(dyn Fn(&[ClassCounts]) -> f64 + Sync));
    let found = exhaustive(&world, &capture, &request(), &scores, &Silent).unwrap();
    assert_eq!(found.candidates() + found.skipped(), 29 * 5, "29 grid points lie within 3 m, with 5 headings each");
    assert!(found.skipped() > 0, "some of them are inside the block beside the camera");
    let solids = SolidMask::at_height(world.scene(false), truth().position.height_m);
    let caster = RayCaster::new(scene);
    let all: Vec<Vec<(Pose, f64)>> = (0..4).map(|score| found.scored(score).collect()).collect();
    let mut differing = 0;
    for (index, (pose, _)) in all[0].iter().enumerate() {
        assert!(!solids.contains(pose.position));
        let naive = naive_counts(&capture.labels, &cast(scene, &caster, pose));
        for (part, values) in PARTS.iter().zip(&all) {
            let expected = f64::from(naive.iter().map(part).sum::<u32>());
            // A ray exactly along an edge may fall either way, and takes its boundary pixels with it.
            assert!((values[index].1 - expected).abs() <= 4.0, "{} and {expected} at {pose:?}", values[index].1);
            differing += u32::from((values[index].1 - expected).abs() > 0.5);
        }
    }
    println!("{differing} of {} sums differ", 4 * all[0].len());
    assert!(differing as usize * 50 <= 4 * all[0].len(), "{differing} of {} sums differ", 4 * all[0].len());
}

#[test]
fn the_best_candidate_is_the_truth_whatever_the_number_of_threads() {
    let world = world();
    let capture = capture(&world);
    let score = sum(PARTS[0]);
    let run = || exhaustive(&world, &capture, &request(), &[&score], &Silent).unwrap();
    let found = run();
    let (best, value) = found.best(0).unwrap();
    assert!(best.position.plan_distance_m(&truth().position) < 1e-6 && (best.yaw_rad - truth().yaw_rad).abs() < 1e-9);
    assert!((value - 7200.0).abs() < 0.5, "all pixels agree: {value}");
    assert!(found.heat(0).iter().any(|[east, north, best]| {
        let here = truth().position;
        (east - here.easting_m).hypot(north - here.northing_m) < 1e-6 && *best >= value
    }));
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(run), found);
}

#[test]
fn a_cancelled_search_has_no_result_and_a_senseless_one_ends_at_once() {
    struct Impatient;
    impl Listener for Impatient {
        fn log(&self, _: Level, _: &str) {}
        fn progress(&self, _: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let world = world();
    let capture = capture(&world);
    assert!(exhaustive(&world, &capture, &request(), &[], &Impatient).is_none());
    for spacing_m in [0.0, -1.0, f64::NAN, 1e-9] {
        let request = ExhaustiveRequest { spacing_m, ..request() };
        assert!(exhaustive(&world, &capture, &request, &[], &Silent).is_none(), "{spacing_m} m");
    }
}
