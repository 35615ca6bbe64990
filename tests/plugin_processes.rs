//! The built-in plugins as libraries in processes of their own: every answer is the one they give linked in.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test's helpers may fail loudly")]

#[path = "common/mod.rs"]
mod common;
#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

use common::Place;
use resurvey_core::capture::{PriorSource, RoughCapture, read_pose};
use resurvey_core::crs::Crs;
use resurvey_core::localize::{SceneServices, World};
use resurvey_core::plugin::{Digest, Isolation, Plugin, PluginError, Registry, Services};
use resurvey_core::render::view;
use resurvey_core::store::{History, MapFile};
use resurvey_core::update::{Comparison, pose_estimate, world_around};
use resurvey_schema::abi::Declaration;
use resurvey_schema::{Localization, Pose};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
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

/// The plugin linked in, and its library in a process.
fn both(declaration: &'static Declaration, library: &str) -> [Plugin; 2] {
    let file = format!("{}{library}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let file = std::env::current_exe().unwrap().with_file_name(file);
    let bytes = std::fs::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let mut registry = Registry::new([Digest::of(&bytes)]);
    registry.isolate(Isolation { program: Some(env!("CARGO_BIN_EXE_resurvey").into()), ..Isolation::default() });
    let apart = registry.load_file(&file).unwrap();
    assert!(apart.info().is_apart);
    let linked = Plugin::builtin(declaration).unwrap();
    assert_eq!(apart.info().settings_schema, linked.info().settings_schema);
    [linked, apart]
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
    let place = Place::new(Scene::new(SceneKind::Street, 7), "3ds");
    let (case, file) = place.capture(ChangeKind::Banner, NoiseLevel::LIGHT, 7);
    let map = MapFile::open_read_only(&place.path("map.rsv")).unwrap();
    let snapshot = map.snapshot(map.head().unwrap()).unwrap();
    let crs: Crs = "EPSG:2326".parse().unwrap();
    let rough = RoughCapture::read(&file, &PriorSource::Capture, snapshot.classes(), crs).unwrap();
    let world: World = world_around(&snapshot, rough.position()).unwrap();
    let (capture, _) = rough.settle(world.scene(false)).unwrap();
    let ear = Ear::default();
    let services = SceneServices::new(&world, &capture, crs, &ear);

    let camera = capture.camera.intrinsics();
    let photo = resurvey_core::plugin::PhotoInput { labels: &capture.labels, camera: &camera, prior: &capture.prior };
    let [linked, apart] = both(resurvey_semantic::plugin(), "resurvey_semantic").map(|plugin| {
        let settings = plugin.settings([("radius_m", "12")]).unwrap();
        let found = plugin.matcher(&settings).unwrap().search(&services, &photo).unwrap();
        (found, std::mem::take(&mut *ear.heard.lock().unwrap()))
    });
    assert_eq!(linked, apart);

    let truth = place.path("truth.json");
    std::fs::write(&truth, serde_json::json!({ "pose": case.truth.json["pose"] }).to_string()).unwrap();
    let found = at(read_pose(&truth).unwrap());
    let scene = world.scene(true);
    let seen = view(scene, &capture.camera, &found.pose);
    let comparison = Comparison { capture: &capture, view: &seen, scene, estimate: pose_estimate(&found, &capture) };
    let [linked, apart] = both(resurvey_class_difference::plugin(), "resurvey_class_difference").map(|plugin| {
        let mut detector = plugin.detector(&plugin.settings([]).unwrap()).unwrap();
        comparison.detect(&mut detector, &services).unwrap()
    });
    assert!(!linked.is_empty());
    assert_eq!(linked, apart);
    let regions = linked;
    let [linked, apart] = both(resurvey_descriptors::plugin(), "resurvey_descriptors").map(|plugin| {
        let mut estimator = plugin.estimator(&plugin.settings([]).unwrap()).unwrap();
        comparison.estimate(&mut estimator, &services, &regions).unwrap()
    });
    assert!(!linked.is_empty());
    assert_eq!(linked, apart);

    let [_, apart] = both(resurvey_semantic::plugin(), "resurvey_semantic");
    ear.cancelled.store(true, Ordering::Relaxed);
    assert!(services.cancelled());
    let ended = apart.matcher(&apart.settings([]).unwrap()).unwrap().search(&services, &photo);
    assert!(matches!(ended, Err(PluginError::Cancelled { call: "search", .. })), "{ended:?}");
}
