use super::*;
use resurvey_plugin::toy::trial::{Labels, OFF, best_candidate};

const SKY: u8 = 6;
const FOLIAGE: u8 = 7;
const VOID: u8 = 255;

fn pixel(hidden: &str) -> Pixel {
    Pixel::create(Settings { hidden: hidden.to_owned().try_into().unwrap() }).unwrap()
}

fn score(photo: [u8; 6], view: [u8; 6]) -> f64 {
    Labels::new(3, &photo).score(&mut pixel("4 5 7"), &Labels::new(3, &view)).unwrap()
}

#[test]
fn the_score_is_the_share_of_equal_pixels() {
    assert!((score([0, 0, 1, 1, SKY, SKY], [0, 1, 1, 1, SKY, 0]) - 4.0 / 6.0).abs() < 1e-12);
}

#[test]
fn equal_images_score_one_and_any_difference_less() {
    let photo = [SKY, 0, SKY, 0, 1, 2];
    assert!((score(photo, photo) - 1.0).abs() < 1e-12);
    assert!(score(photo, [SKY, 0, 0, 0, 1, 2]) < 1.0);
}

#[test]
fn void_and_hidden_classes_are_never_compared() {
    // Of the six one differs, and is not compared; of the other five one is void in the view.
    for hidden in [VOID, FOLIAGE] {
        assert!((score([SKY, hidden, 0, 0, 1, 1], [SKY, 1, 0, 0, 1, VOID]) - 1.0).abs() < 1e-12);
    }
    // Foliage of the view is: the photo would show it.
    assert!((score([0, 0, 1, 1, SKY, SKY], [0, 0, 1, 1, SKY, FOLIAGE]) - 5.0 / 6.0).abs() < 1e-12);
}

#[test]
fn a_photo_without_a_pixel_to_compare_has_no_answer() {
    let result = Labels::new(3, &[VOID; 6]).score(&mut pixel(""), &Labels::new(3, &[0; 6]));
    assert!(result.unwrap_err().0.contains("void"));
}

#[test]
fn the_camera_is_found_on_the_toy_street_corner() {
    assert_eq!(best_candidate(&mut pixel("4 5 7")), Ok(OFF));
}
