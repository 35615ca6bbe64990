//! The ground near a place.

use crate::capture::ground::ground_near;
use crate::mesh::{Mesh, Object, Surface};
use crate::render::Scene;
use resurvey_schema::{ClassId, ClassTable, GridPoint};

const ORIGIN: GridPoint = GridPoint::new(835_600.0, 817_800.0, 0.0);

/// A level or leaning floor over a rectangle in plan, at these heights in the west and east.
fn floor([west, east]: [f32; 2], [south, north]: [f32; 2], [in_west, in_east]: [f32; 2]) -> Object {
    let vertices = vec![[west, south, in_west], [east, south, in_east], [east, north, in_east], [west, north, in_west]];
    let mesh = Mesh {
        origin: ORIGIN,
        vertices,
        uvs: vec![[0.0; 2]; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_surfaces: vec![0, 0],
        surfaces: vec![Surface::Class(ClassId(8))],
    };
    Object { name: "floor".to_owned(), mesh }
}

fn scene(objects: &[Object]) -> Scene {
    let lent: Vec<(u64, &Object)> = objects.iter().enumerate().map(|(fid, object)| (fid as u64, object)).collect();
    Scene::new(ORIGIN, &lent, &[], &ClassTable::default())
}

fn at(east_m: f64) -> GridPoint {
    // A height in the sky or the ground makes no difference.
    GridPoint::new(ORIGIN.easting_m + east_m, ORIGIN.northing_m, 700.0)
}

#[test]
fn a_roof_is_no_ground() {
    let street = floor([-100.0, 100.0], [-100.0, 100.0], [4.2, 4.2]);
    let roof = floor([5.0, 60.0], [-60.0, 60.0], [64.0, 64.0]);
    let scene = scene(&[street, roof]);
    for east_m in [0.0, 12.0] {
        let ground = ground_near(&scene, at(east_m), 15.0).unwrap();
        assert!((ground.height_m - 4.2).abs() < 1e-4 && ground.spread_m < 1e-4, "{east_m}: {ground:?}");
    }
}

#[test]
fn the_ground_of_a_slope_is_that_below_with_its_spread() {
    // One in twenty: 5 m over 100 m.
    let scene = scene(&[floor([-100.0, 100.0], [-100.0, 100.0], [0.0, 10.0])]);
    let ground = ground_near(&scene, at(0.0), 15.0).unwrap();
    assert!((ground.height_m - 5.0).abs() < 1e-3, "{ground:?}");
    // A disc of 15 m has a standard deviation of 7.5 m along an axis: 0.375 m of height.
    assert!((ground.spread_m - 0.375).abs() < 0.06, "{ground:?}");
}

#[test]
fn where_the_map_ends_there_is_no_ground() {
    let scene = scene(&[floor([-100.0, -50.0], [-100.0, 100.0], [4.2, 4.2])]);
    assert_eq!(ground_near(&scene, at(0.0), 15.0), None);
    assert_eq!(ground_near(&self::scene(&[]), at(0.0), 15.0), None);
}
