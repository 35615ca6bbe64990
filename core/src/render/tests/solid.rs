//! Which positions are inside something solid.

use super::*;
use crate::render::{SolidMask, inside_solid};
use resurvey_schema::DynamicDescriptor;

/// Four walls without floor or roof around a square of `size` m with its corner at (`west`, `south`).
fn walls([west, south]: [f32; 2], size: f32) -> Vec<Object> {
    let (east, north) = (west + size, south + size);
    let plan = [[west, south], [east, south], [east, north], [west, north]];
    (0..4)
        .map(|k| {
            let (a, b) = (plan[k], plan[(k + 1) % 4]);
            let corner = |[east, north]: [f32; 2], up| [east, north, up];
            quad([corner(a, 0.0), corner(b, 0.0), corner(b, 6.0), corner(a, 6.0)], class(STONE))
        })
        .collect()
}

/// Walls that are one object.
fn box_of(corner: [f32; 2], size: f32) -> Object {
    let mut parts = walls(corner, size).into_iter();
    let mut whole = parts.next().unwrap();
    for part in parts {
        let first = whole.mesh.vertices.len() as u32;
        whole.mesh.vertices.extend(part.mesh.vertices);
        whole.mesh.uvs.extend(part.mesh.uvs);
        whole.mesh.triangles.extend(part.mesh.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
        whole.mesh.triangle_surfaces.extend(part.mesh.triangle_surfaces);
    }
    whole
}

fn chair_at(position: [f64; 3]) -> Descriptor {
    let (class, position, size_m) = (ClassId(CHAIR), at(position), [0.5, 0.5, 0.9]);
    Descriptor::Dynamic(DynamicDescriptor { class, position, size_m, yaw_rad: None, sigma: None })
}

#[test]
fn inside_open_walls_is_inside_and_above_them_is_not() {
    let scene = scene(&[box_of([0.0, 0.0], 10.0)]);
    assert!(inside_solid(&scene, at([5.0, 5.0, 1.6])));
    assert!(!inside_solid(&scene, at([5.0, 5.0, 6.5])));
    assert!(!inside_solid(&scene, at([-1.0, 5.0, 1.6])) && !inside_solid(&scene, at([5.0, 10.1, 1.6])));
}

#[test]
fn walls_that_are_objects_of_their_own_make_one_building() {
    let scene = scene(&walls([0.0, 0.0], 10.0));
    assert!(inside_solid(&scene, at([5.0, 5.0, 1.6])) && !inside_solid(&scene, at([15.0, 5.0, 1.6])));
}

#[test]
fn two_buildings_that_share_a_corner_are_both_solid() {
    let objects = [walls([0.0, 0.0], 10.0), walls([10.0, 10.0], 5.0)].concat();
    let scene = scene(&objects);
    assert!(inside_solid(&scene, at([5.0, 5.0, 1.6])) && inside_solid(&scene, at([12.0, 12.0, 1.6])));
    assert!(!inside_solid(&scene, at([12.0, 5.0, 1.6])));
}

#[test]
fn a_wall_that_is_missing_leaves_the_others_a_majority() {
    let three = &walls([0.0, 0.0], 10.0)[..3];
    assert!(inside_solid(&scene(three), at([5.0, 5.0, 1.6])));
    assert!(!inside_solid(&scene(three), at([-5.0, 5.0, 1.6])));
}

#[test]
fn a_room_is_not_solid_but_what_it_holds_is() {
    let scene = scene(&[box_of([0.0, 0.0], 10.0), box_of([4.0, 4.0], 1.0)]);
    assert!(!inside_solid(&scene, at([2.0, 2.0, 1.6])));
    assert!(inside_solid(&scene, at([4.5, 4.5, 1.6])));
}

#[test]
fn a_chair_makes_its_surroundings_a_room_and_is_not_solid_itself() {
    let building = [box_of([0.0, 0.0], 10.0)];
    let scene = scene_with(&building, &[(9, chair_at([5.0, 5.0, 0.0]))]);
    let mask = SolidMask::at_height(&scene, ORIGIN.height_m + 0.5);
    assert!(!mask.contains(at([2.0, 2.0, 0.5])) && !mask.contains(at([5.0, 5.0, 0.5])));
    let outside = scene_with(&building, &[(9, chair_at([15.0, 5.0, 0.0]))]);
    assert!(inside_solid(&outside, at([2.0, 2.0, 0.5])));
}

#[test]
fn the_same_building_twice_is_still_solid() {
    let scene = scene(&[box_of([0.0, 0.0], 10.0), box_of([0.0, 0.0], 10.0)]);
    assert!(inside_solid(&scene, at([5.0, 5.0, 1.6])));
}
