//! The same crate linked in and opened as a library; panics behind the C line.

use super::scene::Rasters;
use resurvey_core::image::Raster;
use resurvey_core::plugin::{Digest, Kind, Matcher, MatcherForm, Plugin, PluginError, Registry, ViewImages};
use std::path::PathBuf;

/// The shared library that Cargo built beside this test; `file` is without `lib` and suffix.
fn library(file: &str) -> PathBuf {
    let name = format!("{}{file}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    std::env::current_exe().unwrap().with_file_name(name)
}

fn open(file: &str) -> Plugin {
    let path = library(file);
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Registry::new([Digest::of(&bytes)]).load_file(&path).unwrap()
}

fn fixture(plugin: &Plugin, mode: &str) -> Result<Matcher, PluginError> {
    plugin.matcher(&plugin.settings([("mode", mode)])?)
}

fn score(matcher: &mut Matcher) -> Result<f64, PluginError> {
    let rasters = Rasters::new();
    matcher.score(&rasters.photo, &rasters.view())
}

/// The fixture as it enters both ways.
fn both_ways() -> [Plugin; 2] {
    [Plugin::builtin(resurvey_fixtures::plugin()).unwrap(), open("resurvey_fixtures")]
}

#[test]
fn skyline_answers_the_same_linked_in_and_as_a_library() {
    let (builtin, file) = (Plugin::builtin(resurvey_skyline::plugin()).unwrap(), open("resurvey_skyline"));
    assert_eq!((builtin.info().builtin, file.info().builtin), (true, false));
    assert_eq!(builtin.info().settings_schema, file.info().settings_schema);
    // Two pixels of sky in both, one in the photo alone, one hidden by foliage: 2/3.
    let labels = |values: [u8; 6]| Raster::from_values(3, 2, values.to_vec()).unwrap();
    let (photo, map) = (labels([6, 6, 6, 7, 0, 0]), labels([6, 6, 0, 6, 0, 0]));
    let (range_m, points, features) =
        (Raster::filled(3, 2, 1.0), Raster::filled(3, 2, [0.0; 3]), Raster::filled(3, 2, 0));
    let view = ViewImages {
        origin: super::scene::POSE.position,
        labels: &map,
        range_m: &range_m,
        points: &points,
        features: &features,
        feature_table: &[],
    };
    for plugin in [builtin, file] {
        assert_eq!((plugin.info().name.as_str(), plugin.info().kind), ("skyline", Kind::Matcher));
        let mut matcher = plugin.matcher(&plugin.settings([]).unwrap()).unwrap();
        assert_eq!(matcher.form(), MatcherForm::Score);
        assert!((matcher.score(&photo, &view).unwrap() - 2.0 / 3.0).abs() < 1e-12);
    }
}

#[test]
fn a_panic_becomes_an_error_with_its_file_and_line_and_the_instance_is_not_used_again() {
    for plugin in both_ways() {
        let mut matcher = fixture(&plugin, "panic-in-score").unwrap();
        let Err(PluginError::Panicked { call: "score", text, .. }) = score(&mut matcher) else {
            panic!("expected a panic")
        };
        assert!(text.contains("out of range") && text.contains("image.rs:"), "{text}");
        assert_eq!(score(&mut matcher), Err(PluginError::Poisoned { plugin: "fixture".into() }));
        assert_eq!(score(&mut fixture(&plugin, "fine").unwrap()), Ok(0.25));
    }
}

#[test]
fn a_panic_in_create_is_told_where_it_happened() {
    for plugin in both_ways() {
        let message = fixture(&plugin, "panic-in-create").unwrap_err().to_string();
        let expected = "plugin fixture panicked in create: asked to panic in create at plugins/fixtures/src/lib.rs:";
        assert!(message.starts_with(expected), "{message}");
    }
}

#[test]
fn a_destructor_that_panics_does_not_end_the_host() {
    for plugin in both_ways() {
        drop(fixture(&plugin, "panic-in-drop").unwrap());
    }
}

#[test]
fn a_score_that_is_not_a_number_is_refused() {
    for plugin in both_ways() {
        let message = score(&mut fixture(&plugin, "not-a-number").unwrap()).unwrap_err().to_string();
        assert_eq!(message, "plugin fixture answered score = NaN in score; expected a number from 0 to 1");
    }
}

#[test]
fn instances_in_several_threads_agree() {
    let plugin = open("resurvey_fixtures");
    let one = || score(&mut fixture(&plugin, "fine").unwrap()).unwrap();
    let scores: Vec<f64> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(one)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    assert_eq!(scores, [0.25; 4]);
}

#[test]
fn a_view_of_another_size_never_reaches_the_plugin() {
    let [plugin, _] = both_ways();
    let rasters = Rasters::new();
    let small = Raster::filled(2, 2, 0);
    let error = fixture(&plugin, "fine").unwrap().score(&small, &rasters.view()).unwrap_err();
    assert_eq!(error.to_string(), "plugin fixture was not called: photo is 2×2, labels of the view 4×3");
}

#[test]
fn a_built_in_plugin_is_found_by_name_and_comes_before_files() {
    let (builtin, library) = (resurvey_fixtures::plugin(), library("resurvey_fixtures"));
    let directory = tempfile::tempdir().unwrap();
    std::fs::copy(&library, directory.path().join("libfixture.so")).unwrap();
    let mut registry = Registry::new([Digest::of(&std::fs::read(&library).unwrap())]);
    registry.add_builtin(builtin).unwrap();
    registry.add_directory(directory.path());
    assert!(registry.load("fixture").unwrap().info().builtin);
    assert!(registry.skipped()[0].refusal.reason.ends_with("already there, built in"));
    assert!(registry.add_builtin(builtin).unwrap_err().to_string().contains("another built-in plugin has this name"));
}

#[test]
fn a_plugin_of_another_kind_is_refused() {
    let [plugin, _] = both_ways();
    let error = plugin.detector(&plugin.settings([]).unwrap()).unwrap_err();
    assert_eq!(error.to_string(), "plugin fixture is a matcher, not a detector");
}
