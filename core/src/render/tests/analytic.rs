//! Scenes whose image is known from u = f·x/z + cx, v = f·y/z + cy alone.

use super::*;
use crate::render::{RayCaster, Renderer, view};

#[test]
fn a_wall_covers_exactly_the_pixels_whose_centres_it_covers() {
    // At 8 m: u = 64 + 8·E, v = 48 − 8·H.
    let scene = scene(&[wall(8.0, [-2.0, 3.0], [-1.0, 2.0], class(STONE))]);
    let view = view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0));
    assert_eq!(extent(&view.labels, STONE), Some(([48, 88], [32, 56])));
    assert_eq!(count(&view.labels, STONE), 40 * 24);
    assert_eq!(count(&view.labels, SKY), 128 * 96 - 40 * 24);
}

#[test]
fn an_edge_through_pixel_centres_takes_the_left_and_top_ones_and_leaves_the_others() {
    // Edges at u = 48.5 and 88.5, v = 32.5 and 56.5.
    let scene = scene(&[wall(8.0, [-1.9375, 3.0625], [-1.0625, 1.9375], class(STONE))]);
    let view = view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0));
    assert_eq!(extent(&view.labels, STONE), Some(([48, 88], [32, 56])));
}

#[test]
fn range_runs_along_the_ray_and_points_lie_on_the_wall() {
    let scene = scene(&[wall(10.0, [-20.0, 20.0], [-2.0, 50.0], class(GLASS))]);
    let view = view(&scene, &camera(), &pose([0.0, 0.0, 1.0], 0.0, 0.0));
    for (u, v) in [(64, 48), (3, 20), (120, 5)] {
        let across = [(f64::from(u) + 0.5 - 64.0) / 64.0, (f64::from(v) + 0.5 - 48.0) / 64.0];
        let expected_m = 10.0 * (1.0 + across[0].powi(2) + across[1].powi(2)).sqrt();
        assert!((f64::from(view.range_m.at(u, v)) - expected_m).abs() < 1e-5);
        let expected = [10.0 * across[0], 10.0, 1.0 - 10.0 * across[1]];
        for (found, expected) in view.points.at(u, v).iter().zip(expected) {
            assert!((f64::from(*found) - expected).abs() < 1e-5, "{found} is not {expected}");
        }
    }
    assert_eq!(view.origin, ORIGIN);
    assert!(view.features.values().iter().all(|&feature| feature == 0));
}

#[test]
fn sky_has_no_range_and_no_point() {
    let view = view(&scene(&[]), &camera(), &pose([0.0; 3], 0.0, 0.0));
    assert_eq!(count(&view.labels, SKY), 128 * 96);
    assert!(view.range_m.values().iter().all(|range_m| range_m.is_infinite()));
    assert!(view.points.values().iter().flatten().all(|value| value.is_nan()));
}

#[test]
fn a_map_without_a_sky_class_shows_void_where_nothing_is() {
    let mut classes: Vec<_> = ClassTable::default().iter().cloned().collect();
    classes.retain(|class| class.name != "sky");
    let scene = Scene::new(ORIGIN, &[], &[], &ClassTable::new(classes).unwrap());
    let view = view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0));
    assert_eq!(count(&view.labels, 255), 128 * 96);
}

#[test]
fn level_ground_fills_the_image_below_the_horizon() {
    let ground =
        quad([[-900.0, -900.0, 0.0], [900.0, -900.0, 0.0], [900.0, 900.0, 0.0], [-900.0, 900.0, 0.0]], class(STONE));
    let view = view(&scene(&[ground]), &camera(), &pose([3.0, 4.0, 1.6], 77.0, 0.0));
    // Range of row v: 1.6 / sin of the ray's fall; the edge of the ground, 900 m away, is within a pixel of the horizon.
    assert_eq!(extent(&view.labels, STONE), Some(([0, 128], [48, 96])));
    let fall = (95.5 - 48.0) / 64.0_f64;
    let expected_m = 1.6 / fall * (1.0 + fall * fall + (0.5_f64 / 64.0).powi(2)).sqrt();
    assert!((f64::from(view.range_m.at(64, 95)) - expected_m).abs() < 1e-5);
}

#[test]
fn a_wall_that_passes_the_camera_is_seen_up_to_the_border() {
    // A wall along the view direction, 1 m to the right, from 50 m behind to 50 m ahead.
    let side = quad([[1.0, -50.0, -5.0], [1.0, 50.0, -5.0], [1.0, 50.0, 5.0], [1.0, -50.0, 5.0]], class(GLASS));
    let view = view(&scene(&[side]), &camera(), &pose([0.0; 3], 0.0, 0.0));
    // It ends 50 m ahead at u = 64 + 64/50 = 65.28.
    assert_eq!(extent(&view.labels, GLASS), Some(([65, 128], [0, 96])));
    assert!((view.range_m.at(127, 48) - (1.0 + (64.0_f32 / 63.5).powi(2) * 1.0001).sqrt()).abs() < 1e-3);
}

#[test]
fn surfaces_are_seen_from_both_sides() {
    let from_behind = quad([[2.0, 8.0, -1.0], [-2.0, 8.0, -1.0], [-2.0, 8.0, 1.0], [2.0, 8.0, 1.0]], class(STONE));
    let view = view(&scene(&[from_behind]), &camera(), &pose([0.0; 3], 0.0, 0.0));
    assert_eq!(count(&view.labels, STONE), 32 * 16);
}

#[test]
fn texels_keep_their_share_of_a_wall_seen_at_an_angle() {
    // Four columns of texels on an 8 m wall, seen from 45°: the seams are at known points of the wall.
    let wall = wall(8.0, [-4.0, 4.0], [-4.0, 4.0], texture(&[[0, 1, 2, 3], [8, 8, 8, 8]]));
    let here = pose([-8.0, 0.0, 0.0], 45.0, 0.0);
    let view = view(&scene(&[wall]), &camera(), &here);
    let mut seen = 0;
    for u in 0..128 {
        // The ray of (u, row 40) in plan: forward + right · (u + 0.5 − 64)/64, with forward NE and right SE.
        let across = (f64::from(u) + 0.5 - 64.0) / 64.0;
        let (east, north) = (1.0 + across, 1.0 - across);
        let on_wall = -8.0 + 8.0 * east / north;
        let expected = if on_wall.abs() < 4.0 { [0, 1, 2, 3][((on_wall + 4.0) / 2.0) as usize] } else { SKY };
        assert_eq!(view.labels.at(u, 40), expected, "column {u} meets the wall at {on_wall}");
        let below = if on_wall.abs() < 4.0 { 8 } else { SKY };
        assert_eq!(view.labels.at(u, 56), below, "column {u}");
        seen += usize::from(expected != SKY);
    }
    assert!(seen > 30);
}

#[test]
fn no_texel_of_the_other_side_shows_at_the_rim_of_a_texture() {
    let wall = wall(8.0, [-2.0, 2.0], [-2.0, 2.0], texture(&[[0, 1, 1, 2]]));
    let scene = scene(&[wall]);
    for offset in 0..200 {
        let here = pose([f64::from(offset) * 0.013_1 - 1.3, 0.0, 0.0], 0.0, 0.0);
        let labels = view(&scene, &camera(), &here).labels;
        let (columns, _) = extent(&labels, 0).unwrap();
        assert!(columns[1] <= extent(&labels, 2).unwrap().0[0]);
    }
}

#[test]
fn inside_a_closed_box_there_is_no_sky() {
    let (l, h) = (-3.0, 3.0);
    let faces = [
        [[l, l, l], [h, l, l], [h, l, h], [l, l, h]],
        [[l, h, l], [h, h, l], [h, h, h], [l, h, h]],
        [[l, l, l], [l, h, l], [l, h, h], [l, l, h]],
        [[h, l, l], [h, h, l], [h, h, h], [h, l, h]],
        [[l, l, l], [h, l, l], [h, h, l], [l, h, l]],
        [[l, l, h], [h, l, h], [h, h, h], [l, h, h]],
    ];
    let objects: Vec<Object> = faces.map(|face| quad(face, class(STONE))).into();
    let scene = scene(&objects);
    for step in 0..40 {
        let here = pose([0.37, -1.1, 2.0], f64::from(step) * 9.7, f64::from(step) * 4.0 - 80.0);
        assert_eq!(count(&view(&scene, &camera(), &here).labels, SKY), 0, "step {step}");
    }
}

#[test]
fn triangles_without_area_and_coordinates_that_are_not_numbers_do_not_show() {
    let line = quad([[0.0, 5.0, 0.0], [1.0, 5.0, 0.0], [2.0, 5.0, 0.0], [3.0, 5.0, 0.0]], class(STONE));
    let point = quad([[0.0, 5.0, 0.0]; 4], class(STONE));
    let nowhere = quad([[f32::NAN, 5.0, 0.0], [1.0, f32::INFINITY, 0.0], [0.0; 3], [1.0; 3]], class(STONE));
    let here = quad([[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], class(STONE));
    let edge_on = quad([[-1.0, 2.0, 0.0], [1.0, 2.0, 0.0], [1.0, 9.0, 0.0], [-1.0, 9.0, 0.0]], class(STONE));
    let scene = scene(&[line, point, nowhere, here, edge_on]);
    let view = view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0));
    assert_eq!(count(&view.labels, SKY), 128 * 96);
}

#[test]
fn what_is_nearer_than_5_cm_is_not_drawn() {
    let near = |north| wall(north, [-1.0, 1.0], [-1.0, 1.0], class(STONE));
    let here = pose([0.0; 3], 0.0, 0.0);
    assert_eq!(count(&view(&scene(&[near(0.04)]), &camera(), &here).labels, STONE), 0);
    assert_eq!(count(&view(&scene(&[near(0.06)]), &camera(), &here).labels, STONE), 128 * 96);
}

#[test]
fn what_is_more_than_2048_m_from_the_origin_is_cut_off() {
    let plain = quad(
        [[-2000.0, 0.0, -1.0], [2000.0, 0.0, -1.0], [2000.0, 1900.0, -1.0], [-2000.0, 1900.0, -1.0]],
        class(STONE),
    );
    let mut far = plain.clone();
    far.mesh.origin.northing_m += 1000.0;
    let beyond = wall(2040.0, [-9.0, 9.0], [-9.0, 9.0], class(GLASS));
    let mut away = beyond.clone();
    away.mesh.origin.northing_m += 9.0;
    let scene = scene(&[plain, far, beyond, away]);
    let north = scene.positions().iter().flatten().map(|corner| corner[1]).fold(0.0, f32::max);
    assert!((2047.9..=2048.0).contains(&north), "the plain that reaches 2900 m ends at {north} m");
    assert_eq!(scene.objects()[3].triangles.len(), 0, "a wall at 2049 m");
    let area = |triangle: &[[f32; 3]; 3]| {
        let [a, b, c] = triangle.map(|[east, north, _]| [f64::from(east), f64::from(north)]);
        ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs() / 2.0
    };
    let cut: f64 = scene.positions()[scene.objects()[1].triangles.clone()].iter().map(area).sum();
    assert!((cut - 4000.0 * 1048.0).abs() < 1.0, "{cut} m² are left of the plain");
}

#[test]
fn a_texture_keeps_its_place_on_a_surface_that_is_cut_off() {
    // 4000 m of road in 4 bands of 1000 m, of which 2048 m are near enough: the seams stay at 1000 m and 2000 m.
    let road = quad(
        [[-5.0, 0.0, -1.0], [5.0, 0.0, -1.0], [5.0, 4000.0, -1.0], [-5.0, 4000.0, -1.0]],
        texture(&[[3], [2], [1], [0]]),
    );
    let scene = scene(&[road]);
    let caster = RayCaster::new(&scene);
    for (north, expected) in [(10.0, 0), (999.0, 0), (1001.0, 1), (1999.0, 1), (2001.0, 2)] {
        assert_eq!(caster.ground_below(at([0.5, north, 3.0])).unwrap().class, ClassId(expected), "{north} m");
    }
    assert_eq!(caster.ground_below(at([0.5, 2049.0, 3.0])), None);
}

#[test]
fn around_an_origin_that_is_not_a_place_there_is_nothing() {
    let object = wall(8.0, [-2.0, 3.0], [-1.0, 2.0], class(STONE));
    let origin = GridPoint::new(f64::NAN, 0.0, 0.0);
    let scene = Scene::new(origin, &[(0, &object)], &[], &ClassTable::default());
    assert!(scene.positions().is_empty());
    assert_eq!(count(&view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0)).labels, SKY), 128 * 96);
}

#[test]
fn a_renderer_gives_the_same_image_whatever_it_drew_before() {
    let objects = [wall(8.0, [-2.0, 3.0], [-1.0, 2.0], texture(&[[0, 1], [2, 3]]))];
    let scene = scene(&objects);
    let (large, small) = (camera().pinhole().unwrap(), camera().subsampled(4).pinhole().unwrap());
    let (here, there) = (pose([0.0; 3], 0.0, 0.0), pose([1.0, 2.0, 0.5], 12.0, 3.0));
    let mut renderer = Renderer::new();
    let (mut first, mut again) = (LabelImage::filled(1, 1, 0), LabelImage::filled(1, 1, 0));
    renderer.render_labels(&scene, &large, &here, &mut first);
    renderer.render_labels(&scene, &small, &there, &mut again);
    assert_eq!((again.width(), again.height()), (32, 24));
    renderer.render_labels(&scene, &large, &here, &mut again);
    assert_eq!(first, again);
    assert_eq!(first, view(&scene, &camera(), &here).labels);
    assert_eq!(renderer.visible_triangles(&scene, &large, &here), [0, 1]);
    renderer.render_labels_of((&scene, &[1, 99]), &large, &here, &mut again);
}

#[test]
fn a_ray_meets_the_wall_where_arithmetic_says() {
    let scene = scene(&[wall(8.0, [-2.0, 2.0], [-1.0, 3.0], texture(&[[0, 1], [2, 3]]))]);
    let caster = RayCaster::new(&scene);
    let hit = caster.cast(at([0.0; 3]), [1.0, 8.0, 2.0], 100.0).unwrap();
    assert!((hit.range_m - 69.0_f64.sqrt()).abs() < 1e-6);
    assert!((hit.point.easting_m - (ORIGIN.easting_m + 1.0)).abs() < 1e-6);
    assert!((hit.point.height_m - (ORIGIN.height_m + 2.0)).abs() < 1e-6);
    assert!((hit.normal[1] + 1.0).abs() < 1e-9);
    assert_eq!((hit.class, hit.feature), (ClassId(1), 0));
    let behind = caster.cast(at([0.0, 16.0, 0.0]), [0.0, -1.0, 0.0], 100.0).unwrap();
    assert!((behind.normal[1] - 1.0).abs() < 1e-9, "the normal points to where the ray came from");
    assert_eq!(caster.cast(at([0.0; 3]), [0.0, 1.0, 0.0], 7.9), None);
    assert_eq!(caster.cast(at([0.0; 3]), [0.0; 3], 100.0), None);
    assert_eq!(caster.cast(at([f64::NAN, 0.0, 0.0]), [0.0, 1.0, 0.0], 100.0), None);
    assert_eq!(RayCaster::new(&super::scene(&[])).cast(at([0.0; 3]), [0.0, 1.0, 0.0], 100.0), None);
    let nearest = caster.nearest_surface(at([5.0, 4.0, 1.0]), 10.0).unwrap();
    assert!((nearest.distance_m - 5.0).abs() < 1e-6, "3-4-5 to the wall's right edge");
    assert_eq!(caster.nearest_surface(at([5.0, 4.0, 1.0]), 4.9), None);
    assert!(!caster.sees(at([0.0; 3]), at([0.0, 9.0, 0.0])) && caster.sees(at([0.0; 3]), at([0.0, 8.0, 0.0])));
}
