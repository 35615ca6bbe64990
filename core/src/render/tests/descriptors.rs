//! Descriptors in the scene.

use super::*;
use crate::render::{RayCaster, view};
use resurvey_schema::{DynamicDescriptor, MaterialDescriptor};

/// A banner on a wall that faces south, its corners `in_front_m` before the wall plane at 8 m.
fn banner(in_front_m: f64) -> Descriptor {
    let corner = |east, up| at([east, 8.0 - in_front_m, up]);
    Descriptor::Material(MaterialDescriptor {
        class: ClassId(BANNER),
        corners: [corner(-1.0, 0.0), corner(2.0, 0.0), corner(2.0, 1.5), corner(-1.0, 1.5)],
        normal: [0.0, -1.0, 0.0],
        sigma: None,
    })
}

fn chair() -> Descriptor {
    Descriptor::Dynamic(DynamicDescriptor {
        class: ClassId(CHAIR),
        position: at([0.0, 8.0, -1.0]),
        size_m: [0.5, 0.5, 0.9],
        yaw_rad: None,
        sigma: None,
    })
}

#[test]
fn a_banner_shows_on_its_wall_even_when_stored_a_few_centimetres_behind_it() {
    let objects = [wall(8.0, [-6.0, 6.0], [-2.0, 5.0], class(STONE))];
    for in_front_m in [0.1, 0.03, 0.01, 0.0, -0.01, -0.05, -0.1] {
        let scene = scene_with(&objects, &[(41, banner(in_front_m))]);
        let view = view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0));
        let shown = count(&view.labels, BANNER);
        assert!((288..=312).contains(&shown), "{shown} px with corners {in_front_m} m before the wall");
        assert!(
            view.labels.values().iter().zip(view.features.values()).all(|(class, f)| (*class == BANNER) == (*f == 1))
        );
        assert_eq!(scene.feature_table()[0].fid, 41);
    }
}

#[test]
fn a_later_banner_lies_on_an_earlier_one() {
    let objects = [wall(8.0, [-6.0, 6.0], [-2.0, 5.0], class(STONE))];
    let Descriptor::Material(mut glass) = banner(0.0) else { unreachable!() };
    glass.class = ClassId(GLASS);
    let scene = scene_with(&objects, &[(1, banner(0.0)), (2, Descriptor::Material(glass))]);
    let view = view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0));
    assert_eq!((count(&view.labels, BANNER), extent(&view.labels, GLASS).is_some()), (0, true));
}

#[test]
fn a_chair_is_a_box_that_stands_on_its_position() {
    let scene = scene_with(&[], &[(7, chair())]);
    let view = view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0));
    // Front face at 7.75 m: u = 64 ± 64·0.25/7.75 = 61.94…66.06, feet at v = 48 + 64·1/7.75 = 56.26; the top is
    // 0.1 m below the camera: far edge at 8.25 m, v = 48 + 6.4/8.25 = 48.78.
    assert_eq!(extent(&view.labels, CHAIR), Some(([62, 66], [49, 56])));
    assert!((view.range_m.at(64, 55) - 7.75).abs() < 0.06);
}

#[test]
fn the_ground_below_a_chair_is_the_floor() {
    let floor = quad([[-9.0, -1.0, -1.0], [9.0, -1.0, -1.0], [9.0, 19.0, -1.0], [-9.0, 19.0, -1.0]], class(STONE));
    let scene = scene_with(&[floor], &[(7, chair())]);
    let caster = RayCaster::new(&scene);
    let ground = caster.ground_below(at([0.0, 8.1, 2.0])).unwrap();
    assert!((ground.range_m - 3.0).abs() < 1e-6 && ground.feature == 0);
    assert_eq!(caster.cast(at([0.0, 8.1, 2.0]), [0.0, 0.0, -1.0], 9.0).unwrap().feature, 1);
    assert_eq!(caster.ground_below(at([30.0, 8.0, 2.0])), None);
}

#[test]
fn a_banner_without_a_wall_stands_where_it_was_stored() {
    let view = view(&scene_with(&[], &[(1, banner(0.0))]), &camera(), &pose([0.0; 3], 0.0, 0.0));
    assert_eq!(extent(&view.labels, BANNER), Some(([56, 80], [36, 48])));
}
