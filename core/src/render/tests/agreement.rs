//! The rasteriser and single rays, which share nothing but the scene, see the same.

use super::*;
use crate::camera::world_from_camera;
use crate::render::{RayCaster, Renderer, view};
use proptest::prelude::*;

/// A disagreement is on an edge when the ray, moved by this many pixels, meets something else.
const EDGE_PX: f64 = 1e-4;

/// Numbers 0…1 from a seed (Steele, Lea & Flood 2014, SplitMix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// Triangles of every size around the camera, some of them huge, some through it, and a checked ground.
fn clutter(seed: u64) -> Vec<Object> {
    let mut random = Random(seed);
    let mut objects = vec![quad(
        [[-500.0, -500.0, -1.6], [500.0, -500.0, -1.6], [500.0, 500.0, -1.6], [-500.0, 500.0, -1.6]],
        texture(&[[0, 1, 2], [3, 4, 5], [6, 7, 8]]),
    )];
    for index in 0..60_u8 {
        let spread = [0.3, 3.0, 60.0][usize::from(index % 3)];
        let centre = [random.between(-30.0, 30.0), random.between(-30.0, 30.0), random.between(-5.0, 9.0)];
        let corners = [0; 4].map(|_| centre.map(|value| (value + random.between(-spread, spread)) as f32));
        let surface = if index % 2 == 0 { class(index % 9) } else { texture(&[[1, 2, 3, 4], [5, 7, 8, 0]]) };
        objects.push(quad(corners, surface));
    }
    objects
}

/// Pixels that differ, and those of them that are not explained by an edge through the pixel's centre.
fn disagreements(scene: &Scene, pose: &Pose) -> (usize, Vec<[u32; 2]>) {
    let (camera, caster) = (camera(), RayCaster::new(scene));
    let view = view(scene, &camera, pose);
    let world_from_camera = world_from_camera(pose);
    let cast = |u: f64, v: f64| {
        let ray = camera.ray(u, v).unwrap();
        // The rasteriser's least depth is 0.05 m; what lies before it is not looked at here either.
        let start = scene.offset(pose.position);
        let ahead = world_from_camera * ray * (0.05 / ray.z);
        let origin = scene.point(std::array::from_fn(|axis| start[axis] + ahead[axis]));
        let hit = caster.cast(origin, (world_from_camera * ray).into(), f64::INFINITY);
        (hit.map_or(SKY, |hit| hit.class.0), hit.map_or(f64::INFINITY, |hit| hit.range_m + 0.05 / ray.z))
    };
    let (mut differing, mut unexplained) = (0, Vec::new());
    for (u, v) in (0..camera.height()).flat_map(|v| (0..camera.width()).map(move |u| (u, v))) {
        let (x, y) = (f64::from(u) + 0.5, f64::from(v) + 0.5);
        let (class, range_m) = cast(x, y);
        let found_m = f64::from(view.range_m.at(u, v));
        let same_range = (found_m.is_infinite() && range_m.is_infinite()) || (found_m - range_m).abs() < 1e-5 * range_m;
        if class == view.labels.at(u, v) && same_range {
            continue;
        }
        differing += 1;
        let around = [(-EDGE_PX, 0.0), (EDGE_PX, 0.0), (0.0, -EDGE_PX), (0.0, EDGE_PX)];
        let on_edge = around.iter().any(|(du, dv)| {
            let (moved, moved_m) = cast(x + du, y + dv);
            moved != class || (moved_m - range_m).abs() > 1e-3 * range_m
        });
        if !on_edge {
            unexplained.push([u, v]);
        }
    }
    (differing, unexplained)
}

#[test]
fn rasteriser_and_rays_agree_on_random_scenes_but_for_one_pixel_in_ten_thousand_on_edges() {
    let mut differing = 0;
    for seed in 0..24 {
        let scene = scene(&clutter(seed));
        let mut random = Random(seed + 1000);
        let pose = Pose {
            position: at([random.between(-5.0, 5.0), random.between(-5.0, 5.0), random.between(-1.0, 3.0)]),
            yaw_rad: random.between(0.0, 6.3),
            pitch_rad: random.between(-0.6, 0.6),
            roll_rad: random.between(-0.5, 0.5),
        };
        let (count, unexplained) = disagreements(&scene, &pose);
        assert!(unexplained.is_empty(), "seed {seed}: {unexplained:?} differ off every edge");
        differing += count;
    }
    let pixels = 24 * 128 * 96;
    println!("{differing} of {pixels} pixels differ");
    assert!(differing * 10_000 <= pixels, "{differing} of {pixels} pixels differ");
}

#[test]
fn leaving_out_what_is_hidden_changes_no_pixel() {
    for seed in 0..6 {
        let mut random = Random(seed + 77);
        // A city of walls: dense enough that most of it is hidden, and walls that start behind the camera.
        let mut objects = clutter(seed);
        objects.extend((0..900_u16).map(|index| {
            let [east, north] = [random.between(-400.0, 400.0) as f32, random.between(-400.0, 400.0) as f32];
            let (wide, deep, high) =
                (random.between(-20.0, 20.0), random.between(-20.0, 20.0), random.between(1.0, 40.0));
            let (wide, deep, high) = (wide as f32, deep as f32, high as f32 - 1.6);
            let corners = [[0.0, 0.0], [wide, deep], [wide, deep], [0.0, 0.0]];
            let up = [-1.6, -1.6, high, high];
            quad(
                std::array::from_fn(|k| [east + corners[k][0], north + corners[k][1], up[k]]),
                class((index % 9) as u8),
            )
        }));
        let scene = scene(&objects);
        let all: Vec<u32> = (0..scene.positions().len() as u32).collect();
        let here = pose([1.0, 2.0, 0.3], random.between(0.0, 360.0), random.between(-20.0, 20.0));
        let pinhole = camera().pinhole().unwrap();
        let (mut renderer, mut culled, mut whole) =
            (Renderer::new(), LabelImage::filled(1, 1, 0), LabelImage::filled(1, 1, 0));
        renderer.render_labels(&scene, &pinhole, &here, &mut culled);
        renderer.render_labels_of((&scene, &all), &pinhole, &here, &mut whole);
        assert!(culled == whole, "seed {seed}");
    }
}

#[test]
fn every_instruction_set_and_every_history_gives_the_same_image() {
    let mut archs = vec![pulp::Arch::Scalar, pulp::Arch::new()];
    #[cfg(target_arch = "x86_64")]
    archs.extend(pulp::x86::V3::try_new().map(pulp::Arch::V3));
    let mut drawn = archs.iter().map(|arch| Renderer::with(*arch)).collect::<Vec<_>>();
    for seed in 0..4 {
        // Two triangles in the same place: of these the one with the lower index shows, whatever is drawn first.
        let mut objects = clutter(seed);
        objects.push(quad([[-4.0, 9.0, -1.0], [4.0, 9.0, -1.0], [4.0, 9.0, 3.0], [-4.0, 9.0, 3.0]], class(2)));
        objects.push(quad([[4.0, 9.0, -1.0], [-4.0, 9.0, -1.0], [-4.0, 9.0, 3.0], [4.0, 9.0, 3.0]], class(17)));
        let scene = scene(&objects);
        let pinhole = camera().pinhole().unwrap();
        for step in 0..24 {
            let here = pose([0.2, f64::from(step) * 0.1, 0.5], f64::from(step) * 7.0, 3.0);
            let mut expected = LabelImage::filled(1, 1, 0);
            Renderer::baseline().render_labels(&scene, &pinhole, &here, &mut expected);
            for renderer in &mut drawn {
                let mut found = LabelImage::filled(1, 1, 0);
                renderer.render_labels(&scene, &pinhole, &here, &mut found);
                assert!(found == expected, "seed {seed}, step {step}");
                let mut depths_m = crate::image::Raster::filled(1, 1, 0.0);
                renderer.render_labels_and_depths(&scene, &pinhole, &here, (&mut found, &mut depths_m));
                assert!(found == expected, "seed {seed}, step {step}");
            }
            assert!(view(&scene, &camera(), &here).labels == expected, "seed {seed}, step {step}");
        }
    }
}

#[test]
fn depths_are_those_along_the_optical_axis() {
    let scene = scene(&[wall(8.0, [-2.0, 2.0], [-1.0, 3.0], class(0))]);
    let (mut labels, mut depths_m) = (LabelImage::filled(1, 1, 0), crate::image::Raster::filled(1, 1, 0.0));
    let here = pose([0.0; 3], 0.0, 0.0);
    Renderer::new().render_labels_and_depths(&scene, &camera().pinhole().unwrap(), &here, (&mut labels, &mut depths_m));
    for (class, depth_m) in labels.values().iter().zip(depths_m.values()) {
        let expected_m = if *class == SKY { f32::INFINITY } else { 8.0 };
        assert!((depth_m - expected_m).abs() < 1e-5 || *depth_m >= expected_m, "{depth_m} m");
    }
    assert_eq!(labels.at(64, 40), 0);
}

#[test]
fn a_distorted_camera_without_distortion_sees_what_a_pinhole_sees() {
    let scene = scene(&clutter(3));
    let here = pose([0.5, 0.5, 0.5], 33.0, 4.0);
    let pinhole = view(&scene, &camera(), &here);
    // A distortion too small to move anything by a thousandth of a pixel, but one that is cast ray by ray.
    let lens =
        Intrinsics { model: CameraModel::Brown, distortion: [1e-9, 0.0, 0.0, 0.0, 0.0], ..camera().intrinsics() };
    let brown = view(&scene, &Camera::new(lens).unwrap(), &here);
    let differing = pinhole.labels.values().iter().zip(brown.labels.values()).filter(|(a, b)| a != b).count();
    assert!(differing <= 2, "{differing} pixels differ");
    let range = |view: &crate::render::View| view.range_m.at(64, 70);
    assert!((range(&pinhole) - range(&brown)).abs() < 1e-4);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn neighbouring_triangles_leave_no_gap_and_do_not_overlap(
        corners in proptest::array::uniform4(proptest::array::uniform2(-6.0_f32..6.0)),
        yaw in -0.4..0.4_f64, pitch in -0.4..0.4_f64,
    ) {
        // A quad fan around an inner point: every pixel of the union is covered by exactly one triangle.
        let [a, b, c, d] = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
        let on_wall = |[east, up]: [f32; 2]| [east, 8.0 + 0.3 * east, up];
        let inner = on_wall(corners[0]);
        let triangle = |from, to, index| quad([on_wall(from), on_wall(to), inner, inner], class(index));
        let objects = [triangle(a, b, 0), triangle(b, c, 1), triangle(c, d, 2), triangle(d, a, 3)];
        let here = pose([0.0; 3], yaw.to_degrees() * 0.3, pitch.to_degrees() * 0.3);
        let whole = count(&view(&scene(&[quad([on_wall(a), on_wall(b), on_wall(c), on_wall(d)], class(0))]), &camera(), &here).labels, 0);
        let together = view(&scene(&objects), &camera(), &here).labels;
        let covered = together.values().iter().filter(|&&class| class != SKY).count();
        prop_assert_eq!(covered, whole);
        let alone: usize = objects.iter().enumerate()
            .map(|(index, object)| count(&view(&scene(std::slice::from_ref(object)), &camera(), &here).labels, index as u8))
            .sum();
        prop_assert_eq!(alone, whole);
    }
}
