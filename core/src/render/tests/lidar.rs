//! The virtual LIDAR.

use super::*;
use crate::render::lidar::{LidarPoint, SPACING_M, project, scan, write_ply};
use crate::render::view;

#[test]
fn points_of_a_wall_are_a_tenth_of_a_metre_apart_and_lie_on_it() {
    let scene = scene(&[wall(2.0, [-9.0, 9.0], [-9.0, 9.0], class(GLASS))]);
    let points = scan(&view(&scene, &camera(), &pose([0.0; 3], 0.0, 0.0)), SPACING_M);
    // The wall shows 4 × 3 m; discs of 0.1 m spacing pack between one per 0.01 m² × 2/√3 and half of that.
    assert!((700..1400).contains(&points.len()), "{} points", points.len());
    let near = |a: &LidarPoint, b: &LidarPoint| {
        let (a, b) = (<[f64; 3]>::from(a.position), <[f64; 3]>::from(b.position));
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
    };
    for (index, point) in points.iter().enumerate() {
        assert!((point.position.northing_m - ORIGIN.northing_m - 2.0).abs() < 1e-5 && point.class == ClassId(GLASS));
        assert!(points[..index].iter().all(|other| near(point, other) > SPACING_M - 1e-6));
    }
}

#[test]
fn projected_points_leave_holes_of_void_and_otherwise_show_the_view() {
    let objects =
        [wall(2.0, [-9.0, 0.5], [-9.0, 9.0], class(GLASS)), wall(4.0, [-9.0, 9.0], [-9.0, 9.0], class(STONE))];
    let here = pose([0.0; 3], 0.0, 0.0);
    let view = view(&scene(&objects), &camera(), &here);
    let image = project(&scan(&view, SPACING_M), &camera(), &here);
    let filled = image.values().iter().zip(view.labels.values()).filter(|(found, _)| **found != 255);
    let (same, all) = filled.fold((0, 0), |(same, all), (found, seen)| (same + usize::from(found == seen), all + 1));
    assert_eq!(same, all, "every point falls back into its own pixel");
    // 0.1 m is 3.2 px on the nearer wall and 1.6 px on the other.
    assert!(all > 600 && all < 128 * 96 / 2, "{all} pixels of {}", 128 * 96);
}

#[test]
fn sky_gives_no_points() {
    assert_eq!(scan(&view(&scene(&[]), &camera(), &pose([0.0; 3], 0.0, 0.0)), SPACING_M), []);
}

#[test]
fn the_ply_file_has_28_bytes_a_point_after_its_header() {
    let point = LidarPoint { position: GridPoint::new(836_694.05, 819_069.8, 4.5), class: ClassId(2) };
    let bytes = write_ply(&[point, point], &ClassTable::default());
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = std::str::from_utf8(&bytes[..end]).unwrap();
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n") && header.contains("element vertex 2\n"));
    assert_eq!(bytes.len(), end + 56);
    assert_eq!(bytes[end..end + 8], 836_694.05_f64.to_le_bytes());
    assert_eq!(bytes[end + 24..end + 28], [2, 255, 165, 0]);
}
