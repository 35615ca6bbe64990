//! Every service through the line and back, called by a matcher in `search` form.

use super::scene::{CAMERA, GROUND_M, PRIOR, Rasters, Scene, chair};
use resurvey_core::plugin::{Matcher, MatcherForm, Plugin as Loaded, PluginError};
use resurvey_plugin::schema::abi::Declaration;
use resurvey_plugin::schema::{ClassId, GridPoint, Localization, RunnerUp, Wgs84};
use resurvey_plugin::{ClassSet, CompareRequest, Error, Host, Level, PanoramaRequest, Photo, Plugin, Searcher, export};
use std::sync::atomic::{AtomicUsize, Ordering};

static ASKS: Declaration = export::searcher::<Asks>();

/// Asks the host for everything and compares the answers; what it does else comes from its setting.
struct Asks {
    what: String,
}

#[derive(serde::Deserialize)]
struct Settings {
    what: String,
}

impl Plugin for Asks {
    const NAME: &'static str = "asks";
    const VERSION: &'static str = "1";
    const SUMMARY: &'static str = "Asks for everything";
    const SETTINGS: &'static str = r#"{"properties": {"what": {"type": "string", "default": "all"}}}"#;
    type Settings = Settings;

    fn create(Settings { what }: Settings) -> Result<Self, Error> {
        Ok(Self { what })
    }
}

impl Searcher for Asks {
    fn search(&mut self, host: &dyn Host, photo: &Photo<'_>) -> Result<Localization, Error> {
        match self.what.as_str() {
            "all" => {
                check_photo(photo);
                check_views(host);
                check_counts(host);
                check_geometry(host)?;
                check_loop(host)?;
                host.log(Level::Info, "größer");
                host.progress(0.5);
                host.progress(7.0);
            }
            "panic-in-loop" => host.parallel_for(8, &|index| assert!(index != 5, "item {index} is odd"))?,
            "far-away" => drop(host.grid_from_wgs84(wgs84(51.5))?),
            "not-finite" => drop(host.ground_height(GridPoint::new(f64::NAN, 0.0, 0.0))?),
            "cancel" if host.cancelled() => return Err(Error("stopping".into())),
            "lonely" => return Ok(Localization { runner_up: None, heat: Vec::new(), ..answer() }),
            "lopsided" => return Ok(Localization { covariance: [[1.0, 2.0, 0.0], [0.0; 3], [0.0; 3]], ..answer() }),
            "nowhere" => return Ok(Localization { heat: vec![[f64::NAN; 3]], ..answer() }),
            _ => {}
        }
        Ok(answer())
    }
}

fn answer() -> Localization {
    Localization {
        pose: PRIOR.pose,
        score: 0.75,
        covariance: [[1.0, 0.5, 0.25], [0.5, 2.0, 0.125], [0.25, 0.125, 3.0]],
        runner_up: Some(RunnerUp { distance_m: 6.0, score_ratio: 0.5 }),
        candidates: 407_025,
        skipped: u64::MAX,
        heat: vec![[1.0, 2.0, 0.5], [3.0, 4.0, 0.25]],
    }
}

fn wgs84(latitude_deg: f64) -> Wgs84 {
    Wgs84 { latitude_deg, longitude_deg: 114.0, ellipsoidal_height_m: 3.0 }
}

fn check_photo(photo: &Photo<'_>) {
    assert_eq!((photo.camera, photo.prior), (CAMERA, PRIOR));
    let rasters = Rasters::new();
    assert_eq!((0..3).flat_map(|v| photo.labels.row(v)).copied().collect::<Vec<_>>(), rasters.photo.values());
}

fn check_views(host: &dyn Host) {
    assert_eq!(host.classes(), &resurvey_plugin::schema::ClassTable::default());
    let mut poses = [PRIOR.pose; 3];
    poses[2].position.height_m += 1.0;
    let views = host.render(1, true, &poses).unwrap();
    let rasters = Rasters::new();
    assert_eq!(views.len(), 3);
    assert_eq!(views[2].origin, poses[2].position);
    assert_eq!((views[1].width, views[1].height), (4, 3));
    assert_eq!((&views[1].labels[..], &views[1].range_m[..]), (rasters.labels.values(), rasters.range_m.values()));
    assert_eq!((&views[1].points[..], &views[1].features[..]), (rasters.points.values(), rasters.features.values()));
    assert_eq!(host.render(2, false, &poses).unwrap_err().0, "asked for stride 2, descriptors false");
    assert_eq!(host.render(0, true, &poses).unwrap_err().0, "the stride is 0; expected at least 1");
}

fn check_counts(host: &dyn Host) {
    let mut set = ClassSet::default();
    set.insert(ClassId(200));
    let request = CompareRequest {
        stride: 4,
        ignored_in_photo: set,
        ignored_in_view: ClassSet::default(),
        boundary_tolerance_px: 9.0,
    };
    let counts = host.compare_views(&request, &[PRIOR.pose; 2]).unwrap();
    assert_eq!((counts.len(), counts[0].len()), (2, 9));
    let last = counts[1][8];
    assert_eq!((last.photo, last.view, last.both), (17, 4, 1));
    assert_eq!((last.photo_boundary, last.view_boundary_matched), (0, 9));

    let request = PanoramaRequest {
        pitch_rad: 1.0,
        roll_rad: 2.0,
        first_yaw_rad: 3.0,
        yaw_step_columns: 2,
        yaw_count: 81,
        columns: 360,
        ignored_in_photo: set,
        ignored_in_view: set,
    };
    let counts = host.compare_panoramas(&request, &[PRIOR.pose.position; 5]).unwrap();
    assert_eq!(counts.len(), 5 * 81 * 9);
    let last = counts[5 * 81 * 9 - 1];
    assert_eq!((last.photo, last.view, last.both, last.view_boundary), (3644, 362, 6, 0));
    assert!(host.compare_panoramas(&request, &[]).unwrap().is_empty());
}

fn check_geometry(host: &dyn Host) -> Result<(), Error> {
    let point = |northing_m, height_m| GridPoint::new(1.0, northing_m, height_m);
    assert_eq!(host.inside_solid(&[point(9.0, 0.0), point(11.0, 0.0)])?, [false, true]);
    assert_eq!(host.pixel_rays(&PRIOR.pose, &[[0.5, 1.5]])?, [[0.5, 1.5, 0.5]]);
    assert_eq!(host.project(&PRIOR.pose, &[point(1.0, 2.0), point(-1.0, 2.0)])?, [Some([1.5, 2.0]), None]);
    let hits = host.cast_rays(point(4.0, 1.0), &[[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]], 50.0, true)?;
    let hit = hits[0].unwrap();
    assert_eq!((hit.point, hit.class, hit.fid, hits[1]), (point(10.0, 1.0), ClassId(1), Some(9), None));
    assert_eq!((hit.range_m, hit.normal), (6.0, [0.0, -1.0, 0.0]));
    assert_eq!(host.cast_rays(point(4.0, 1.0), &[[0.0, 1.0, 0.0]], 50.0, false)?[0].unwrap().fid, None);
    assert_eq!(host.descriptors_near(point(2.0, 0.0), 1.0)?, [(42, chair())]);
    assert_eq!(host.descriptors_near(point(9.0, 0.0), 1.0)?, []);
    assert_eq!(host.ground_height(point(0.0, 5.0))?, Some(GROUND_M));
    assert_eq!(host.ground_height(point(0.0, 3.0))?, None);
    assert_eq!(host.grid_from_wgs84(wgs84(22.0))?, GridPoint::new(114.0, 22.0, 3.0));
    assert_eq!(host.wgs84_from_grid(GridPoint::new(114.0, 22.0, 3.0))?, wgs84(22.0));
    Ok(())
}

fn check_loop(host: &dyn Host) -> Result<(), Error> {
    let sum = AtomicUsize::new(0);
    host.parallel_for(1001, &|index| {
        // Services answer on every thread of the loop.
        assert!(!host.cancelled());
        sum.fetch_add(index, Ordering::Relaxed);
    })?;
    // Gauss: 1000 · 1001 / 2.
    assert_eq!(sum.into_inner(), 500_500);
    Ok(())
}

fn asking(what: &str) -> Matcher {
    let plugin = Loaded::builtin(&ASKS).unwrap();
    plugin.matcher(&plugin.settings([("what", what)]).unwrap()).unwrap()
}

fn search(what: &str) -> Result<Localization, PluginError> {
    let scene = Scene::new();
    asking(what).search(&scene, &scene.rasters.photo())
}

#[test]
fn every_service_answers_through_the_line_as_the_scene_does() {
    let scene = Scene::new();
    let mut matcher = asking("all");
    assert_eq!(matcher.form(), MatcherForm::Search);
    let found = matcher.search(&scene, &scene.rasters.photo());
    assert_eq!(found, Ok(answer()));
    assert_eq!(*scene.heard.lock().unwrap(), ["Info: größer", "0.5", "1"]);
}

#[test]
fn an_answer_without_a_runner_up_stays_without() {
    let found = search("lonely").unwrap();
    assert_eq!(found, Localization { runner_up: None, heat: Vec::new(), ..answer() });
}

#[test]
fn a_panic_in_a_parallel_loop_is_the_panic_of_the_call() {
    let Err(PluginError::Panicked { text, .. }) = search("panic-in-loop") else { panic!("expected a panic") };
    assert!(text.starts_with("item 5 is odd at tests/plugins/services.rs:"), "{text}");
}

#[test]
fn an_error_of_a_service_reaches_the_user_through_the_plugin() {
    let message = search("far-away").unwrap_err().to_string();
    assert_eq!(message, "plugin asks gave no answer in search: latitude 51.5 is outside of Hong Kong");
    let message = search("not-finite").unwrap_err().to_string();
    assert_eq!(message, "plugin asks gave no answer in search: a position is not finite");
}

#[test]
fn a_call_that_ends_because_it_was_cancelled_is_not_a_failure() {
    let scene = Scene::new();
    scene.cancelled.store(true, Ordering::Relaxed);
    let error = asking("cancel").search(&scene, &scene.rasters.photo()).unwrap_err();
    assert_eq!(error, PluginError::Cancelled { plugin: "asks".into(), call: "search" });
}

#[test]
fn a_localization_that_breaks_a_rule_names_the_field() {
    let message = search("lopsided").unwrap_err().to_string();
    let expected = "plugin asks answered covariance[0][1] = 2 against 0 in search; expected a symmetric matrix";
    assert_eq!(message, expected);
    let message = search("nowhere").unwrap_err().to_string();
    assert_eq!(message, "plugin asks answered heat[0] = NaN in search; expected a finite number");
}
