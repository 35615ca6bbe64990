//! What is on the picture, checked at pixels computed by hand: the plan is 616 px square with its centre at (332, 372)
//! and shows 1.06 times the extent of the cells.

use super::colours::{ESTIMATE, INK, PAPER, PRIOR};
use super::*;
use crate::image::Raster;
use proptest::prelude::*;
use resurvey_schema::GridPoint;

const ORIGIN: [f64; 2] = [835_600.0, 817_800.0];
const TIGHT: [[f64; 3]; 3] = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]];

/// Pixels for a metre when 11 rows of 1 m are shown.
const PX_PER_M: f64 = 616.0 / (11.0 * 1.06);

fn pose(east_m: f64, north_m: f64, heading_deg: f64) -> Pose {
    let position = GridPoint::new(ORIGIN[0] + east_m, ORIGIN[1] + north_m, 6.0);
    Pose { position, yaw_rad: heading_deg.to_radians(), pitch_rad: 0.0, roll_rad: 0.0 }
}

/// 11 × 11 positions, 1 m apart, with the score that `score` gives for the offset from their centre.
fn square(score: impl Fn(i32, i32) -> Option<f64>) -> Vec<[f64; 3]> {
    let offsets = (-5..=5).flat_map(|north| (-5..=5).map(move |east| (east, north)));
    let cell = |(east, north)| {
        score(east, north).map(|score| [ORIGIN[0] + f64::from(east), ORIGIN[1] + f64::from(north), score])
    };
    offsets.filter_map(cell).collect()
}

fn flat() -> Vec<[f64; 3]> {
    square(|_, _| Some(0.5))
}

/// Prior and estimate in opposite corners, away from what a test looks at.
fn corners(heat: &[[f64; 3]]) -> HeatMap<'_> {
    let (prior, estimate) = (pose(-4.0, -4.0, 180.0), pose(4.0, 4.0, 0.0));
    HeatMap { heat, prior, estimate, truth: None, covariance: TIGHT, score: 0.8, title: "a search" }
}

fn picture(input: &HeatMap<'_>) -> Raster<[u8; 3]> {
    let png = heat_map(input).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let colours = bytes.as_chunks::<3>().0.to_vec();
    Raster::from_values(info.width, info.height, colours).unwrap()
}

/// The colour of the picture `east_px` right and `north_px` up of where an offset in metres is.
fn beside(picture: &Raster<[u8; 3]>, [east_m, north_m]: [f64; 2], [east_px, north_px]: [f64; 2]) -> [u8; 3] {
    let (x, y) = (332.0 + east_m * PX_PER_M + east_px, 372.0 - north_m * PX_PER_M - north_px);
    picture.at(x as u32, y as u32)
}

fn assert_near(found: [u8; 3], expected: [u8; 3], tolerance: u8) {
    let is_near = found.iter().zip(expected).all(|(found, expected)| found.abs_diff(expected) <= tolerance);
    assert!(is_near, "expected {expected:?}, found {found:?}");
}

#[test]
fn scores_have_the_colours_of_viridis_with_north_up() {
    // Entries 0, 64, 128, 191 and 255 of the published table of 256.
    let published = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [92, 200, 99], [253, 231, 37]];
    let places = [[0, 0], [2, 0], [0, 2], [-2, 0], [0, -2]];
    let share = [0.0, 64.0 / 255.0, 128.0 / 255.0, 191.0 / 255.0, 1.0];
    let heat = square(|east, north| {
        let place = places.iter().position(|place| *place == [east, north]);
        Some(0.2 + 0.6 * place.map_or(0.0, |index| share[index]))
    });
    let picture = picture(&corners(&heat));
    for ([east, north], colour) in places.into_iter().zip(published) {
        assert_near(beside(&picture, [f64::from(east), f64::from(north)], [0.0, 0.0]), colour, 2);
        // The whole cell, 52.8 px wide, not its middle alone.
        assert_near(beside(&picture, [f64::from(east) + 0.45, f64::from(north) - 0.45], [0.0, 0.0]), colour, 2);
    }
}

#[test]
fn a_place_without_a_candidate_is_grey() {
    let heat = square(|east, north| ((east, north) != (1, 2)).then_some(0.5 + f64::from(east) / 100.0));
    let picture = picture(&corners(&heat));
    let is_grey = |[red, green, blue]: [u8; 3]| red == green && green == blue && (200..240).contains(&red);
    assert!(is_grey(beside(&picture, [1.0, 2.0], [0.0, 0.0])));
    assert!(!is_grey(beside(&picture, [2.0, 1.0], [0.0, 0.0])));
}

#[test]
fn columns_taken_out_by_buildings_do_not_change_the_spacing() {
    let full = flat();
    let holed = square(|east, _| (![-3, -2, 1, 2, 4].contains(&east)).then_some(0.5));
    assert!(holed.len() < full.len());
    assert!((Cells::new(&full).spacing_m() - 1.0).abs() < 1e-9);
    assert!((Cells::new(&holed).spacing_m() - 1.0).abs() < 1e-9);
}

#[test]
fn each_pose_has_its_shape_where_it_is() {
    let heat = flat();
    let input = HeatMap {
        prior: pose(-3.0, 1.0, 90.0),
        estimate: pose(2.0, 2.0, 180.0),
        truth: Some(pose(1.0, -3.0, 270.0)),
        ..corners(&heat)
    };
    let picture = picture(&input);
    let at = |metres, pixels| beside(&picture, metres, pixels);
    // The prior: a ring of 8 px, hollow, its ray to the east.
    assert_eq!([at([-3.0, 1.0], [0.0, 8.0]), at([-3.0, 1.0], [30.0, 0.0])], [PRIOR; 2]);
    assert_near(at([-3.0, 1.0], [0.0, 0.0]), [33, 145, 140], 2);
    // The estimate: a cross of 11 px, its ray to the south.
    assert_eq!([at([2.0, 2.0], [-8.0, 0.0]), at([2.0, 2.0], [0.0, 8.0]), at([2.0, 2.0], [0.0, -40.0])], [ESTIMATE; 3]);
    // The truth: a bright diamond of 14 px in a dark rim, its ray to the west.
    assert_eq!([at([1.0, -3.0], [7.0, 7.0]), at([1.0, -3.0], [-40.0, 0.0])], [PAPER; 2]);
    assert_near(at([1.0, -3.0], [0.0, 0.0]), [33, 145, 140], 2);
}

#[test]
fn the_ellipse_has_the_axes_of_the_covariance() {
    let heat = flat();
    // σ 2 m to the north-east, 1 m to the north-west: eigenvalues 4 and 1 of the matrix.
    let covariance = [[2.5, 1.5, 0.0], [1.5, 2.5, 0.0], [0.0, 0.0, 1e-4]];
    let input =
        HeatMap { prior: pose(-4.9, 0.0, 180.0), estimate: pose(0.0, 0.0, 270.0), covariance, ..corners(&heat) };
    let picture = picture(&input);
    let half = 0.5_f64.sqrt();
    for (east, north, sigma_m) in [(half, half, 2.0), (-half, -half, 2.0), (-half, half, 1.0), (half, -half, 1.0)] {
        let on = beside(&picture, [east * sigma_m, north * sigma_m], [0.0, 0.0]);
        assert!(on[0] > 150 && on[1] < 100, "expected red at {sigma_m} m, found {on:?}");
        assert_near(beside(&picture, [east * sigma_m * 1.2, north * sigma_m * 1.2], [0.0, 0.0]), [33, 145, 140], 2);
    }
}

#[test]
fn a_covariance_that_is_not_positive_has_no_ellipse_and_still_a_picture() {
    let heat = flat();
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(heat_map(&HeatMap { covariance: [[wrong; 3]; 3], ..corners(&heat) }).is_ok());
    }
}

#[test]
fn a_truth_far_outside_is_an_arrow_at_the_edge() {
    let heat = flat();
    let picture = picture(&HeatMap { truth: Some(pose(500.0, 0.0, 0.0)), ..corners(&heat) });
    // Its diamond stays 34 px inside the right edge (640) of the plan; the head of the arrow is 20 to 32 px further.
    assert_eq!(picture.at(606 - 14, 372), PAPER);
    assert_eq!(picture.at(606 + 23, 372), PAPER);
    assert!(picture.at(606 + 19, 372)[0] < 80, "the rim of the head is dark");
    // The plan did not grow to it: its cells are where they were.
    assert_near(beside(&picture, [5.4, 2.0], [0.0, 0.0]), [33, 145, 140], 2);
}

#[test]
fn nothing_of_the_plan_is_drawn_over_its_frame() {
    let heat = flat();
    let wide = [[400.0, 0.0, 0.0], [0.0, 400.0, 0.0], [0.0, 0.0, 1e-4]];
    let picture = picture(&HeatMap { estimate: pose(5.4, -5.4, 135.0), covariance: wide, ..corners(&heat) });
    assert_eq!((picture.width(), picture.height()), SIZE_PX);
    assert!((63..=680).all(|y| picture.at(640, y) == INK && picture.at(643, y) == PAPER));
}

#[test]
fn the_same_positions_in_any_order_give_the_same_bytes() {
    let heat = square(|east, north| Some(0.5 + f64::from(east * north) / 100.0));
    let mut reversed = heat.clone();
    reversed.reverse();
    let first = heat_map(&corners(&heat)).unwrap();
    assert!(first == heat_map(&corners(&heat)).unwrap());
    assert!(first == heat_map(&corners(&reversed)).unwrap());
}

#[test]
fn none_one_and_a_hundred_thousand_positions_have_a_picture() {
    let line: Vec<[f64; 3]> = (0..100_000).map(|east| [f64::from(east), 0.0, f64::from(east % 7) / 7.0]).collect();
    let heap = vec![[ORIGIN[0], ORIGIN[1], 1.0]; 100_000];
    let lone = [[ORIGIN[0], ORIGIN[1], 0.0]];
    for heat in [&[][..], &lone[..], &heap[..], &line[..]] {
        assert_eq!(picture(&corners(heat)).width(), SIZE_PX.0);
    }
}

#[test]
fn a_position_without_a_score_is_refused_by_its_index() {
    let mut heat = flat();
    heat[7][2] = f64::NAN;
    let found = heat_map(&corners(&heat)).unwrap_err().to_string();
    assert!(found.contains("NaN] at index 7"), "{found}");
    let heat = flat();
    let found = heat_map(&HeatMap { prior: pose(f64::INFINITY, 0.0, 0.0), ..corners(&heat) }).unwrap_err().to_string();
    assert!(found.ends_with("found inf m, 817800 m, 0 rad in the prior pose"), "{found}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_input_gives_a_picture_or_an_error(
        heat in prop::collection::vec(prop::array::uniform3(-1e8..1e8), 0..40),
        near in prop::collection::vec(prop::array::uniform3(0.0..1.0), 0..40),
        poses in prop::array::uniform9(prop_oneof![-1e3..1e3, any::<f64>()]),
        covariance in prop::array::uniform3(prop::array::uniform3(prop_oneof![-1.0..9.0, any::<f64>()])),
        title in any::<String>(),
    ) {
        let any_pose = |first: usize| Pose {
            position: GridPoint::new(poses[first], poses[first + 1], 0.0),
            yaw_rad: poses[first + 2],
            pitch_rad: 0.0,
            roll_rad: 0.0,
        };
        for heat in [&heat, &near] {
            let (prior, estimate, truth) = (any_pose(0), any_pose(3), Some(any_pose(6)));
            let input = HeatMap { heat, prior, estimate, truth, covariance, score: covariance[0][1], title: &title };
            if let Err(error) = heat_map(&input) {
                prop_assert!(!matches!(error, HeatMapError::Image(_)), "{error}");
            }
        }
        let (prior, estimate) = (pose(0.0, 0.0, 0.0), pose(1e6, -1e6, 1e9));
        let finite = HeatMap { heat: &near, prior, estimate, truth: Some(prior), covariance, score: 0.0, title: &title };
        prop_assert!(heat_map(&finite).is_ok());
    }
}
