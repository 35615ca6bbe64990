//! Views against images that an independent ray tracer made of the same maps at the same poses.

mod support;

use resurvey_core::render::view;

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
