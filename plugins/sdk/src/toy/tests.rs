use super::*;
use crate::host::Host;
use crate::{ClassSet, CompareRequest, PanoramaRequest};
use resurvey_schema::{ClassId, GridPoint, Pose};

const STONE: ClassId = ClassId(0);
const CHAIR: ClassId = ClassId(5);
const SKY: u8 = 6;
const OTHERS: ClassId = ClassId(8);

const NONE: ClassSet = ClassSet([0; 4]);
const EVERY_SECOND: CompareRequest =
    CompareRequest { stride: 2, ignored_in_photo: NONE, ignored_in_view: NONE, boundary_tolerance_px: 0.0 };
/// Five headings, 5° apart.
const HEADINGS: PanoramaRequest = PanoramaRequest {
    pitch_rad: 0.0,
    roll_rad: 0.0,
    first_yaw_rad: 0.0,
    yaw_step_columns: 1,
    yaw_count: 5,
    columns: 72,
    ignored_in_photo: NONE,
    ignored_in_view: NONE,
};

fn level(position: GridPoint, yaw_deg: f64) -> Pose {
    Pose { position, yaw_rad: yaw_deg.to_radians(), pitch_rad: 0.0, roll_rad: 0.0 }
}

#[test]
fn the_focal_length_is_that_of_the_diagonal() {
    // Half the diagonal of 1200 px over tan 60°.
    assert!((ToyCamera::intrinsics(960, 720, 120.0).fx - 346.410_162).abs() < 1e-6);
}

#[test]
fn a_wall_ahead_is_seen_at_its_distance_between_ground_and_sky() {
    let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
    scene.add_wall([-50.0, 20.0], [50.0, 20.0], [0.0, 5.0], Paint::Plain(STONE));
    let host = ToyHost::new(scene, ToyCamera::intrinsics(96, 72, 120.0));
    let pose = level(GridPoint::new(0.0, 0.0, 1.6), 0.0);
    let view = &host.render(1, true, &[pose]).unwrap()[0];
    let at = |u: usize, v: usize| view.labels[v * 96 + u];
    assert_eq!([at(48, 0), at(48, 35), at(48, 71)], [SKY, STONE.0, OTHERS.0]);
    assert!((f64::from(view.points[35 * 96 + 48][1]) - 20.0).abs() < 1e-4);
    let ray = host.pixel_rays(&pose, &[[48.0, 36.0]]).unwrap()[0];
    assert!((ray[1] - 1.0).abs() < 1e-12, "the principal point looks north at yaw 0");
}

#[test]
fn projecting_what_a_pixel_shows_gives_the_pixel_back() {
    let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
    scene.add_box(GridPoint::new(3.0, 4.0, 0.0), [0.5, 0.5, 0.9], CHAIR);
    let host = ToyHost::new(scene, ToyCamera::intrinsics(96, 72, 120.0));
    let pose = Pose { pitch_rad: -0.1, roll_rad: 0.2, ..level(GridPoint::new(0.0, 0.0, 1.6), 37.0) };
    for pixel in [[40.5, 60.5], [10.25, 70.0], [90.0, 50.0]] {
        let ray = host.pixel_rays(&pose, &[pixel]).unwrap();
        let hit = host.cast_rays(pose.position, &ray, 1e3, true).unwrap()[0].unwrap();
        let back = host.project(&pose, &[hit.point]).unwrap()[0].unwrap();
        assert!((back[0] - pixel[0]).hypot(back[1] - pixel[1]) < 1e-9);
    }
}

#[test]
fn roll_lowers_the_right_side() {
    // Roll is positive with the right side down, so what is level on the right moves up.
    let camera = |roll_rad: f64| {
        let pose = Pose { roll_rad, ..level(GridPoint::new(0.0, 0.0, 0.0), 0.0) };
        ToyCamera::new(ToyCamera::intrinsics(96, 72, 120.0), pose)
    };
    let right = GridPoint::new(1.0, 2.0, 0.0);
    assert!(camera(0.1).project(right).unwrap()[1] < camera(0.0).project(right).unwrap()[1]);
}

#[test]
fn descriptors_are_seen_only_when_asked_for() {
    use resurvey_schema::{Descriptor, DynamicDescriptor};
    let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
    let position = GridPoint::new(0.0, 4.0, 0.0);
    let size_m = [0.5, 0.5, 0.9];
    let fid = scene.add_descriptor(Descriptor::Dynamic(DynamicDescriptor {
        class: CHAIR,
        position,
        size_m,
        yaw_rad: None,
        sigma: None,
    }));
    let host = ToyHost::new(scene, ToyCamera::intrinsics(96, 72, 120.0));
    let pose = level(GridPoint::new(0.0, 0.0, 1.6), 0.0);
    let estimate = crate::PoseEstimate {
        pose,
        covariance: [[0.0; 3]; 3],
        height_sigma_m: 0.0,
        tilt_sigma_rad: 0.0,
        alignment: None,
    };
    let capture = host.capture(host.labels(&pose), estimate);
    let rendered = host.render(1, true, &[pose]).unwrap();
    assert_eq!(rendered[0].view().feature_table, capture.comparison().view.feature_table);
    let comparison = capture.comparison();
    let seen = comparison.view.features.at(48, 45);
    assert_eq!(comparison.view.feature_table[seen as usize - 1].fid, fid);
    assert!(host.render(1, false, &[pose]).unwrap()[0].features.iter().all(|feature| *feature == 0));
    assert_eq!(host.ground_height(GridPoint::new(0.0, 4.0, 3.0)).unwrap(), Some(0.0));
}

/// A stone wall 10 m ahead, with a chair before it.
fn before_a_wall() -> ToyHost {
    let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
    scene.add_wall([-20.0, 10.0], [20.0, 10.0], [0.0, 9.0], Paint::Plain(STONE));
    scene.add_box(GridPoint::new(0.0, 5.0, 0.0), [0.5, 0.5, 0.9], CHAIR);
    ToyHost::new(scene, ToyCamera::intrinsics(64, 48, 90.0))
}

#[test]
fn a_comparison_counts_what_the_header_says() {
    use super::compare::counts;
    use crate::ClassCounts;
    let mut request = CompareRequest { boundary_tolerance_px: 1.0, ..EVERY_SECOND };
    request.stride = 1;
    // Class 1 is a square of four in the photo, and one column further right in the view; the last pixel is void.
    let photo = [0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 0, 0, 255];
    let view = [0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 0, 0];
    let found = counts(&photo, &view, 4, 2, &request);
    let one = ClassCounts {
        photo: 4,
        view: 4,
        both: 2,
        photo_boundary: 4,
        photo_boundary_matched: 4,
        view_boundary: 4,
        view_boundary_matched: 4,
    };
    assert_eq!(found[1], one);
    assert_eq!((found[0].photo, found[0].view, found[0].both), (11, 11, 9));
    request.boundary_tolerance_px = 0.5;
    assert_eq!(counts(&photo, &view, 4, 2, &request)[1].photo_boundary_matched, 2);
    request.ignored_in_view.insert(ClassId(0));
    let found = counts(&photo, &view, 4, 2, &request);
    assert_eq!((found[1].photo, found[1].view, found[0].photo, found[0].view), (2, 4, 2, 0));
}

#[test]
fn a_search_can_be_tried_with_either_comparison() {
    use crate::{Prior, score};
    let mut host = before_a_wall();
    let truth = level(GridPoint::new(1.0, 0.0, 1.6), 15.0);
    let prior =
        Prior { pose: truth, position_sigma_m: 5.0, height_sigma_m: 0.5, yaw_sigma_rad: 0.3, tilt_sigma_rad: 0.02 };
    assert!(host.photo(prior).is_none());
    let error = host.compare_views(&EVERY_SECOND, &[truth]).unwrap_err();
    assert!(error.0.contains("set photo_labels"), "{error}");

    host.photo_labels = host.labels(&truth);
    assert_eq!(host.photo(prior).unwrap().labels.rows().count(), 48);
    let poses = [level(GridPoint::new(-1.0, 0.0, 1.6), 15.0), truth];
    let views = host.compare_views(&EVERY_SECOND, &poses).unwrap();
    let stone = |counts: &crate::ViewCounts| score::dice(&counts[usize::from(STONE.0)]).unwrap();
    assert!(stone(&views[0]) < stone(&views[1]) && (stone(&views[1]) - 1.0).abs() < 1e-12);

    // A column is 5°: the third heading from 5° is that of the photo.
    let first_yaw_rad = 5_f64.to_radians();
    let request = PanoramaRequest { first_yaw_rad, ..HEADINGS };
    let slots = views[0].len();
    let headings: Vec<f64> = host
        .compare_panoramas(&request, &[truth.position])
        .unwrap()
        .chunks(slots)
        .map(|counts| stone(&counts.to_vec()))
        .collect();
    let best = headings.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
    assert_eq!((headings.len(), best.0), (5, 2), "{headings:?}");
}

#[test]
fn a_segmenter_gets_a_picture_and_no_map() {
    let host = before_a_wall();
    let pose = level(GridPoint::new(0.0, 0.0, 1.6), 0.0);
    let picture = host.picture(&pose);
    // Stone is blue and a chair pink in the default table.
    assert_eq!((picture[10 * 64 + 32], picture[33 * 64 + 32]), ([0, 0, 255], [255, 192, 203]));
    let placeless = host.placeless();
    assert_eq!(placeless.classes(), host.classes());
    assert!(placeless.parallel_for(2, &|_| ()).is_ok());
    let position = pose.position;
    let answers = [
        placeless.render(1, true, &[pose]).err(),
        placeless.compare_views(&EVERY_SECOND, &[pose]).err(),
        placeless.compare_panoramas(&HEADINGS, &[position]).err(),
        placeless.inside_solid(&[position]).err(),
        placeless.pixel_rays(&pose, &[[1.0, 1.0]]).err(),
        placeless.project(&pose, &[position]).err(),
        placeless.cast_rays(position, &[[0.0, 1.0, 0.0]], 9.0, true).err(),
        placeless.descriptors_near(position, 1.0).err(),
        placeless.ground_height(position).err(),
    ];
    for answer in answers {
        assert!(answer.unwrap().0.contains("a segmenter has no map"));
    }
}

#[test]
fn settings_are_completed_as_the_host_does() {
    #[derive(Debug, serde::Deserialize)]
    struct Both {
        least_px: u32,
        range_m: f64,
    }
    impl crate::Plugin for Both {
        const NAME: &'static str = "both";
        const VERSION: &'static str = "1";
        const SUMMARY: &'static str = "Both";
        const SETTINGS: &'static str = r#"{"type": "object", "properties": {
            "least_px": {"type": "integer", "default": 7}, "range_m": {"type": "number", "default": 50}}}"#;
        type Settings = Self;

        fn create(settings: Self) -> Result<Self, crate::Error> {
            Ok(settings)
        }
    }
    let made = create::<Both>(r#"{"range_m": 20.5}"#).unwrap();
    assert_eq!(made.least_px, 7);
    assert!((made.range_m - 20.5).abs() < 1e-12);
    assert!(create::<Both>(r#"{"least_px": -1}"#).unwrap_err().0.contains("settings: invalid value"));
    assert!(create::<Both>("7").unwrap_err().0.contains("changed settings: expected a JSON object"));
}
