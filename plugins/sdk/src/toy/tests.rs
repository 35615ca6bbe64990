use super::*;
use crate::host::Host;
use resurvey_schema::{ClassId, GridPoint, Pose};

const STONE: ClassId = ClassId(0);
const CHAIR: ClassId = ClassId(5);
const SKY: u8 = 6;
const OTHERS: ClassId = ClassId(8);

fn level(position: GridPoint, yaw_deg: f64) -> Pose {
    Pose { position, yaw_rad: yaw_deg.to_radians(), pitch_rad: 0.0, roll_rad: 0.0 }
}

#[test]
fn the_focal_length_is_that_of_the_conventions() {
    // 600 / tan 60°, docs/conventions.md
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
    // docs/conventions.md: roll is positive with the right side down, so what is level on the right moves up.
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
    let capture = host.capture(
        host.labels(&pose),
        crate::PoseEstimate {
            pose,
            covariance: [[0.0; 3]; 3],
            height_sigma_m: 0.0,
            tilt_sigma_rad: 0.0,
            alignment: None,
        },
    );
    let comparison = capture.comparison();
    let seen = comparison.view.features.at(48, 45);
    assert_eq!(comparison.view.feature_table[seen as usize - 1].fid, fid);
    assert!(host.render(1, false, &[pose]).unwrap()[0].features.iter().all(|feature| *feature == 0));
    assert_eq!(host.ground_height(GridPoint::new(0.0, 4.0, 3.0)).unwrap(), Some(0.0));
}
