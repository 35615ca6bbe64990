//! `eval table-v`: the paper's Table V beside what geometry says of it.

use crate::bench::resurvey;
use serde_json::Value;

fn points(document: &Value, name: &str) -> Vec<[f64; 3]> {
    let experiments = document["experiments"].as_array().unwrap();
    let experiment = experiments.iter().find(|experiment| experiment["name"] == name).unwrap();
    let number = |point: &Value, key: &str| point[key].as_f64().unwrap_or_else(|| panic!("{key} of {point}"));
    let points = experiment["points"].as_array().unwrap().iter();
    points.map(|point| ["pose_error_m", "measured", "oracle"].map(|key| number(point, key))).collect()
}

#[test]
fn a_pose_error_moves_a_pedestrian_by_itself_and_grows_a_banner_with_its_square() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("figures");
    let document = resurvey(&["eval", "table-v", "--out", out.to_str().unwrap(), "--json"]).ok().json();
    let (shifts, areas) = (points(&document, "pedestrian"), points(&document, "banner"));
    for points in [&shifts, &areas] {
        assert!(points.len() >= 11 && points[0][0].abs() < 1e-9 && (points[points.len() - 1][0] - 5.0).abs() < 1e-9);
    }
    for [error_m, measured, oracle] in shifts {
        assert!((oracle - error_m).abs() < 1e-9);
        assert!((measured - error_m).abs() <= 0.05, "{error_m} m: off by {measured} m");
    }
    for [error_m, measured, oracle] in areas {
        let scale = (1.0 + error_m / 20.0).powi(2);
        assert!((oracle - 100.0 * (scale - 1.0)).abs() < 1e-9);
        let apart = (1.0 + measured / 100.0) / scale - 1.0;
        assert!(apart.abs() <= 0.02, "{error_m} m: {measured} % too large, expected {oracle} %");
    }
    for name in ["table-v-pedestrian.svg", "table-v-banner.svg"] {
        let svg = std::fs::read_to_string(out.join(name)).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("stroke-dasharray") && svg.contains("<circle"), "{svg}");
    }
}

#[test]
fn table_v_takes_plugins_and_settings_and_no_captures() {
    let words = ["eval", "table-v", "--set", "descriptors.max_range_m=10"];
    let run = resurvey(&words).ok();
    assert!(run.out.contains("within-range"), "a wall at 20 m is too far: {}", run.out);
    for wrong in
        [&["eval", "table-v", "--updates"][..], &["eval", "table-v", "--set", "semantic.radius_m=1"], &["eval"]]
    {
        assert_eq!(resurvey(wrong).code, 2, "{wrong:?}");
    }
    assert_eq!(resurvey(&["eval", "table-v", "--detector", "nobody"]).code, 11);
}
