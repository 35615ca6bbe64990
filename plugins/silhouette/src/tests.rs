use super::*;
use resurvey_plugin::toy::trial::{Labels, OFF, best_candidate};

const GLASS: u8 = 1;
const PEDESTRIAN: u8 = 4;
const SKY: u8 = 6;
const GROUND: u8 = 8;
const VOID: u8 = 255;

fn silhouette() -> Silhouette {
    let list = |text: &str| text.to_owned().try_into().unwrap();
    Silhouette::create(Settings { building: list("0 1 2 3"), hidden: list("4 5 7") }).unwrap()
}

fn score(photo: [u8; 6], view: [u8; 6]) -> f64 {
    Labels::new(3, &photo).score(&mut silhouette(), &Labels::new(3, &view)).unwrap()
}

#[test]
fn the_score_is_the_intersection_over_the_union_of_the_buildings() {
    // Two pixels are building in both, one in the photo alone, one in the view alone.
    assert!((score([0, 0, 0, SKY, SKY, GROUND], [0, 0, SKY, 0, SKY, GROUND]) - 0.5).abs() < 1e-12);
}

#[test]
fn equal_images_score_one_and_another_silhouette_less() {
    let photo = [SKY, 0, SKY, 0, 1, 2];
    assert!((score(photo, photo) - 1.0).abs() < 1e-12);
    assert!(score(photo, [SKY, 0, 0, 0, 1, 2]) < 1.0);
}

#[test]
fn the_material_of_a_building_and_what_lies_around_it_do_not_matter() {
    assert!((score([0, 0, 0, SKY, SKY, SKY], [GLASS, 2, 3, GROUND, SKY, GROUND]) - 1.0).abs() < 1e-12);
}

#[test]
fn void_and_hidden_classes_are_never_compared() {
    for hidden in [VOID, PEDESTRIAN] {
        assert!((score([SKY, hidden, 0, 0, 0, 0], [SKY, 0, 0, 0, 0, VOID]) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn two_images_without_a_building_agree() {
    assert!((score([SKY; 6], [GROUND; 6]) - 1.0).abs() < 1e-12);
}

#[test]
fn the_camera_is_found_on_the_toy_street_corner() {
    assert_eq!(best_candidate(&mut silhouette()), Ok(OFF));
}
