//! What a plugin costs, linked in, opened, and in a process of its own: `cargo bench --bench plugin_calls`. Best of some
//! runs, because others use the machine too.
#![allow(clippy::unwrap_used, reason = "a measurement that cannot be made ends")]

#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

use resurvey_core::image::Raster;
use resurvey_core::plugin::{Digest, Isolation, Matcher, Plugin, Registry, ViewImages};
use resurvey_schema::GridPoint;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};
use synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, SceneKind, write_case, write_map};

const PROGRAM: &str = env!("CARGO_BIN_EXE_resurvey");
const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const VIEWS: usize = 5000;

fn main() {
    let directory = tempfile::tempdir().unwrap();
    let skyline = built("resurvey_skyline");
    let linked = Plugin::builtin(resurvey_skyline::plugin()).unwrap();
    println!("skyline, a matcher in Rust; photo and view of 96 × 72 pixels unless said\n");
    let opened = Registry::new([digest(&skyline)]).load_file(&skyline).unwrap();
    let apart = isolated(&skyline);
    println!("file read, hashed, started, ended         {:>9.2} ms", best_ms(40, || drop(isolated(&skyline))));
    // The process that is there already is taken first.
    let mut held = vec![matcher(&apart)];
    println!("start of a process with an instance       {:>9.2} ms", best_ms(40, || held.push(matcher(&apart))));
    drop(held);
    println!("instance in a process that is there       {:>9.1} µs", 1e3 * best_ms(200, || drop(matcher(&apart))));
    for (width, height) in [(1, 1), (96, 72)] {
        println!("\none call at {width} × {height}");
        for (name, plugin) in [("linked in", &linked), ("opened", &opened), ("process", &apart)] {
            println!("  {name:<20}{:>12.3} µs", one_call_us(&mut matcher(plugin), width, height));
        }
    }
    println!("\n{VIEWS} views that are there already");
    for (name, plugin) in [("linked in", &linked), ("process", &apart)] {
        println!("  {name:<20}{:>12.1} ms", many_ms(&mut matcher(plugin)));
    }
    localize(directory.path());
}

/// A library that Cargo built beside this program.
fn built(name: &str) -> PathBuf {
    let file = format!("{}{name}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    std::env::current_exe().unwrap().with_file_name(file)
}

fn digest(path: &Path) -> Digest {
    Digest::of(&std::fs::read(path).unwrap())
}

fn isolated(path: &Path) -> Plugin {
    let mut registry = Registry::new([digest(path)]);
    registry.isolate(Isolation { program: Some(PROGRAM.into()), ..Isolation::default() });
    registry.load_file(path).unwrap()
}

fn matcher(plugin: &Plugin) -> Matcher {
    plugin.matcher(&plugin.settings([]).unwrap()).unwrap()
}

fn best_ms(runs: usize, mut body: impl FnMut()) -> f64 {
    let one = |_| {
        let started = Instant::now();
        body();
        started.elapsed()
    };
    (0..runs).map(one).min().unwrap_or(Duration::ZERO).as_secs_f64() * 1e3
}

/// Rasters of a view: sky over stone.
struct Rasters {
    labels: Raster<u8>,
    range_m: Raster<f32>,
    points: Raster<[f32; 3]>,
    features: Raster<u32>,
}

impl Rasters {
    fn new(width: u32, height: u32) -> Self {
        let pixels = width * height;
        let labels = (0..pixels).map(|pixel| if pixel < pixels / 2 { 6 } else { 0 }).collect();
        Self {
            labels: Raster::from_values(width, height, labels).unwrap(),
            range_m: Raster::filled(width, height, 10.0),
            points: Raster::filled(width, height, [1.0; 3]),
            features: Raster::filled(width, height, 0),
        }
    }

    fn view(&self) -> ViewImages<'_> {
        ViewImages {
            origin: GridPoint::new(836_694.05, 819_069.8, 5.5),
            labels: &self.labels,
            range_m: &self.range_m,
            points: &self.points,
            features: &self.features,
            feature_table: &[],
        }
    }
}

fn one_call_us(matcher: &mut Matcher, width: u32, height: u32) -> f64 {
    const CALLS: usize = 500;
    let rasters = Rasters::new(width, height);
    // One pixel of sky, so that there is something to compare.
    let photo = Raster::filled(width, height, 6);
    let best = best_ms(60, || {
        for _ in 0..CALLS {
            black_box(matcher.score(&photo, &rasters.view()).unwrap());
        }
    });
    best * 1e3 / CALLS as f64
}

fn many_ms(matcher: &mut Matcher) -> f64 {
    let all: Vec<Rasters> = (0..8).map(|_| Rasters::new(96, 72)).collect();
    let photo = Raster::filled(96, 72, 6);
    best_ms(10, || {
        let view = &mut |index: usize, take: &mut dyn FnMut(&ViewImages<'_>)| take(&all[index % all.len()].view());
        let scores = matcher.score_each(&photo, VIEWS, view, &|| false);
        assert_eq!(scores.unwrap().len(), VIEWS);
    })
}

/// The same library in and out of process, in a search that renders.
fn localize(directory: &Path) {
    let library = directory.join("libagreement.so");
    let source = format!("{ROOT}/plugins/fixtures/c/matcher.c");
    let compiled = Command::new("cc")
        .args(["-std=c11", "-O2", "-fPIC", "-shared", "-I", &format!("{ROOT}/schema/include"), &source, "-o"])
        .arg(&library)
        .status();
    if !compiled.is_ok_and(|status| status.success()) {
        println!("\nSKIPPED: no C compiler cc; the search was not measured");
        return;
    }
    let scene = Scene::new(SceneKind::Street, 7);
    let folder = write_map(&scene, directory).unwrap();
    let spec = CaseSpec {
        name: "capture".to_owned(),
        change: ChangeKind::Banner,
        noise: NoiseLevel::LIGHT,
        seed: 7,
        grid_prior: false,
    };
    let capture = write_case(&Case::new(&scene, spec).unwrap(), directory).unwrap().join("capture.json");
    let map = directory.join("map.rsv");
    let origin = scene.origin.map(|number| number.to_string()).join(",");
    run(&["init".as_ref(), map.as_os_str()]);
    run(&[
        "import".as_ref(),
        map.as_os_str(),
        folder.join("street.3ds").as_os_str(),
        "--origin".as_ref(),
        origin.as_ref(),
    ]);
    let sha256 = digest(&library).to_string();
    println!("\na search through a matcher in C, rendering each view");
    for (name, option) in [("opened", &["--in-process"][..]), ("process", &[])] {
        let mut words = vec!["localize".as_ref(), map.as_os_str(), capture.as_os_str()];
        let plugin = ["--matcher", "agreement", "--allow-plugin", &sha256, "--plugin-dir"];
        words.extend(plugin.iter().map(AsRef::<std::ffi::OsStr>::as_ref));
        words.push(directory.as_os_str());
        words.extend(["--set", "search.yaw_range_deg=80", "--json"].map(AsRef::<std::ffi::OsStr>::as_ref));
        words.extend(option.iter().map(AsRef::<std::ffi::OsStr>::as_ref));
        let runs: Vec<serde_json::Value> = (0..5).map(|_| serde_json::from_slice(&run(&words)).unwrap()).collect();
        let times = runs.iter().map(|run| run["timings_ms"]["localize"].as_f64().unwrap());
        let best = times.fold(f64::INFINITY, f64::min);
        println!("  {name:<20}{best:>12.1} ms for {} candidates", runs[0]["candidates"]);
    }
}

/// Standard output of the program; a pose that is not reliable is one, too.
fn run(words: &[&std::ffi::OsStr]) -> Vec<u8> {
    let output = Command::new(PROGRAM).args(words).output().unwrap();
    let is_fine = matches!(output.status.code(), Some(0 | 22));
    assert!(is_fine, "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
    output.stdout
}
