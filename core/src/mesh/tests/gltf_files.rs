//! glTF files built here: containers, transforms, modes, accessors, textures, extensions.

use super::*;
use serde_json::{Value, json};

/// A GLB of `json` and `binary`.
pub(super) fn glb(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let word = |value: usize| (value as u32).to_le_bytes();
    [
        &b"glTF"[..],
        &word(2),
        &word(28 + text.len() + binary.len()),
        &word(text.len()),
        b"JSON",
        &text,
        &word(binary.len()),
        b"BIN\0",
        &binary,
    ]
    .concat()
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// A square of 2 m in the plane z = 0 (upright, facing south), texture over the whole, indices as bytes; buffer views:
/// 0 positions, 1 texture coordinates, 2 indices, 3 the label image.
pub(super) fn square() -> (Value, Vec<u8>) {
    let positions = floats(&[0., 0., 0., 2., 0., 0., 2., 2., 0., 0., 2., 0.]);
    let coordinates = floats(&[0., 1., 1., 1., 1., 0., 0., 0.]);
    let indices = [0u8, 1, 2, 0, 2, 3, 0, 0];
    let image = four_labels();
    let json = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "wall", "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [{"name": "labels", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
            {"bufferView": 2, "componentType": 5121, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 32},
            {"buffer": 0, "byteOffset": 80, "byteLength": 6},
            {"buffer": 0, "byteOffset": 88, "byteLength": image.len()},
        ],
        "buffers": [{"byteLength": 88 + image.len()}],
    });
    (json, [&positions[..], &coordinates, &indices, &image].concat())
}

/// The square after `edit` of its JSON.
fn edited(edit: impl FnOnce(&mut Value)) -> Vec<u8> {
    let (mut json, binary) = square();
    edit(&mut json);
    glb(&json, &binary)
}

fn mesh_of(bytes: &[u8]) -> Mesh {
    import(bytes, &origin(0.0, 0.0, 0.0)).unwrap().objects.remove(0).mesh
}

fn message(bytes: &[u8]) -> String {
    import(bytes, &ImportOptions::default()).unwrap_err().to_string()
}

#[test]
fn a_square_stands_upright_with_its_labels() {
    let mesh = mesh_of(&edited(|_| ()));
    // x east, y up, z south.
    assert_eq!(corners(&mesh, 0), [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 0.0, 2.0]]);
    assert_eq!(mesh.uvs, [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    let Surface::Texture(texture) = &mesh.surfaces[0] else { panic!() };
    assert_eq!((texture.labels.values(), texture.name.as_str()), (&[0, 1, 2, 255][..], "image0"));
    assert_eq!((texture.wrap_u, texture.wrap_v), (Wrap::Repeat, Wrap::Repeat));
}

#[test]
fn buffers_and_images_may_be_data_uris_or_files() {
    // A second encoder than the decoder under test.
    fn base64(bytes: &[u8]) -> String {
        const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let bits: Vec<u8> = bytes.iter().flat_map(|byte| (0..8).rev().map(move |bit| byte >> bit & 1)).collect();
        let text: String = bits
            .chunks(6)
            .map(|six| six.iter().chain([0; 6].iter()).take(6).fold(0, |value, bit| value << 1 | bit))
            .map(|value: u8| char::from(LETTERS[usize::from(value)]))
            .collect();
        let padding = (4 - text.len() % 4) % 4;
        text + &"=".repeat(padding)
    }
    let (mut json, binary) = square();
    let expected = mesh_of(&glb(&json, &binary));
    json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{}", base64(&binary)));
    assert_eq!(mesh_of(json.to_string().as_bytes()), expected);

    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("my wall.bin"), &binary).unwrap();
    std::fs::write(folder.path().join("labels.png"), four_labels()).unwrap();
    json["buffers"][0]["uri"] = json!("my%20wall.bin");
    json["images"][0] = json!({"uri": "labels.png"});
    let text = format!("\u{feff} {json}");
    let mut mesh = import_in(folder.path(), text.as_bytes(), &origin(0.0, 0.0, 0.0)).unwrap().objects.remove(0).mesh;
    if let Surface::Texture(texture) = &mut mesh.surfaces[0] {
        assert_eq!(std::mem::replace(&mut texture.name, "image0".to_owned()), "labels.png");
    }
    assert_eq!(mesh, expected);
}

#[test]
fn node_transforms_multiply_down_the_tree_in_double_precision() {
    let bytes = edited(|json| {
        json["scenes"][0]["nodes"] = json!([1]);
        json["nodes"] = json!([
            {"name": "wall", "mesh": 0, "scale": [2, 2, 2], "rotation": [0, (0.5f64).sqrt(), 0, (0.5f64).sqrt()]},
            {"children": [0], "translation": [836694.05, 1.25, -819069.8]},
        ]);
    });
    let mesh = mesh_of(&bytes);
    // A quarter turn about y takes +x to −z, which is north: 2 m east become 4 m north of (836694.05, 819069.80).
    let expected = [[836_694.05, 819_069.8, 1.25], [836_694.05, 819_073.8, 1.25], [836_694.05, 819_073.8, 5.25]];
    for (corner, expected) in corners(&mesh, 0).iter().flatten().zip(expected.iter().flatten()) {
        assert!((corner - expected).abs() < 1e-6, "{corner} for {expected}");
    }
    let bytes = edited(|json| json["nodes"][0]["matrix"] = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, -7, 1]));
    assert_eq!(corners(&mesh_of(&bytes), 0)[0], [5.0, 7.0, 6.0]);
}

#[test]
fn a_node_tree_that_is_no_tree_is_refused() {
    let circle = edited(|json| json["nodes"][0]["children"] = json!([0]));
    assert!(message(&circle).contains("its own ancestor"), "{}", message(&circle));
    let missing = edited(|json| json["scenes"][0]["nodes"] = json!([7]));
    assert!(message(&missing).contains("nodes[7]"));
    let flat = edited(|json| json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]));
    assert!(message(&flat).contains("rotation"));
}

#[test]
fn strips_fans_and_lists_without_indices_are_triangles_and_lines_are_counted() {
    let with_mode = |mode: u32| {
        edited(|json| {
            json["meshes"][0]["primitives"][0]["mode"] = json!(mode);
            json["accessors"][2] = json!({"bufferView": 2, "componentType": 5121, "count": 4, "type": "SCALAR"});
            json["bufferViews"][2]["byteOffset"] = json!(82);
            json["bufferViews"][2]["byteLength"] = json!(4);
        })
    };
    // Indices 2 0 2 3: as a strip (2 0 2) and (0 3 2); as a fan (2 0 2) and (2 2 3).
    let strip = import(&with_mode(5), &origin(0.0, 0.0, 0.0)).unwrap();
    assert_eq!((strip.report.triangles, strip.report.degenerate_faces), (1, 1));
    assert_eq!(corners(&strip.objects[0].mesh, 0), [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [2.0, 0.0, 2.0]]);
    assert!(message(&with_mode(6)).contains("2 faces of no area"));
    assert!(message(&with_mode(1)).contains("1 points or lines"));
    assert!(message(&with_mode(7)).contains("expected a mode of 0 to 6"));
    assert!(message(&with_mode(4)).contains("three indices a triangle, found 4"));
    let unindexed = edited(|json| {
        json["meshes"][0]["primitives"][0]["mode"] = json!(6);
        json["meshes"][0]["primitives"][0].as_object_mut().unwrap().remove("indices");
    });
    assert_eq!(import(&unindexed, &origin(0.0, 0.0, 0.0)).unwrap().report.triangles, 2);
}

#[test]
fn quantized_positions_and_sparse_values_are_decoded() {
    // Positions as normalized bytes with a stride of 4, then vertex 2 replaced by (1, 3, 0).
    let (mut json, _) = square();
    let mut binary = vec![0u8, 0, 0, 9, 255, 0, 0, 9, 255, 255, 0, 9, 0, 255, 0, 9];
    binary.extend([2, 0, 0, 0]);
    binary.extend([255, 0, 0, 0]);
    binary.extend([0, 1, 2, 0, 2, 3, 0, 0]);
    json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    json["materials"] = json!([{"name": "Stone"}]);
    json["images"] = json!([]);
    json["textures"] = json!([]);
    json["accessors"][0] = json!({
        "bufferView": 0, "componentType": 5121, "normalized": true, "count": 4, "type": "VEC3",
        "sparse": {
            "count": 1,
            "indices": {"bufferView": 1, "componentType": 5121},
            "values": {"bufferView": 1, "byteOffset": 4},
        },
    });
    json["bufferViews"] = json!([
        {"buffer": 0, "byteLength": 16, "byteStride": 4},
        {"buffer": 0, "byteOffset": 16, "byteLength": 8},
        {"buffer": 0, "byteOffset": 24, "byteLength": 6},
    ]);
    json["buffers"] = json!([{"byteLength": 32}]);
    json["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 0});
    let mesh = mesh_of(&glb(&json, &binary));
    // Vertex 2 is (1, 0, 0) now: the first face has no area, the second is 0, 2, 3.
    assert_eq!(corners(&mesh, 0), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!((mesh.triangles.len(), class_at_middle(&mesh, 0)), (1, STONE));
}

#[test]
fn extensions_that_cannot_be_decoded_are_refused_by_name() {
    let bytes = edited(|json| {
        json["extensionsRequired"] =
            json!(["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_materials_unlit"]);
    });
    let text = message(&bytes);
    assert!(text.contains("requires \"KHR_draco_mesh_compression\", \"EXT_meshopt_compression\", which"), "{text}");
}

#[test]
fn texture_transforms_scale_and_shift_and_a_turned_texture_is_refused() {
    let with = |transform: Value| {
        edited(|json| {
            let texture = &mut json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
            texture["extensions"] = json!({"KHR_texture_transform": transform});
            texture["texCoord"] = json!(3);
        })
    };
    let mesh = mesh_of(&with(json!({"offset": [0.5, 0.0], "scale": [0.25, 2.0], "texCoord": 0})));
    assert_eq!(mesh.uvs[..2], [[0.5, 2.0], [0.75, 2.0]]);
    assert!(message(&with(json!({"rotation": 1.5, "texCoord": 0}))).contains("KHR_texture_transform turns it"));
    let bare = message(&with(json!({})));
    assert!(bare.contains("vertex 0 has no finite texture coordinates"), "{bare}");
}

#[test]
fn the_sampler_says_how_the_texture_repeats() {
    let bytes = edited(|json| {
        json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648}]);
        json["textures"][0]["sampler"] = json!(0);
    });
    let Surface::Texture(texture) = &mesh_of(&bytes).surfaces[0] else { panic!() };
    assert_eq!((texture.wrap_u, texture.wrap_v), (Wrap::Clamp, Wrap::Mirror));
}

#[test]
fn a_file_that_says_where_it_lies_needs_no_origin() {
    let bytes =
        edited(|json| json["asset"]["extras"] = json!({"resurvey": {"grid_origin": [835600.0, 817800.0, 4.5]}}));
    let imported = import(&bytes, &ImportOptions::default()).unwrap();
    assert_eq!(corners(&imported.objects[0].mesh, 0)[0], [835_600.0, 817_800.0, 4.5]);
    assert!(imported.report.warnings.is_empty());
    // An origin that the user gives goes first.
    assert_eq!(corners(&mesh_of(&bytes), 0)[0], [0.0, 0.0, 0.0]);
    let bytes = edited(|json| json["asset"]["extras"] = json!({"resurvey": {"grid_origin": "here"}}));
    let imported = import(&bytes, &ImportOptions::default()).unwrap();
    assert!(imported.report.warnings[0].contains("grid_origin"), "{:?}", imported.report.warnings);
}

#[test]
fn numbers_that_point_outside_are_refused_with_their_place() {
    let cases: [(&str, &str, Value); 9] = [
        ("/meshes/0/primitives/0/attributes/POSITION", "accessors[99]", json!(99)),
        ("/meshes/0/primitives/0/material", "no material 5", json!(5)),
        ("/accessors/0/bufferView", "bufferViews[9]", json!(9)),
        ("/accessors/0/count", "accessors[0]", json!(5)),
        ("/accessors/0/count", "more than 20000000", json!(u64::MAX)),
        ("/accessors/0/type", "expected VEC3", json!("VEC2")),
        ("/bufferViews/0/byteOffset", "bufferViews[0]", json!(u64::MAX)),
        ("/buffers/0/byteLength", "buffers[0]", json!(1_000_000)),
        ("/textures/0/source", "no image 4", json!(4)),
    ];
    for (pointer, expected, value) in cases {
        let bytes = edited(|json| *json.pointer_mut(pointer).unwrap() = value.clone());
        let text = message(&bytes);
        assert!(text.contains(expected), "{pointer} = {value}: {text}");
    }
}

#[test]
fn other_formats_are_refused_by_name() {
    for (content, name) in [
        ("{\"type\": \"CityJSON\", \"version\": \"2.0\"}", "CityJSON"),
        ("{\"type\": \"FeatureCollection\"}", "JSON without"),
        ("# cube\nmtllib cube.mtl\nv 0 0 0\n", "OBJ"),
        ("<?xml version=\"1.0\"?><CityModel xmlns=\"http://www.opengis.net/citygml/2.0\">", "CityGML"),
        ("", "an empty file"),
        ("hello", "68 65 6c 6c 6f"),
    ] {
        let text = message(content.as_bytes());
        assert!(text.contains(name) && text.contains("3DS") && text.contains("glTF"), "{text}");
    }
}
