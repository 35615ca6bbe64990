//! Models that are no models, or not what the map needs: exit code 10 and no new version.

use crate::bench::{Bench, noise, resurvey, street, text};
use crate::synthetic::label_png;

#[test]
fn a_model_that_is_not_there_is_named() {
    let bench = Bench::with_street();
    bench.refuses("import", &["/nowhere/tower.3ds"], 10, &["/nowhere/tower.3ds"]);
    let directory = text(bench.path("map.rsv").parent().unwrap()).to_owned();
    bench.refuses("import", &[&directory], 10, &[&directory]);
}

#[test]
fn files_without_a_model_are_refused_whatever_their_suffix() {
    let bench = Bench::with_street();
    for suffix in ["3ds", "glb", "gltf", "obj", "txt"] {
        for (name, contents) in [("empty", Vec::new()), ("random", noise(10_000)), ("text", b"a tower".to_vec())] {
            let name = format!("{name}.{suffix}");
            let file = bench.file(&name, contents);
            bench.refuses("import", &[&file], 10, &[&name]);
        }
    }
}

#[test]
fn a_model_cut_off_anywhere_is_refused_and_adds_nothing() {
    let bench = Bench::with_empty_map();
    for suffix in ["3ds", "glb"] {
        let whole = std::fs::read(street().model(suffix)).unwrap();
        for part in [4, 7, 20, whole.len() / 3, whole.len() / 2, whole.len() - 1] {
            let name = format!("cut.{suffix}");
            let file = bench.file(&name, &whole[..part]);
            bench.refuses("import", &[&file, "--origin", &street().origin()], 10, &[&name]);
        }
    }
    assert_eq!(bench.head(), 0);
}

#[test]
fn one_bad_file_among_good_ones_stops_the_whole_import() {
    let bench = Bench::with_empty_map();
    let (good, bad) = (street().model("glb"), bench.file("bad.glb", noise(100)));
    bench.refuses("import", &[text(&good), &bad, "--origin", &street().origin()], 10, &["bad.glb"]);
    assert_eq!(bench.head(), 0);
}

/// A wall of 2 m × 3 m as glTF text, with the material named `material` and its numbers in `wall.bin`.
fn wall(material: &str) -> String {
    let json = serde_json::json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "wall", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"name": material}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [2, 3, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{"byteLength": 60, "uri": "wall.bin"}],
    });
    json.to_string()
}

/// Four corners as f32 and six indices as u16.
fn wall_bytes() -> Vec<u8> {
    let corners: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 3.0, 0.0], [0.0, 3.0, 0.0]];
    let corners = corners.iter().flatten().flat_map(|number| number.to_le_bytes());
    corners.chain([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes())).collect()
}

#[test]
fn a_material_that_is_no_class_is_refused_until_it_is_mapped() {
    let bench = Bench::with_empty_map();
    bench.file("wall.bin", wall_bytes());
    let file = bench.file("wall.gltf", wall("brickwork"));
    let origin = "835600,817800,4.5";
    bench.refuses("import", &[&file, "--origin", origin], 10, &["brickwork", "--map-classes"]);

    let unknown = bench.file("unknown.toml", "brickwork = \"marble\"");
    bench.refuses("import", &[&file, "--map-classes", &unknown], 10, &["unknown.toml", "marble", "stone"]);
    let broken = bench.file("broken.toml", "brickwork = ");
    bench.refuses("import", &[&file, "--map-classes", &broken], 10, &["broken.toml"]);
    bench.refuses("import", &[&file, "--map-classes", "/nowhere.toml"], 10, &["/nowhere.toml"]);

    let good = bench.file("good.toml", "brickwork = \"stone\"");
    let imported = bench.json("import", &[&file, "--origin", origin, "--map-classes", &good]);
    assert_eq!((imported["version"].as_u64(), imported["files"][0]["triangles"].as_u64()), (Some(1), Some(2)));
}

#[test]
fn impossible_numbers_for_an_import_are_exit_2_or_10() {
    let bench = Bench::with_empty_map();
    let model = street().model("3ds");
    let model = text(&model);
    for (option, value, code, word) in [
        ("--rotate", "NaN", 2, "--rotate"),
        ("--nearest-colour", "-1", 2, "0 to 441"),
        ("--nearest-colour", "1000", 2, "0 to 441"),
        ("--origin", "1,2", 2, "found 2"),
        ("--origin", "inf,0,0", 2, "finite"),
        ("--origin", "1e300,0,0", 10, "not within"),
        ("--crs", "mercator", 2, "mercator"),
    ] {
        let value = format!("{option}={value}");
        bench.refuses("import", &[model, &value], code, &[word]);
    }
}

#[test]
fn a_label_texture_with_a_colour_that_is_no_class_names_the_texel() {
    let bench = Bench::with_empty_map();
    let folder = bench.path("street");
    std::fs::create_dir(&folder).unwrap();
    for entry in std::fs::read_dir(street().path("maps/street")).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
    let texture = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let texture = texture.filter(|path| path.extension().is_some_and(|suffix| suffix == "PNG")).min().unwrap();
    let model = folder.join("street.3ds");
    let words = [text(&model), "--origin", &street().origin()];
    for contents in
        [colour_png([1, 2, 3]), noise(500), Vec::new(), label_png::encode(&[0; 16], 4).unwrap()[..60].to_vec()]
    {
        std::fs::write(&texture, contents).unwrap();
        bench.refuses("import", &words, 10, &[texture.file_name().unwrap().to_str().unwrap()]);
    }
    std::fs::remove_file(&texture).unwrap();
    bench.refuses("import", &words, 10, &[texture.file_name().unwrap().to_str().unwrap()]);
}

/// A PNG of 4 × 4 pixels of one colour.
pub fn colour_png(colour: [u8; 3]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 4, 4);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(&colour.repeat(16)).unwrap();
    bytes
}

#[test]
fn a_new_map_never_replaces_a_file_and_its_class_table_must_be_one() {
    let bench = Bench::with_street();
    bench.refuses("init", &[], 10, &["map.rsv: exists already"]);
    let new = bench.path("new.rsv");
    let init = |words: &[&str]| resurvey(&[&["init", text(&new)], words].concat());
    init(&["--crs", "mars"]).refused(2, &["mars"]);
    init(&["--crs", "EPSG:2056"]).refused(2, &["EPSG:2056", "--features proj"]);
    init(&["--classes", "/nowhere.json"]).refused(10, &["/nowhere.json"]);
    for (contents, word) in [
        ("[]", "class"),
        ("[{", "EOF"),
        (r#"[{"index":0,"name":"stone","colour":[0,0,255],"kind":"rock"}]"#, "rock"),
        (
            r#"[{"index":0,"name":"a","colour":[0,0,255],"kind":"material"},
                {"index":0,"name":"b","colour":[0,0,254],"kind":"material"}]"#,
            "share an index",
        ),
    ] {
        let classes = bench.file("classes.json", contents);
        init(&["--classes", &classes]).refused(10, &["classes.json", word]);
    }
    assert!(!new.exists());
    let nowhere = bench.path("no/such/directory/new.rsv");
    resurvey(&["init", text(&nowhere)]).refused(10, &["no/such/directory"]);
}
