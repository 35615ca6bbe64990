//! The built-in plugins as libraries in processes of their own: every answer is the one they give linked in.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test's helpers may fail loudly")]

#[path = "common/mod.rs"]
mod common;
#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

use common::Place;
use resurvey_core::capture::{Capture, PriorSource, RoughCapture, read_pose};
use resurvey_core::crs::Crs;
use resurvey_core::localize::{SceneServices, World};
use resurvey_core::plugin::{Digest, Isolation, PhotoInput, Plugin, PluginError, Registry, Services, ViewImages};
use resurvey_core::render::view;
use resurvey_core::store::{History, MapFile};
use resurvey_core::update::{Comparison, pose_estimate, world_around};
use resurvey_schema::abi::Declaration;
use resurvey_schema::{ChangeRegion, ClassId, Localization, PixelBox, Pose};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use synthetic::{ChangeKind, NoiseLevel, Scene, SceneKind};

/// Hears what a plugin says, and cancels it.
#[derive(Default)]
struct Ear {
    heard: Mutex<Vec<String>>,
    cancelled: AtomicBool,
}

impl resurvey_core::localize::Listener for Ear {
    fn log(&self, _: resurvey_schema::service::Level, text: &str) {
        self.heard.lock().unwrap().push(text.to_owned());
    }

    fn progress(&self, _: f64) {}

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

/// Listens with a bug.
struct Broken;

impl resurvey_core::localize::Listener for Broken {
    fn log(&self, _: resurvey_schema::service::Level, text: &str) {
        panic!("cannot hear {text:?}");
    }

    fn progress(&self, fraction: f64) {
        panic!("cannot see {fraction}");
    }

    fn cancelled(&self) -> bool {
        false
    }
}

/// A library that Cargo built beside this test.
fn library(name: &str) -> PathBuf {
    let file = format!("{}{name}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    std::env::current_exe().unwrap().with_file_name(file)
}

/// The plugin in `file`, in a process of its own.
fn apart(file: &Path) -> Plugin {
    let bytes = std::fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut registry = Registry::new([Digest::of(&bytes)]);
    registry.isolate(Isolation { program: Some(env!("CARGO_BIN_EXE_resurvey").into()), ..Isolation::default() });
    registry.load_file(file).unwrap()
}

/// The plugin linked in, and its library in a process.
fn both(declaration: &'static Declaration, name: &str) -> [Plugin; 2] {
    let (linked, apart) = (Plugin::builtin(declaration).unwrap(), apart(&library(name)));
    assert!(apart.info().is_apart);
    assert_eq!(apart.info().settings_schema, linked.info().settings_schema);
    [linked, apart]
}

/// A street with a new banner, a photo of it, and where that was taken.
struct Sight {
    world: World,
    capture: Capture,
    truth: Localization,
}

impl Sight {
    fn new() -> Self {
        let place = Place::new(Scene::new(SceneKind::Street, 7), "3ds");
        let (case, file) = place.capture(ChangeKind::Banner, NoiseLevel::LIGHT, 7);
        let map = MapFile::open_read_only(&place.path("map.rsv")).unwrap();
        let snapshot = map.snapshot(map.head().unwrap()).unwrap();
        let rough = RoughCapture::read(&file, &PriorSource::Capture, snapshot.classes(), crs()).unwrap();
        let world = world_around(&snapshot, rough.position()).unwrap();
        let (capture, _) = rough.settle(world.scene(false)).unwrap();
        let truth = place.path("truth.json");
        std::fs::write(&truth, serde_json::json!({ "pose": case.truth.json["pose"] }).to_string()).unwrap();
        Self { world, capture, truth: at(read_pose(&truth).unwrap()) }
    }

    fn services<'a>(&'a self, listener: &'a dyn resurvey_core::localize::Listener) -> SceneServices<'a> {
        SceneServices::new(&self.world, &self.capture, crs(), listener)
    }

    /// Photo and map at the true pose.
    fn compare<T>(&self, act: impl FnOnce(&Comparison<'_>) -> T) -> T {
        let scene = self.world.scene(true);
        let seen = view(scene, &self.capture.camera, &self.truth.pose);
        let estimate = pose_estimate(&self.truth, &self.capture);
        act(&Comparison { capture: &self.capture, view: &seen, scene, estimate })
    }
}

fn crs() -> Crs {
    "EPSG:2326".parse().unwrap()
}

fn at(pose: Pose) -> Localization {
    Localization {
        pose,
        score: 1.0,
        covariance: [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-6]],
        alignment: None,
        runner_up: None,
        candidates: 0,
        skipped: 0,
        heat: Vec::new(),
    }
}

#[test]
fn built_in_plugins_answer_the_same_in_a_process_of_their_own() {
    let (sight, ear) = (Sight::new(), Ear::default());
    let services = sight.services(&ear);
    let capture = &sight.capture;
    let camera = capture.camera.intrinsics();
    let photo = PhotoInput { labels: &capture.labels, camera: &camera, prior: &capture.prior };
    let [linked, apart] = both(resurvey_semantic::plugin(), "resurvey_semantic").map(|plugin| {
        let settings = plugin.settings([("radius_m", "12")]).unwrap();
        let found = plugin.matcher(&settings).unwrap().search(&services, &photo).unwrap();
        (found, std::mem::take(&mut *ear.heard.lock().unwrap()))
    });
    assert_eq!(linked, apart);

    let [linked, apart] = both(resurvey_class_difference::plugin(), "resurvey_class_difference").map(|plugin| {
        let mut detector = plugin.detector(&plugin.settings([]).unwrap()).unwrap();
        sight.compare(|comparison| comparison.detect(&mut detector, &services).unwrap())
    });
    assert!(!linked.is_empty());
    assert_eq!(linked, apart);
    let regions = linked;
    let [linked, apart] = both(resurvey_descriptors::plugin(), "resurvey_descriptors").map(|plugin| {
        let mut estimator = plugin.estimator(&plugin.settings([]).unwrap()).unwrap();
        sight.compare(|comparison| comparison.estimate(&mut estimator, &services, &regions).unwrap())
    });
    assert!(!linked.is_empty());
    assert_eq!(linked, apart);

    let [_, apart] = both(resurvey_semantic::plugin(), "resurvey_semantic");
    ear.cancelled.store(true, Ordering::Relaxed);
    assert!(services.cancelled());
    let ended = apart.matcher(&apart.settings([]).unwrap()).unwrap().search(&services, &photo);
    assert!(matches!(ended, Err(PluginError::Cancelled { call: "search", .. })), "{ended:?}");
    // A partial answer is none: it comes back as done, and is not taken.
    let [linked, apart] = both(resurvey_class_difference::plugin(), "resurvey_class_difference").map(|plugin| {
        let mut detector = plugin.detector(&plugin.settings([]).unwrap()).unwrap();
        sight.compare(|comparison| comparison.detect(&mut detector, &services))
    });
    assert_eq!(linked, apart);
    assert!(linked.unwrap_err().to_string().contains("was cancelled in detect"));
}

#[test]
fn a_bug_of_the_host_itself_does_not_end_the_run() {
    let sight = Sight::new();
    let capture = &sight.capture;
    let camera = capture.camera.intrinsics();
    let photo = PhotoInput { labels: &capture.labels, camera: &camera, prior: &capture.prior };
    let [linked, apart] = both(resurvey_semantic::plugin(), "resurvey_semantic").map(|plugin| {
        let settings = plugin.settings([("radius_m", "4")]).unwrap();
        plugin.matcher(&settings).unwrap().search(&sight.services(&Broken), &photo).unwrap()
    });
    assert_eq!(linked, apart);
}

#[test]
fn ten_thousand_regions_reach_an_estimator_and_come_back() {
    let (sight, ear) = (Sight::new(), Ear::default());
    let services = sight.services(&ear);
    let width = sight.capture.labels.width();
    let region = |index: u32| {
        let (left, top) = (index % width, index / width);
        let bounds = PixelBox { left, top, right: left + 1, bottom: top + 1 };
        ChangeRegion { class_before: ClassId(0), class_after: ClassId(3), bounds, mask: vec![1], pixels: 1 }
    };
    let regions: Vec<ChangeRegion> = (0..10_000).map(region).collect();
    let plugin = apart(&library("resurvey_descriptors"));
    let mut estimator = plugin.estimator(&plugin.settings([]).unwrap()).unwrap();
    let proposals = sight.compare(|comparison| comparison.estimate(&mut estimator, &services, &regions).unwrap());
    assert_eq!(proposals.len(), regions.len());
    estimator.finish().unwrap();
}

#[test]
fn scoring_ends_soon_after_a_cancel() {
    let plugin = apart(&library("resurvey_skyline"));
    let mut matcher = plugin.matcher(&plugin.settings([]).unwrap()).unwrap();
    let sight = Sight::new();
    let seen = view(sight.world.scene(true), &sight.capture.camera, &sight.truth.pose);
    let images = ViewImages {
        origin: seen.origin,
        labels: &seen.labels,
        range_m: &seen.range_m,
        points: &seen.points,
        features: &seen.features,
        feature_table: sight.world.scene(true).feature_table(),
    };
    let made = AtomicUsize::new(0);
    let scored = matcher.score_each(
        &sight.capture.labels,
        100_000,
        &mut |_, take| {
            made.fetch_add(1, Ordering::Relaxed);
            take(&images);
        },
        &|| made.load(Ordering::Relaxed) > 20,
    );
    assert!(matches!(scored, Err(PluginError::Cancelled { call: "score", .. })), "{scored:?}");
    assert!(made.load(Ordering::Relaxed) < 1000);
    // The instance is there for the next call.
    matcher.score(&sight.capture.labels, &images).unwrap();
}

/// Loads the plugin in `file`, puts another file in its place and asks for one more process.
fn change_after_loading(file: &Path) {
    let plugin = apart(file);
    let settings = plugin.settings([]).unwrap();
    // The process that is there already is taken first.
    let _first = plugin.matcher(&settings).unwrap();
    let beside = file.with_extension("new");
    std::fs::copy(file, &beside).unwrap();
    std::fs::rename(&beside, file).unwrap();
    let refused = plugin.matcher(&settings).unwrap_err().to_string();
    assert!(refused.contains("at file: it was changed between its check and its start"), "{refused}");
}

#[test]
fn a_file_that_was_changed_since_it_was_checked_is_not_started() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("libskyline.so");
    std::fs::copy(library("resurvey_skyline"), &file).unwrap();
    change_after_loading(&file);

    let script = directory.path().join("resurvey-plugin-sky");
    let declaration = r#"{"wire": 1, "kind": "matcher", "name": "sky", "version": "1", "summary": "Done"}"#;
    let hello = r#"{"hello": {"wire": 1, "kind": "matcher", "name": "sky", "version": "1", "summary": "Done", "form": "score"}}"#;
    let answers = "while read -r line; do echo '{\"done\": {}}'; done";
    std::fs::write(&script, format!("#!/bin/sh\n# resurvey-plugin: {declaration}\necho '{hello}'\n{answers} <&1\n"))
        .unwrap();
    std::fs::set_permissions(&script, std::fs::Permissions::from_mode(0o755)).unwrap();
    change_after_loading(&script);
}
