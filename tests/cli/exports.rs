//! `export`: files that other programs and this one read.

use crate::bench::{Bench, resurvey, text};

#[test]
fn an_exported_model_can_be_imported_again_in_place() {
    let bench = Bench::with_street();
    let out = bench.path("out.glb");
    let document = bench.json("export", &[text(&out)]);
    let keys: Vec<&String> = document.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["version", "file", "bytes", "objects", "descriptors"]);
    let bytes = std::fs::read(&out).unwrap();
    assert!(bytes.starts_with(b"glTF") && document["bytes"] == bytes.len());
    assert!(bench.is_unchanged());

    let again = bench.path("again.rsv");
    resurvey(&["init", text(&again)]).ok();
    let imported = resurvey(&["import", text(&again), text(&out), "--json"]).ok().json();
    assert_eq!(imported["files"][0]["objects"], document["objects"]);
    let boxes = |map: &str| {
        let answer = resurvey(&["query", map, "--json"]).ok().json();
        let mut boxes: Vec<(String, [f64; 6])> = (answer["features"].as_array().unwrap().iter())
            .map(|feature| {
                let corner = |key: &str, axis: usize| feature[key][axis].as_f64().unwrap();
                let numbers = [0, 1, 2, 3, 4, 5].map(|i| corner(if i < 3 { "min" } else { "max" }, i % 3));
                (feature["name"].as_str().unwrap().to_owned(), numbers)
            })
            .collect();
        boxes.sort_by(|a, b| a.partial_cmp(b).unwrap());
        boxes
    };
    let (before, after) = (boxes(text(&bench.path("map.rsv"))), boxes(text(&again)));
    assert_eq!(before.len(), after.len());
    for ((name, low), (other, high)) in before.iter().zip(&after) {
        assert_eq!(name, other);
        // Boxes are in whole millimetres; an f32 at 400 m is good to 0.03 mm.
        assert!(low.iter().zip(high).all(|(a, b)| (a - b).abs() < 2.5e-3), "{name}: {low:?} {high:?}");
    }
}

#[test]
fn gltf_text_comes_with_its_buffer_and_a_region_is_smaller() {
    let (bench, _) = Bench::with_banner();
    let (whole, part) = (bench.path("whole.gltf"), bench.path("part.GLB"));
    let all = bench.json("export", &[text(&whole)]);
    assert!(bench.path("whole.bin").exists());
    assert_eq!(all["descriptors"], 1);
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&whole).unwrap()).unwrap();
    assert_eq!((&json["asset"]["version"], &json["buffers"][0]["uri"]), (&"2.0".into(), &"whole.bin".into()));
    let before = bench.json("export", &[text(&whole), "--at", "1"]);
    assert_eq!((&before["descriptors"], &before["version"]), (&0.into(), &1.into()));
    let [e, n, _] = crate::bench::street().case.truth.position;
    let bbox = format!("{},{},{},{}", e - 5.0, n - 5.0, e + 5.0, n + 5.0);
    let region = bench.json("export", &[text(&part), "--bbox", &bbox]);
    assert!(region["objects"].as_u64() < all["objects"].as_u64(), "{region}");
    assert!(bench.is_unchanged());
}

#[test]
fn a_suffix_without_a_format_is_exit_2_and_writes_nothing() {
    let bench = Bench::with_street();
    for name in ["out.stl", "out", "out.glb.zip", ".glb"] {
        let out = bench.path(name);
        bench.refuses("export", &[text(&out)], 2, &[name, ".glb or .gltf"]);
        assert!(!out.exists());
    }
    let nowhere = bench.path("no/such/out.glb");
    bench.refuses("export", &[text(&nowhere)], 10, &["no/such/out.glb"]);
    bench.refuses("export", &[text(&bench.path("out.glb")), "--at", "9"], 11, &["no version 9"]);
}

#[test]
fn an_empty_map_exports_to_a_file_that_is_valid() {
    let bench = Bench::with_empty_map();
    let out = bench.path("out.glb");
    let run = bench.run("export", &[text(&out)]);
    assert!([0, 10].contains(&run.code), "{}", run.err);
    assert_eq!(run.code == 0, out.exists());
}

/// A search of a moment, whatever it finds.
const QUICK: &str = "semantic.radius_m=2";

#[test]
fn no_output_option_overwrites_a_map() {
    let bench = Bench::with_street();
    let (map, capture) = (bench.path("map.rsv"), crate::bench::street().path("capture/capture.json"));
    bench.refuses("localize", &[text(&capture), "--set", QUICK, "--out", text(&map)], 10, &["map.rsv", "a map"]);
    bench.refuses("localize", &[text(&capture), "--set", QUICK, "--heatmap", text(&map)], 10, &["map.rsv", "a map"]);
}
