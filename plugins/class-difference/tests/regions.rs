//! What counts as a change, on a wall of the toy world.

mod wall;

use resurvey_class_difference::ClassDifference;
use resurvey_plugin::schema::{ClassId, DynamicDescriptor, GridPoint, MaterialDescriptor};
use resurvey_plugin::schema::{Descriptor, PixelBox};
use resurvey_plugin::toy::{ToyCamera, ToyHost, noise};
use resurvey_plugin::{Detector, Plugin, PoseEstimate};
use wall::{BANNER, CHAIR, FOLIAGE, GLASS, OTHERS, STONE, WIDTH, host, pose, regions, regions_with, settings, wall};

/// The photo of the wall with `class` painted into a box of pixels.
fn painted(class: ClassId, bounds: PixelBox) -> Vec<u8> {
    let mut labels = host(wall()).labels(&pose());
    for v in bounds.top..bounds.bottom {
        let row = v as usize * WIDTH;
        labels[row + bounds.left as usize..row + bounds.right as usize].fill(class.0);
    }
    labels
}

const ACROSS: PixelBox = PixelBox { left: 400, top: 230, right: 520, bottom: 390 };
const ON_STONE: PixelBox = PixelBox { left: 400, top: 365, right: 480, bottom: 412 };

#[test]
fn a_banner_before_stone_and_glass_is_one_region_with_exact_edges() {
    let found = regions(wall(), painted(BANNER, ACROSS));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].class_before, found[0].class_after), (STONE, BANNER), "most of it is on stone");
    assert_eq!((found[0].bounds, found[0].pixels), (ACROSS, 120 * 160));
}

#[test]
fn the_paper_s_profile_cuts_it_in_pairs_and_drops_what_is_under_5_percent() {
    let paper = [("profile", "paper".into())];
    assert_eq!(regions_with(wall(), painted(BANNER, ACROSS), pose(), &paper), []);
    let large = PixelBox { left: 200, top: 210, right: 760, bottom: 400 };
    let found = regions_with(wall(), painted(BANNER, large), pose(), &paper);
    assert!(!found.is_empty() && found.iter().all(|region| region.pixels >= 34_560), "5 % of 960×720, docs/method.md");
    assert_eq!(regions(wall(), painted(BANNER, large)).len(), 1);
}

#[test]
fn holes_and_wrong_patches_in_a_region_are_filled() {
    let mut labels = painted(BANNER, ACROSS);
    noise::ellipse(&mut labels, WIDTH, ([460.0, 300.0], [12.0, 9.0], 0.4), OTHERS);
    noise::ellipse(&mut labels, WIDTH, ([430.0, 350.0], [10.0, 10.0], 0.0), STONE);
    let found = regions(wall(), labels);
    assert_eq!((found.len(), found[0].pixels), (1, 120 * 160));
}

#[test]
fn a_patch_of_30_pixels_is_no_region() {
    for class in [STONE, GLASS, BANNER, ClassId(2), OTHERS] {
        let mut labels = host(wall()).labels(&pose());
        noise::ellipse(&mut labels, WIDTH, ([300.0, 300.0], [15.0, 15.0], 0.0), class);
        noise::ellipse(&mut labels, WIDTH, ([600.0, 600.0], [15.0, 12.0], 0.0), class);
        assert_eq!(regions(wall(), labels), []);
    }
}

#[test]
fn void_foliage_and_others_are_never_a_change() {
    for class in [ClassId::VOID, FOLIAGE, OTHERS, ClassId(6), ClassId(77)] {
        assert_eq!(regions(wall(), painted(class, ACROSS)), []);
    }
}

#[test]
fn nothing_can_be_attached_to_the_sky_but_people_stand_before_it() {
    let sky = PixelBox { left: 400, top: 20, right: 470, bottom: 150 };
    assert_eq!(regions(wall(), painted(BANNER, sky)), []);
    assert_eq!(regions(wall(), painted(CHAIR, sky)).len(), 1);
}

#[test]
fn a_moved_class_edge_is_no_change_within_the_pose_error_and_one_beyond() {
    let labels = host(wall()).labels(&pose());
    let raised = |height_m: f64| {
        let mut at = pose();
        at.position.height_m += height_m;
        regions_with(wall(), labels.clone(), at, &[("map_tolerance_m", 0.05.into())])
    };
    assert_eq!(raised(0.15), []);
    assert!(!raised(1.2).is_empty(), "1.2 m at 10 m are 41 px");
}

#[test]
fn a_class_that_is_close_by_loses_no_edge() {
    // Glass painted on stone right below the glass stripe: the tolerance hides its upper rim, growing brings it back.
    let below = PixelBox { left: 420, bottom: ON_STONE.bottom, top: 346, right: 520 };
    let found = regions(wall(), painted(GLASS, below));
    assert_eq!(found.len(), 1);
    let bounds = found[0].bounds;
    assert_eq!((bounds.left, bounds.right, bounds.bottom), (below.left, below.right, below.bottom));
    assert!(bounds.top <= 350, "{bounds:?}");
}

fn chair(position: GridPoint) -> Descriptor {
    let size_m = [0.5, 0.5, 0.9];
    Descriptor::Dynamic(DynamicDescriptor { class: CHAIR, position, size_m, yaw_rad: None, sigma: None })
}

#[test]
fn a_chair_that_is_gone_is_a_region_of_its_pixels_although_the_ground_is_ignored() {
    let mut map = wall();
    map.add_descriptor(chair(GridPoint::new(0.0, 4.0, 0.0)));
    let seen = host(map.clone()).labels(&pose()).iter().filter(|label| **label == CHAIR.0).count();
    let found = regions(map, host(wall()).labels(&pose()));
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].class_before, found[0].class_after, found[0].pixels as usize), (CHAIR, OTHERS, seen));
}

#[test]
fn a_new_chair_beside_one_on_the_map_is_the_only_change() {
    let (old, new) = (GridPoint::new(-0.3, 4.0, 0.0), GridPoint::new(0.3, 4.0, 0.0));
    let mut map = wall();
    map.add_descriptor(chair(old));
    let mut world = map.clone();
    world.add_descriptor(chair(new));
    let found = regions(map, host(world).labels(&pose()));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].bounds.left >= 480, "the old chair is left of the middle: {:?}", found[0].bounds);
}

#[test]
fn a_banner_replaced_by_metal_is_an_addition_and_no_removal() {
    let corner = |e: f64, h: f64| GridPoint::new(e, 10.0, h);
    let corners = [corner(-2.0, 0.2), corner(1.0, 0.2), corner(1.0, 1.2), corner(-2.0, 1.2)];
    let banner = MaterialDescriptor { class: BANNER, corners, normal: [0.0, -1.0, 0.0], sigma: None };
    let metal = MaterialDescriptor { class: ClassId(2), ..banner.clone() };
    let (mut map, mut world) = (wall(), wall());
    map.add_descriptor(Descriptor::Material(banner));
    world.add_descriptor(Descriptor::Material(metal));
    let found = regions(map, host(world).labels(&pose()));
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].class_before, found[0].class_after), (BANNER, ClassId(2)));
}

#[test]
fn images_of_different_size_are_an_error() {
    let host = host(wall());
    let estimate = PoseEstimate {
        pose: pose(),
        covariance: [[0.0; 3]; 3],
        height_sigma_m: 0.0,
        tilt_sigma_rad: 0.0,
        alignment: None,
    };
    let capture = host.capture(host.labels(&pose()), estimate);
    let mut comparison = capture.comparison();
    let small = [0u8; 4];
    comparison.photo = resurvey_plugin::ImageRef::new(&small, 2, 2, 2).expect("2×2 pixels");
    let mut detector = ClassDifference::create(settings(&[])).expect("the defaults are accepted");
    let error = detector.detect(&host, &comparison).expect_err("sizes differ");
    assert!(error.0.contains("2×2") && error.0.contains("960×720"), "{error}");
}

#[test]
fn a_single_pixel_and_a_covariance_of_nan_are_survived() {
    let host = ToyHost::new(wall(), ToyCamera::intrinsics(1, 1, 120.0));
    let estimate = PoseEstimate {
        pose: pose(),
        covariance: [[f64::NAN; 3]; 3],
        height_sigma_m: f64::NAN,
        tilt_sigma_rad: 0.0,
        alignment: None,
    };
    for class in [BANNER, CHAIR, ClassId::VOID] {
        let capture = host.capture(vec![class.0], estimate);
        let mut detector = ClassDifference::create(settings(&[])).expect("the defaults are accepted");
        let found = detector.detect(&host, &capture.comparison()).expect("the toy host answers");
        assert!(found.len() <= 1);
    }
}
