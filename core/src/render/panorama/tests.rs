//! What panoramas promise: what rays see, whatever the order and the instruction set.

use super::{Panorama, PanoramaGrid};
use crate::mesh::{Mesh, Object, Surface};
use crate::render::Scene;
use nalgebra::Vector3;
use proptest::prelude::*;
use resurvey_schema::{ClassId, ClassTable, GridPoint};

const ORIGIN: GridPoint = GridPoint::new(835_600.0, 817_800.0, 4.5);

type Triangle = [[f32; 3]; 3];

fn scene(triangles: &[Triangle]) -> Scene {
    let mesh = Mesh {
        origin: ORIGIN,
        vertices: triangles.iter().flatten().copied().collect(),
        uvs: Vec::new(),
        triangles: (0..triangles.len() as u32).map(|triangle| [0, 1, 2].map(|corner| 3 * triangle + corner)).collect(),
        triangle_surfaces: vec![0; triangles.len()],
        surfaces: vec![Surface::Class(ClassId(0))],
    };
    Scene::new(ORIGIN, &[(1, &Object { name: String::new(), mesh })], &[], &ClassTable::default())
}

/// Distance along `direction` (any length) to the triangle, Möller & Trumbore 1997, in units of the direction.
fn ray_distance(direction: Vector3<f64>, triangle: &Triangle) -> Option<f64> {
    let [a, b, c] = triangle.map(|corner| Vector3::from(corner.map(f64::from)));
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(&ac);
    let determinant = ab.dot(&p);
    let u = -a.dot(&p) / determinant;
    let q = -a.cross(&ab);
    let v = direction.dot(&q) / determinant;
    let t = ac.dot(&q) / determinant;
    (determinant.abs() > 1e-9 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some(t)
}

fn corner() -> impl Strategy<Value = [f32; 3]> {
    (-30.0_f32..30.0, -30.0_f32..30.0, -20.0_f32..40.0).prop_map(|(e, n, h)| [e, n, h])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn every_cell_shows_what_a_ray_through_it_hits(
        triangles in prop::collection::vec([corner(), corner(), corner()], 1..12)
    ) {
        let grid = PanoramaGrid::new(90, 1, -1.0, 2.0);
        let mut panorama = Panorama::new(&grid, &[true; 90]);
        panorama.draw(&scene(&triangles), [0.0; 3]);
        let mut wrong = 0;
        for (column, row) in (0..grid.columns()).flat_map(|column| (0..grid.rows()).map(move |row| (column, row))) {
            let direction = grid.direction(column, row);
            let distances = triangles.iter().filter_map(|triangle| ray_distance(direction, triangle));
            let same = match (distances.min_by(f64::total_cmp), panorama.cell(column, row)) {
                (None, None) => true,
                (Some(expected), Some((_, found))) => (expected - f64::from(found)).abs() < 1e-3 * expected,
                _ => false,
            };
            wrong += u32::from(!same);
        }
        // A ray exactly along an edge may fall either way.
        prop_assert!(wrong <= 2, "{} of {} cells differ", wrong, grid.columns() * grid.rows());
    }

    /// Corners on a lattice: shared edges and planes, plumb walls, eyes in planes and triangles of no area.
    #[test]
    fn cells_are_those_of_drawing_all_triangles_in_any_order(
        triangles in prop::collection::vec(prop::collection::vec([-4_i8..5, -4..5, -2..4], 3), 1..80),
        eyes in prop::collection::vec([-5_i8..6, -5..6, -1..3], 1..5),
        halves in prop::bool::ANY,
        first in 0_usize..90, count in 0_usize..=90,
    ) {
        let scale = if halves { 2.5_f32 } else { 3.0 };
        let corner = |corner: &[i8; 3]| corner.map(|value| f32::from(value) * scale);
        let triangles: Vec<Triangle> =
            triangles.iter().map(|corners| [corner(&corners[0]), corner(&corners[1]), corner(&corners[2])]).collect();
        let scene = scene(&triangles);
        let grid = PanoramaGrid::new(90, 1, -1.0, 2.0);
        let wanted: Vec<bool> = (0..90).map(|column| (column + 90 - first) % 90 < count).collect();
        let [mut whole, mut part] = [Panorama::new(&grid, &[true; 90]), Panorama::new(&grid, &wanted)];
        let mut baseline = Panorama::baseline(&grid, &[true; 90]);
        let mut expected = Panorama::new(&grid, &[true; 90]);
        for eye in eyes {
            let eye = eye.map(|value| f64::from(value) * 1.5);
            for panorama in [&mut whole, &mut part, &mut baseline] {
                panorama.draw(&scene, eye);
            }
            expected.draw_one_by_one(&scene, eye);
            for (column, row) in (0..90).flat_map(|column| (0..64).map(move |row| (column, row))) {
                let cell = expected.cell(column, row);
                prop_assert_eq!(whole.cell(column, row), cell, "column {}, row {}", column, row);
                prop_assert_eq!(baseline.cell(column, row), cell, "column {}, row {}", column, row);
                if wanted[column] {
                    prop_assert_eq!(part.cell(column, row), cell, "column {}, row {}", column, row);
                }
            }
        }
    }
}
