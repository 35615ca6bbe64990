//! Rates of the default search's first stage, every position and heading compared on panoramas:
//! `cargo bench -p resurvey-core --bench panorama`, with numbers of triangles for those cities alone.
//!
//! Best and median of several runs: on a shared machine the best is the least wrong.

#[path = "../tests/support/city.rs"]
mod city;

use rayon::{ThreadPool, ThreadPoolBuilder};
use resurvey_core::capture::Capture;
use resurvey_core::crs::Crs;
use resurvey_core::localize::{SceneServices, Silent, World};
use resurvey_core::mesh::Object;
use resurvey_core::plugin::Services;
use resurvey_core::render::panorama::{Panorama, PanoramaGrid};
use resurvey_core::render::{Scene, view};
use resurvey_core::version::Digest;
use resurvey_schema::service::{ClassCounts, ClassSet, PanoramaRequest, Prior};
use resurvey_schema::{ClassTable, GridPoint, Pose};
use std::hint::black_box;
use std::time::Instant;

const CLASSES: usize = 9;
const HEADINGS: u32 = 81;
/// As many as the semantic matcher asks for in one call.
const POSITIONS_PER_CALL: usize = 256;
const RUNS: usize = 7;

fn main() {
    let only: Vec<usize> = std::env::args().filter_map(|argument| argument.parse().ok()).collect();
    let sizes = if only.is_empty() { vec![20_000, 200_000, 2_000_000] } else { only };
    let pools = [1, 2].map(|threads| ThreadPoolBuilder::new().num_threads(threads).build().expect("threads"));
    for triangles in sizes {
        let objects = city::objects(triangles);
        let with_ids: Vec<(u64, &Object)> = (1..).zip(&objects).collect();
        let world = World::new(city::ORIGIN, &with_ids, Vec::new(), ClassTable::default());
        let capture = capture(world.scene(true));
        println!("\ncity of {} triangles; best and median of {RUNS} runs", world.scene(true).positions().len());
        for radius_m in [20, 40, 80] {
            search(&world, &capture, &pools, radius_m);
        }
    }
}

fn search(world: &World, capture: &Capture, pools: &[ThreadPool; 2], radius_m: i32) {
    let disc: Vec<GridPoint> = disc(capture.prior.pose.position, radius_m).collect();
    let services = || SceneServices::new(world, capture, Crs::Hk1980, &Silent);
    let mut free = Vec::new();
    let solid = best_and_median_s(|| {
        let inside = services().inside_solid(&disc).expect("finite positions");
        free = disc.iter().zip(inside).filter(|(_, inside)| !inside).map(|(position, _)| *position).collect();
    });
    println!(
        "  radius {radius_m} m: {} positions, {} not inside buildings; found {}",
        disc.len(),
        free.len(),
        ms(solid)
    );
    let request = request(capture);
    let mut counts = vec![ClassCounts::default(); POSITIONS_PER_CALL * HEADINGS as usize * CLASSES];
    for pool in pools {
        let whole = best_and_median_s(|| {
            let services = services();
            for positions in free.chunks(POSITIONS_PER_CALL) {
                let counts = &mut counts[..positions.len() * HEADINGS as usize * CLASSES];
                pool.install(|| services.compare_panoramas(&request, positions, counts)).expect("finite positions");
            }
            black_box(&mut counts);
        });
        println!("    {} thread(s): {}", pool.current_num_threads(), ms(whole));
    }
    let grid = PanoramaGrid::new(360, 2, -0.8, 2.0);
    let first = (request.first_yaw_rad.to_degrees().round() as usize + 360 - 54) % 360;
    let wanted: Vec<bool> = (0..360).map(|column| (column + 360 - first) % 360 < 188).collect();
    let columns: Vec<usize> = (0..360).filter(|&column| wanted[column]).collect();
    let (mut panorama, mut classes) = (Panorama::new(&grid, &wanted), vec![0; grid.rows()]);
    let mut all = |looked_at: bool| {
        for position in &free {
            panorama.draw(world.scene(true), world.scene(true).offset(*position));
            for &column in columns.iter().filter(|_| looked_at) {
                panorama.classes(world.scene(true), column, &mut classes);
                black_box(&mut classes);
            }
        }
    };
    let (drawn, with_classes) = (best_and_median_s(|| all(false)), best_and_median_s(|| all(true)));
    println!("    of 1 thread: draw {}, draw and read classes {}", ms(drawn), ms(with_classes));
}

fn best_and_median_s(mut run: impl FnMut()) -> [f64; 2] {
    let mut runs_s = [0.0; RUNS];
    for run_s in &mut runs_s {
        let before = Instant::now();
        run();
        *run_s = before.elapsed().as_secs_f64();
    }
    runs_s.sort_by(f64::total_cmp);
    [runs_s[0], runs_s[RUNS / 2]]
}

fn ms([best_s, median_s]: [f64; 2]) -> String {
    format!("{:.1} / {:.1} ms", best_s * 1e3, median_s * 1e3)
}

fn disc(centre: GridPoint, radius_m: i32) -> impl Iterator<Item = GridPoint> {
    let steps = move || (-radius_m..=radius_m).map(f64::from);
    let offsets = steps().flat_map(move |north| steps().map(move |east| (east, north)));
    offsets.filter(move |(east, north)| east.hypot(*north) <= f64::from(radius_m)).map(move |(east_m, north_m)| {
        GridPoint::new(centre.easting_m + east_m, centre.northing_m + north_m, centre.height_m)
    })
}

/// Headings 40° to either side of the prior's.
fn request(capture: &Capture) -> PanoramaRequest {
    let pose = capture.prior.pose;
    let mut ignored_in_photo = ClassSet::default();
    ignored_in_photo.insert(resurvey_schema::ClassId(7));
    PanoramaRequest {
        pitch_rad: pose.pitch_rad,
        roll_rad: pose.roll_rad,
        first_yaw_rad: pose.yaw_rad - 40_f64.to_radians(),
        yaw_step_columns: 1,
        yaw_count: HEADINGS,
        columns: 360,
        ignored_in_photo,
        ignored_in_view: ClassSet::default(),
    }
}

/// A photo from a place and heading that are no candidate, with something before the street that the map has not.
fn capture(scene: &Scene) -> Capture {
    let pose = city::prior();
    let GridPoint { easting_m, northing_m, height_m } = pose.position;
    let here = GridPoint::new(easting_m + 3.4, northing_m - 2.3, height_m);
    let there = Pose { position: here, yaw_rad: pose.yaw_rad + 7.3_f64.to_radians(), ..pose };
    let mut labels = view(scene, &city::camera(), &there).labels;
    for (u, v) in (330..520).flat_map(|v| (600..690).map(move |u| (u, v))) {
        labels.set(u, v, 7);
    }
    let prior = Prior { pose, position_sigma_m: 10.0, height_sigma_m: 0.1, yaw_sigma_rad: 0.3, tilt_sigma_rad: 0.02 };
    let digest = Digest::of(b"bench");
    Capture { labels, label_bytes: Vec::new(), camera: city::camera(), prior, taken_at: None, digest }
}
