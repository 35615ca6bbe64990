//! Views against images that an independent ray tracer made of the same maps at the same poses.

mod support;

use resurvey_core::render::{SolidMask, view};
use resurvey_schema::GridPoint;

#[test]
fn ideal_labels_of_the_street_are_reproduced_at_the_true_pose() {
    let Some(cases) = support::cases() else { return };
    let (truth, camera, pose) = support::capture(&cases.join("street-ideal"));
    let (scene, _) = support::scene(&cases.join("maps/street"));
    let view = view(&scene, &camera, &pose);
    let (differing, compared) = support::disagreement(&truth, &view.labels);
    println!("street-ideal: {differing} of {compared} pixels differ");
    assert!(differing * 1000 <= compared, "{differing} of {compared} pixels differ");
    for (class, range_m) in view.labels.values().iter().zip(view.range_m.values()) {
        assert_eq!(*class == scene.sky().0, range_m.is_infinite());
    }
}

#[test]
fn street_buildings_are_solid_and_the_street_is_not() {
    let Some(cases) = support::cases() else { return };
    let (scene, objects) = support::scene(&cases.join("maps/street"));
    let origin = scene.origin();
    let mask = SolidMask::at_height(&scene, origin.height_m + 1.6);
    let mut buildings = 0;
    for object in objects.iter().filter(|object| object.name.starts_with('b') && !object.name.contains("roof")) {
        let count = object.mesh.vertices.len() as f32;
        let mean = |axis: usize| f64::from(object.mesh.vertices.iter().map(|v| v[axis]).sum::<f32>() / count);
        let middle = GridPoint::new(origin.easting_m + mean(0), origin.northing_m + mean(1), origin.height_m + 1.6);
        assert!(mask.contains(middle), "the middle of {}", object.name);
        buildings += 1;
    }
    assert_eq!(buildings, 21);
    let (_, _, pose) = support::capture(&cases.join("street-ideal"));
    assert!(!mask.contains(pose.position), "the camera stands in the street");
}

#[test]
fn a_hall_is_a_room_and_what_stands_in_it_is_solid() {
    let Some(cases) = support::cases() else { return };
    let (scene, _) = support::scene(&cases.join("maps/library"));
    let origin = scene.origin();
    let at = |east, north, up| GridPoint::new(origin.easting_m + east, origin.northing_m + north, origin.height_m + up);
    let mask = SolidMask::at_height(&scene, origin.height_m + 1.6);
    assert!(!mask.contains(at(10.0, 10.0, 1.6)), "free floor of the hall");
    assert!(mask.contains(at(6.0, 11.5, 1.6)), "pillar0");
    assert!(mask.contains(at(5.0, 3.0, 1.6)), "shelf0");
    assert!(!mask.contains(at(7.0, 15.0, 1.6)), "above desk0, which is 0.75 m high");
    assert!(SolidMask::at_height(&scene, origin.height_m + 0.5).contains(at(7.0, 15.0, 0.5)), "in desk0");
}
