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
    bench.refuses("export", &[text(&nowhere)], 10, &["no/such/out.glb: No such file or directory"]);
    assert!(!bench.run("export", &[text(&nowhere)]).err.contains(".resurvey-"));
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

#[test]
fn a_map_is_not_written_over_whatever_its_format_and_state() {
    let bench = Bench::with_street();
    let map = bench.path("map.rsv");
    let whole = std::fs::read(&map).unwrap();
    let newer = bench.path("newer.rsv");
    std::fs::copy(&map, &newer).unwrap();
    rusqlite::Connection::open(&newer).unwrap().pragma_update(None, "user_version", 9999).unwrap();
    let mut damaged = whole.clone();
    let length = damaged.len() - 4096;
    damaged[4096..].copy_from_slice(&crate::bench::noise(length));
    let damaged = [bench.file("damaged.glb", &damaged), bench.file("cut.glb", &whole[..200])];
    let log = bench.file("map.rsv-wal", "");
    for out in [text(&newer), &damaged[0], &damaged[1]] {
        let before = std::fs::read(out).unwrap();
        let named = bench.path("out.glb");
        std::fs::write(&named, &before).unwrap();
        bench.refuses("export", &[text(&named)], 10, &["out.glb", "found a map, which nothing writes over"]);
        assert_eq!(std::fs::read(&named).unwrap(), before);
    }
    let capture = crate::bench::street().path("capture/capture.json");
    for (out, word) in [(text(&newer), "found a map"), (&log, "found a part of a map")] {
        bench.refuses("localize", &[text(&capture), "--set", QUICK, "--out", out], 10, &[out, word]);
    }
}

#[test]
fn a_file_that_cannot_be_written_is_said_before_the_search_and_keeps_the_others() {
    let bench = Bench::with_street();
    let (capture, picture) = (crate::bench::street().path("capture/capture.json"), bench.path("heat.png"));
    let nowhere = bench.path("no/such/pose.json");
    let words = [text(&capture), "--heatmap", text(&picture), "--out", text(&nowhere)];
    bench.refuses("localize", &words, 10, &["no/such/pose.json"]);
    assert!(!picture.exists());
}

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_is_full_keeps_the_export_of_before() {
    let bench = Bench::with_street();
    let (map, out) = (bench.path("map.rsv"), bench.path("out.gltf"));
    bench.run("export", &[text(&out)]).ok();
    let before = ["out.gltf", "out.bin"].map(|name| std::fs::read(bench.path(name)).unwrap());
    assert!(before[1].len() > 40_960, "{} bytes", before[1].len());
    // Longer files are refused as on a full disk.
    let limited = "trap '' XFSZ; ulimit -f 80; exec \"$0\" \"$@\"";
    let output = std::process::Command::new("sh")
        .args(["-c", limited, env!("CARGO_BIN_EXE_resurvey"), "export", text(&map), text(&out)])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(10), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stderr).contains("out.bin: "));
    assert_eq!(["out.gltf", "out.bin"].map(|name| std::fs::read(bench.path(name)).unwrap()), before);
    let hidden = std::fs::read_dir(bench.path("."))
        .unwrap()
        .filter(|entry| entry.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
    assert_eq!(hidden.count(), 0);
}

#[test]
fn a_buffer_is_found_whatever_its_name() {
    let bench = Bench::with_street();
    let out = bench.path("a#1 50%.gltf");
    bench.run("export", &[text(&out)]).ok();
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    assert_eq!(json["buffers"][0]["uri"], "a%231%2050%25.bin");
    let again = bench.path("again.rsv");
    resurvey(&["init", text(&again)]).ok();
    resurvey(&["import", text(&again), text(&out)]).ok();
}
