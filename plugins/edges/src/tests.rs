use super::*;
use resurvey_plugin::toy::trial::{Labels, OFF, best_candidate};

const SKY: u8 = 6;
const VOID: u8 = 255;
const WIDTH: u32 = 60;
const HEIGHT: u32 = 45;

fn edges(truncation: f64, depth_edges: bool) -> Edges {
    let hidden = "4 5 7".to_owned().try_into().unwrap();
    Edges::create(Settings { truncation, depth_edges, depth_jump: 0.1, hidden }).unwrap()
}

fn image(class: impl Fn(u32, u32) -> u8) -> Labels {
    let labels: Vec<u8> = (0..HEIGHT).flat_map(|v| (0..WIDTH).map(move |u| (u, v))).map(|(u, v)| class(u, v)).collect();
    Labels::new(WIDTH, &labels)
}

/// Stone left of column `from`, sky from there on.
fn step(from: u32) -> Labels {
    image(|u, _| if u < from { 0 } else { SKY })
}

/// 60 × 45 has a diagonal of 75 pixels, so that edges count as lost 15 pixels away.
fn score(photo: &Labels, view: &Labels) -> f64 {
    photo.score(&mut edges(0.2, true), view).unwrap()
}

#[test]
fn the_score_falls_evenly_with_the_distance_of_the_edges_down_to_none() {
    for (shift, expected) in [(0, 1.0), (3, 0.8), (6, 0.6), (12, 0.2), (15, 0.0), (25, 0.0)] {
        let found = score(&step(30), &step(30 + shift));
        assert!((found - expected).abs() < 1e-6, "{shift} px: {found}");
        assert!((score(&step(30 + shift), &step(30)) - found).abs() < 1e-12, "symmetric");
    }
}

#[test]
fn the_farther_a_diagonal_edge_moves_the_less_the_score() {
    let diagonal = |shift: u32| image(|u, v| if u + v < 40 + shift { 1 } else { 2 });
    let scores: Vec<f64> = (0..14).map(|shift| score(&diagonal(0), &diagonal(shift))).collect();
    assert!((scores[0] - 1.0).abs() < 1e-12 && scores.is_sorted_by(|a, b| a > b), "{scores:?}");
}

#[test]
fn equal_images_score_one() {
    let photo = image(|u, v| ((u / 7 + v / 5) % 4) as u8);
    assert!((score(&photo, &photo) - 1.0).abs() < 1e-12);
}

#[test]
fn two_images_without_edges_agree_and_edges_of_one_alone_are_not_found() {
    let plain = image(|_, _| 0);
    assert!((score(&plain, &plain) - 1.0).abs() < 1e-12);
    assert!(score(&plain, &step(30)) < 1e-12 && score(&step(30), &plain) < 1e-12);
}

#[test]
fn what_void_and_hidden_classes_cover_is_missed_in_neither_image() {
    // The lower half of the photo's edge, and a second edge of the view, lie behind something.
    let view = image(|u, v| if (u == 50 && v > 20) || u < 30 { 0 } else { SKY });
    for hidden in [VOID, 4, 7] {
        let photo = image(|u, v| if v > 20 { hidden } else { u8::from(u >= 30) * SKY });
        assert!((score(&photo, &view) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_jump_of_range_explains_an_edge_and_asks_for_none() {
    let near_then_far = |u: u32, _: u32| if u < 30 { 8.0 } else { 12.0 };
    let (plain, jump) = (image(|_, _| 0), image(|_, _| 0).at(near_then_far));
    // Two stone walls, one before the other: a photo of classes shows no edge.
    assert!((score(&plain, &jump) - 1.0).abs() < 1e-12);
    // The farther one is glass by now; what else there is has its place.
    let roof = |class: u8| image(move |u, v| if v < 5 { SKY } else { class * u8::from(u >= 30) });
    let found = |depth_edges| roof(1).score(&mut edges(0.2, depth_edges), &roof(0).at(near_then_far)).unwrap();
    assert!((found(true) - 1.0).abs() < 0.03 && found(false) < 0.9, "{} {}", found(true), found(false));
}

#[test]
fn another_photo_is_not_taken_for_the_one_before() {
    let mut matcher = edges(0.2, true);
    for from in [30, 20, 30] {
        assert!((step(from).score(&mut matcher, &step(from)).unwrap() - 1.0).abs() < 1e-12);
    }
    // The same pixels in rows of another length.
    let pixels: Vec<u8> = (0..24).map(|index| index % 5).collect();
    for width in [6, 4, 8] {
        let photo = Labels::new(width, &pixels);
        assert!((photo.score(&mut matcher, &photo).unwrap() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn the_camera_is_found_on_the_toy_street_corner() {
    assert_eq!(best_candidate(&mut edges(0.05, true)), Ok(OFF));
}
