//! The documents read back with the `gltf` crate, and their bytes.

use crate::export::{ExportError, ExportScene, Mark, glb, gltf};
use crate::image::{LabelImage, read_labels};
use crate::mesh::{LabelTexture, Mesh, Object, Surface, Wrap};
use proptest::prelude::*;
use resurvey_schema::{ClassId, ClassTable, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Uncertainty};
use serde_json::Value;
use std::collections::BTreeMap;

const STONE: Surface = Surface::Class(ClassId(0));
const GLASS: Surface = Surface::Class(ClassId(1));

/// A wall of 10 × 3 m that runs north from `origin`, in two triangles, one per surface.
fn wall(name: &str, origin: GridPoint, surfaces: &[Surface; 2]) -> Object {
    Object {
        name: name.to_owned(),
        mesh: Mesh {
            origin,
            vertices: vec![[0.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 10.0, 3.0], [0.0, 0.0, 3.0]],
            uvs: vec![[0.0, 1.0], [2.5, 1.0], [2.5, 0.0], [0.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            triangle_surfaces: vec![0, 1],
            surfaces: surfaces.to_vec(),
        },
    }
}

fn labels(name: &str) -> LabelTexture {
    LabelTexture {
        name: name.to_owned(),
        labels: LabelImage::from_values(3, 2, vec![0, 1, 2, 3, 255, 8]).unwrap(),
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Clamp,
    }
}

fn banner() -> Descriptor {
    let corner = |north_m: f64, height_m: f64| GridPoint::new(835_600.02, 817_802.0 + north_m, height_m);
    Descriptor::Material(MaterialDescriptor {
        class: ClassId(3),
        corners: [corner(0.0, 5.0), corner(3.0, 5.0), corner(3.0, 6.1), corner(0.0, 6.1)],
        normal: [1.0, 0.0, 0.0],
        sigma: Some(Uncertainty { position_m: 0.3, size_m: None, area_m2: None }),
    })
}

/// 0.5 m wide, 2 m long, heading east.
fn bench() -> Descriptor {
    Descriptor::Dynamic(DynamicDescriptor {
        class: ClassId(5),
        position: GridPoint::new(835_610.0, 817_800.0, 4.5),
        size_m: [2.0, 0.5, 0.9],
        yaw_rad: Some(std::f64::consts::FRAC_PI_2),
        sigma: None,
    })
}

fn scene<'a>(classes: &'a ClassTable, objects: &'a [Object], descriptors: &'a [Descriptor]) -> ExportScene<'a> {
    ExportScene {
        version: 12,
        crs: "EPSG:2326",
        vertical_datum: "hkpd",
        classes,
        objects: (1..).zip(objects).collect(),
        descriptors: (17..).zip(descriptors).collect(),
        marks: BTreeMap::new(),
    }
}

fn street() -> (Vec<Object>, Vec<Descriptor>) {
    let origin = GridPoint::new(835_600.25, 817_800.5, 4.5);
    let walls = vec![
        wall("W1", origin, &[STONE, GLASS]),
        wall("W2", GridPoint { easting_m: 835_620.0, ..origin }, &[Surface::Texture(labels("T7.PNG")), STONE]),
        wall("W3", GridPoint { easting_m: 835_640.0, ..origin }, &[Surface::Texture(labels("T7.PNG")), GLASS]),
    ];
    (walls, vec![banner(), bench()])
}

fn export(scene: &ExportScene) -> (::gltf::Gltf, Value, Vec<u8>) {
    let bytes = glb(scene).unwrap();
    let container = ::gltf::Glb::from_slice(&bytes).unwrap();
    let json = serde_json::from_slice(&container.json).unwrap();
    (::gltf::Gltf::from_slice(&bytes).unwrap(), json, container.bin.map(Vec::from).unwrap_or_default())
}

/// Triangles of the named node as grid points, walked in `f64` from the asset's origin through the root matrix.
fn triangles_of(document: &(::gltf::Gltf, Value, Vec<u8>), name: &str) -> Vec<[GridPoint; 3]> {
    let (gltf, json, blob) = document;
    let origin: [f64; 3] = serde_json::from_value(json["asset"]["extras"]["resurvey"]["grid_origin"].clone()).unwrap();
    let root = gltf.default_scene().unwrap().nodes().next().unwrap();
    let matrix = root.transform().matrix();
    let node = root.children().find(|node| node.name() == Some(name)).unwrap();
    let (translation, ..) = node.transform().decomposed();
    let mut triangles = Vec::new();
    for primitive in node.mesh().unwrap().primitives() {
        let reader = primitive.reader(|_| Some(blob.as_slice()));
        let to_grid = |v: [f32; 3]| {
            let inside = [0, 1, 2].map(|axis| f64::from(v[axis]) + f64::from(translation[axis]));
            let y_up = [0, 1, 2].map(|row| (0..3).map(|column| f64::from(matrix[column][row]) * inside[column]).sum());
            let [x, y, z]: [f64; 3] = y_up;
            GridPoint::new(origin[0] + x, origin[1] - z, origin[2] + y)
        };
        let points: Vec<_> = reader.read_positions().unwrap().map(to_grid).collect();
        let corners: Vec<_> = reader.read_indices().unwrap().into_u32().map(|index| points[index as usize]).collect();
        triangles.extend(corners.chunks(3).map(|corner| [corner[0], corner[1], corner[2]]));
    }
    triangles
}

fn worst_distance_m(a: &[[GridPoint; 3]], b: &[[GridPoint; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let distance_m = |(a, b): (&GridPoint, &GridPoint)| a.plan_distance_m(b).hypot(a.height_m - b.height_m);
    a.as_flattened().iter().zip(b.as_flattened()).map(distance_m).fold(0.0, f64::max)
}

fn triangles_of_object(object: &Object) -> Vec<[GridPoint; 3]> {
    let Mesh { origin, vertices, triangles, .. } = &object.mesh;
    let grid = |corner: u32| {
        let [east, north, up] = vertices[corner as usize].map(f64::from);
        GridPoint::new(origin.easting_m + east, origin.northing_m + north, origin.height_m + up)
    };
    triangles.iter().map(|triangle| triangle.map(grid)).collect()
}

#[test]
fn objects_and_descriptors_keep_their_places_names_and_ids() {
    let (walls, descriptors) = street();
    let classes = ClassTable::default();
    let document = export(&scene(&classes, &walls, &descriptors));
    for wall in &walls {
        let found = triangles_of(&document, &wall.name);
        assert!(worst_distance_m(&found, &triangles_of_object(wall)) < 1e-5);
    }
    // The wall's side faces east; the rectangle is drawn 2 cm in front of its corners.
    let corner = |north_m: f64, height_m: f64| GridPoint::new(835_600.04, 817_802.0 + north_m, height_m);
    let [a, b, c, d] = [corner(0.0, 5.0), corner(3.0, 5.0), corner(3.0, 6.1), corner(0.0, 6.1)];
    assert!(worst_distance_m(&triangles_of(&document, "banner 17"), &[[a, b, c], [a, c, d]]) < 1e-5);
    let nodes = document.1["nodes"].as_array().unwrap();
    let extras = |name: &str| nodes.iter().find(|node| node["name"] == name).unwrap()["extras"].clone();
    assert_eq!(extras("W2")["fid"], 2);
    assert_eq!(extras("W2")["kind"], "object");
    assert_eq!(extras("banner 17")["class"], "banner");
    assert_eq!(extras("banner 17")["kind"], "material");
    assert_eq!(extras("banner 17")["corners"][2], serde_json::json!([835_600.02, 817_805.0, 6.1]));
    assert_eq!(extras("chair 18")["size_m"], serde_json::json!([2.0, 0.5, 0.9]));
    assert_eq!(extras("chair 18")["yaw_deg"], 90.0);
    let asset = &document.1["asset"]["extras"]["resurvey"];
    assert_eq!(asset["crs"], "EPSG:2326");
    assert_eq!(asset["vertical_datum"], "hkpd");
    assert_eq!(asset["version"], 12);
}

#[test]
fn a_dynamic_descriptor_is_a_closed_box_on_its_ground_contact() {
    let document = export(&scene(&ClassTable::default(), &[], &[bench()]));
    let triangles = triangles_of(&document, "chair 17");
    let bound = |pick: fn(&GridPoint) -> f64, fold: fn(f64, f64) -> f64| {
        triangles.as_flattened().iter().map(pick).reduce(fold).unwrap()
    };
    // It heads east: 2 m along the easting, 0.5 m along the northing, 0.9 m up from the ground.
    let near = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-5, "{found} against {expected}");
    near(bound(|p| p.easting_m, f64::min), 835_609.0);
    near(bound(|p| p.easting_m, f64::max), 835_611.0);
    near(bound(|p| p.northing_m, f64::min), 817_799.75);
    near(bound(|p| p.northing_m, f64::max), 817_800.25);
    near(bound(|p| p.height_m, f64::min), 4.5);
    near(bound(|p| p.height_m, f64::max), 5.4);
    // Divergence theorem: the volume is right and positive only for a closed body whose faces all look outwards.
    let volume_m3: f64 = triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|p| [p.easting_m - 835_610.0, p.northing_m - 817_800.0, p.height_m - 4.5]);
            (a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]))
                / 6.0
        })
        .sum();
    near(volume_m3, 0.9);
}

#[test]
fn classes_are_named_and_coloured_and_label_textures_come_back() {
    let (walls, descriptors) = street();
    let classes = ClassTable::default();
    let (gltf, _, blob) = export(&scene(&classes, &walls, &descriptors));
    let names: Vec<_> = gltf.materials().map(|material| material.name().unwrap().to_owned()).collect();
    assert_eq!(names, ["stone", "glass", "labels: T7.PNG", "banner", "chair"]);
    let banner = gltf.materials().nth(3).unwrap();
    assert!(banner.double_sided());
    // sRGB 165 and 42 in linear light, from the table of IEC 61966-2-1.
    for (found, expected) in
        banner.pbr_metallic_roughness().base_color_factor().into_iter().zip([0.3763, 0.0232, 0.0232, 1.0])
    {
        assert!((found - expected).abs() < 1e-4, "{found} against {expected}");
    }
    assert_eq!(gltf.images().count(), 1, "equal textures are written once");
    let texture = gltf.textures().next().unwrap();
    assert_eq!(texture.sampler().wrap_s(), ::gltf::texture::WrappingMode::Repeat);
    assert_eq!(texture.sampler().wrap_t(), ::gltf::texture::WrappingMode::ClampToEdge);
    assert_eq!(texture.sampler().mag_filter(), Some(::gltf::texture::MagFilter::Nearest));
    let ::gltf::image::Source::View { view, mime_type } = texture.source().source() else { panic!("not embedded") };
    assert_eq!(mime_type, "image/png");
    let png = &blob[view.offset()..view.offset() + view.length()];
    let read = read_labels(png, &classes, &Default::default()).unwrap();
    assert_eq!(read, labels("T7.PNG").labels);
    let wall = gltf.nodes().find(|node| node.name() == Some("W2")).unwrap();
    let textured = wall.mesh().unwrap().primitives().next().unwrap();
    let uvs: Vec<_> = textured.reader(|_| Some(blob.as_slice())).read_tex_coords(0).unwrap().into_f32().collect();
    assert_eq!(uvs, [[0.0, 1.0], [2.5, 1.0], [2.5, 0.0]]);
}

#[test]
fn every_vertex_carries_the_row_of_its_class_and_feature_id() {
    let (walls, descriptors) = street();
    let classes = ClassTable::default();
    let (gltf, json, blob) = export(&scene(&classes, &walls, &descriptors));
    let metadata = &json["extensions"]["EXT_structural_metadata"];
    let table = &metadata["propertyTables"][0];
    let view = |index: &Value| {
        let view = gltf.views().nth(index.as_u64().unwrap() as usize).unwrap();
        &blob[view.offset()..view.offset() + view.length()]
    };
    let fids: Vec<_> = view(&table["properties"]["fid"]["values"])
        .chunks(8)
        .map(|bytes| u64::from_le_bytes(bytes.try_into().unwrap()))
        .collect();
    assert_eq!(fids, [1, 1, 2, 2, 3, 3, 17, 18]);
    assert_eq!(view(&table["properties"]["class"]["values"]), [0, 1, 255, 0, 255, 1, 3, 5]);
    let strings = |property: &str| {
        let property = &table["properties"][property];
        let text = view(&property["values"]);
        let offsets: Vec<_> = view(&property["stringOffsets"])
            .chunks(4)
            .map(|bytes| u32::from_le_bytes(bytes.try_into().unwrap()) as usize)
            .collect();
        offsets.windows(2).map(|pair| String::from_utf8(text[pair[0]..pair[1]].to_vec()).unwrap()).collect::<Vec<_>>()
    };
    assert_eq!(strings("class_name"), ["stone", "glass", "", "stone", "", "glass", "banner", "chair"]);
    assert_eq!(strings("kind")[5..], ["object", "material", "dynamic"]);
    let mut row = 0_u64;
    for mesh in json["meshes"].as_array().unwrap() {
        for primitive in mesh["primitives"].as_array().unwrap() {
            let feature = &primitive["extensions"]["EXT_mesh_features"]["featureIds"][0];
            assert_eq!(feature["attribute"], 0);
            assert_eq!(feature["propertyTable"], 0);
            let accessor = &json["accessors"][primitive["attributes"]["_FEATURE_ID_0"].as_u64().unwrap() as usize];
            for id in view(&accessor["bufferView"]).chunks(4) {
                assert_eq!(id, (row as f32).to_le_bytes());
            }
            row += 1;
        }
    }
    assert_eq!(row, table["count"].as_u64().unwrap());
    assert_eq!(
        json["extensionsUsed"],
        serde_json::json!(["EXT_mesh_features", "EXT_structural_metadata", "KHR_materials_unlit"])
    );
}

#[test]
fn views_start_at_multiples_of_eight_in_the_file_and_do_not_overlap() {
    let (walls, descriptors) = street();
    let classes = ClassTable::default();
    let bytes = glb(&scene(&classes, &walls, &descriptors)).unwrap();
    let json_length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    assert_eq!((20 + json_length + 8) % 8, 0, "the buffer itself");
    assert_eq!(u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize, bytes.len());
    let (_, json, blob) = export(&scene(&classes, &walls, &descriptors));
    let mut end = 0;
    for view in json["bufferViews"].as_array().unwrap() {
        let start = view["byteOffset"].as_u64().unwrap();
        assert!(start % 8 == 0 && start >= end);
        end = start + view["byteLength"].as_u64().unwrap();
    }
    assert_eq!(json["buffers"][0]["byteLength"], end);
    assert!(blob.len() as u64 >= end);
}

#[test]
fn the_same_scene_gives_the_same_bytes() {
    let (walls, descriptors) = street();
    let classes = ClassTable::default();
    let scene = scene(&classes, &walls, &descriptors);
    assert_eq!(glb(&scene).unwrap(), glb(&scene).unwrap());
    assert_eq!(gltf(&scene, "map.bin").unwrap(), gltf(&scene, "map.bin").unwrap());
}

#[test]
fn the_two_forms_hold_the_same_document() {
    let (walls, descriptors) = street();
    let classes = ClassTable::default();
    let scene = scene(&classes, &walls, &descriptors);
    let files = gltf(&scene, "map.bin").unwrap();
    let mut json: Value = serde_json::from_slice(&files.json).unwrap();
    assert_eq!(json["buffers"][0].as_object_mut().unwrap().remove("uri"), Some("map.bin".into()));
    let (_, in_container, blob) = export(&scene);
    assert_eq!(json, in_container);
    assert_eq!(files.buffer, blob[..files.buffer.len()]);
}

#[test]
fn an_empty_scene_is_a_valid_document_without_a_buffer() {
    let (gltf, json, blob) = export(&scene(&ClassTable::default(), &[], &[]));
    assert_eq!(gltf.nodes().count(), 1);
    assert!(blob.is_empty() && json.get("buffers").is_none() && json.get("extensionsUsed").is_none());
    let empty = Object {
        name: "nothing".to_owned(),
        mesh: Mesh { triangles: vec![], triangle_surfaces: vec![], ..street().0[0].mesh.clone() },
    };
    let (gltf, _, _) = export(&scene(&ClassTable::default(), &[empty], &[]));
    assert_eq!((gltf.nodes().count(), gltf.meshes().count()), (2, 0));
}

proptest! {
    #[test]
    fn positions_stay_within_a_millimetre_wherever_in_hong_kong_two_objects_stand(
        a in [793_000.0..871_000.0, 799_000.0..850_000.0, -20.0..1000.0],
        b in [793_000.0..871_000.0, 799_000.0..850_000.0, -20.0..1000.0],
        offset_m in proptest::array::uniform3(-1000.0_f32..1000.0),
    ) {
        let mut walls = [wall("a", a.into(), &[STONE, GLASS]), wall("b", b.into(), &[STONE, GLASS])];
        walls[0].mesh.vertices[2] = offset_m;
        let classes = ClassTable::default();
        let document = export(&scene(&classes, &walls, &[]));
        for wall in &walls {
            let found = triangles_of(&document, &wall.name);
            prop_assert!(worst_distance_m(&found, &triangles_of_object(wall)) < 1e-3);
        }
    }
}

#[test]
fn a_mesh_that_contradicts_itself_is_refused_by_name() {
    let classes = ClassTable::default();
    let good = || wall("W1", GridPoint::new(835_600.0, 817_800.0, 4.5), &[STONE, Surface::Texture(labels("T"))]);
    let refuse = |change: fn(&mut Mesh)| {
        let mut wall = good();
        change(&mut wall.mesh);
        glb(&scene(&classes, &[wall], &[])).unwrap_err().to_string()
    };
    assert_eq!(
        refuse(|mesh| mesh.triangles[1][2] = 4),
        "object \"W1\" (feature 1): expected vertex indices below 4, found 4"
    );
    assert!(refuse(|mesh| mesh.triangle_surfaces[0] = 2).contains("surface indices below 2, found 2"));
    assert!(refuse(|mesh| mesh.triangle_surfaces.truncate(1)).contains("a surface for each of 2 triangles, found 1"));
    assert!(refuse(|mesh| mesh.uvs.truncate(3)).contains("texture coordinates for each of 4 vertices, found 3"));
    assert!(refuse(|mesh| mesh.uvs[0][0] = f32::NAN).contains("finite texture coordinates, found NaN"));
    assert!(refuse(|mesh| mesh.vertices[0][0] = f32::INFINITY).contains("expected finite coordinates"));
    assert!(refuse(|mesh| mesh.vertices[0][0] = 9000.0).contains("the limit is 2048 m"));
    assert!(refuse(|mesh| mesh.origin.height_m = f64::NAN).contains("feature 1: expected finite coordinates"));
    assert!(refuse(|mesh| mesh.surfaces[0] = Surface::Class(ClassId(77))).contains("feature 1: class 77"));
    assert!(
        refuse(|mesh| mesh.surfaces[1] =
            Surface::Texture(LabelTexture { labels: LabelImage::filled(0, 0, 0), ..labels("T7") }))
        .contains("label texture \"T7\"")
    );
    let far = wall("far", GridPoint::new(1e9, 0.0, 0.0), &[STONE, GLASS]);
    let error = glb(&scene(&classes, &[good(), far], &[])).unwrap_err();
    assert!(matches!(error, ExportError::Position { .. }), "{error}");
}

#[test]
fn a_difference_is_drawn_in_one_material_for_each_thing_that_became_of_a_feature() {
    let (objects, descriptors) = street();
    let classes = ClassTable::default();
    let mut scene = scene(&classes, &objects, &descriptors);
    // The textured wall went, the banner came, the bench moved; the other walls are as they were.
    scene.marks = BTreeMap::from([(2, Mark::Removed), (17, Mark::Added), (18, Mark::Changed)]);
    let (file, json, _) = export(&scene);
    let material_of = |name: &str| {
        let node = file.nodes().find(|node| node.name() == Some(name)).unwrap();
        let names = node.mesh().unwrap().primitives().map(|one| one.material().name().unwrap().to_owned());
        names.collect::<Vec<_>>()
    };
    assert_eq!(material_of("W2"), ["removed", "removed"]);
    assert_eq!((material_of("banner 17"), material_of("chair 18")), (vec!["added".into()], vec!["changed".into()]));
    assert_eq!(material_of("W1"), ["stone", "glass"]);
    let extras = json["nodes"].as_array().unwrap().iter().map(|node| &node["extras"]);
    let marks: Vec<_> = extras.filter_map(|extras| extras["difference"].as_str()).collect();
    assert_eq!(marks, ["removed", "added", "changed"]);
}
