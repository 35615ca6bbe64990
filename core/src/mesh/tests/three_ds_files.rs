//! 3DS files built chunk by chunk.

use super::*;

/// A chunk of `kind` around `parts`.
pub(super) fn chunk(kind: u16, parts: &[&[u8]]) -> Vec<u8> {
    let body = parts.concat();
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend_from_slice(&(body.len() as u32 + 6).to_le_bytes());
    bytes.extend_from_slice(&body);
    bytes
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn words(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// `name` with its zero byte.
fn text(name: &str) -> Vec<u8> {
    [name.as_bytes(), &[0]].concat()
}

fn material(name: &str, map: &[u8]) -> Vec<u8> {
    chunk(0xAFFF, &[&chunk(0xA000, &[&text(name)]), map])
}

fn texture_map(file: &str, more: &[u8]) -> Vec<u8> {
    chunk(0xA200, &[&chunk(0xA300, &[&text(file)]), more])
}

/// A wall of two triangles in the plane y = 0, 4 m wide and 2 m high, with texture coordinates over the whole image.
/// `groups` give faces to materials.
fn wall(name: &str, groups: &[(&str, &[u16])], more: &[u8]) -> Vec<u8> {
    let points = floats(&[0., 0., 0., 4., 0., 0., 4., 0., 2., 0., 0., 2.]);
    let coordinates = floats(&[0., 0., 1., 0., 1., 1., 0., 1.]);
    let faces = words(&[2, 0, 1, 2, 0, 0, 2, 3, 0]);
    let groups: Vec<u8> = groups
        .iter()
        .flat_map(|(name, faces)| chunk(0x4130, &[&text(name), &words(&[faces.len() as u16]), &words(faces)]))
        .collect();
    let mesh = chunk(
        0x4100,
        &[
            &chunk(0x4110, &[&words(&[4]), &points]),
            &chunk(0x4140, &[&words(&[4]), &coordinates]),
            &chunk(0x4120, &[&faces, &groups]),
            more,
        ],
    );
    chunk(0x4000, &[&text(name), &mesh])
}

pub(super) fn file(parts: &[&[u8]]) -> Vec<u8> {
    chunk(0x4D4D, &[&chunk(0x0002, &[&[3, 0, 0, 0]]), &chunk(0x3D3D, parts)])
}

/// A wall with a label texture in `labels.png` and a wall with one face of stone and one of glass.
pub(super) fn two_walls() -> Vec<u8> {
    file(&[
        &material("painted", &texture_map("LABELS.PNG", &[])),
        &material("stone", &[]),
        &wall("a", &[("painted", &[0, 1])], &[]),
        &wall("b", &[("stone", &[0]), ("GLASS.001", &[1])], &[]),
    ])
}

pub(super) fn folder_with_labels() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("labels.png"), four_labels()).unwrap();
    folder
}

fn texture(mesh: &Mesh) -> &LabelTexture {
    let Surface::Texture(texture) = &mesh.surfaces[0] else { panic!("{:?}", mesh.surfaces[0]) };
    texture
}

#[test]
fn objects_lie_at_the_origin_with_their_classes_and_textures() {
    let folder = folder_with_labels();
    let imported = import_in(folder.path(), &two_walls(), &origin(835_600.0, 817_800.0, 4.5)).unwrap();
    assert_eq!((imported.report.objects, imported.report.triangles, imported.report.textures), (2, 4, 1));
    assert!(imported.report.warnings.is_empty(), "{:?}", imported.report.warnings);
    let [painted, plain] = &imported.objects[..] else { panic!() };
    assert_eq!((painted.name.as_str(), plain.name.as_str()), ("a", "b"));
    assert_eq!(corners(&painted.mesh, 0)[2], [835_604.0, 817_800.0, 6.5]);
    // v = 0 is the bottom row in 3DS and the top row here: the wall's foot has v = 1.
    assert_eq!(painted.mesh.uvs, [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    assert_eq!(texture(&painted.mesh).labels.values(), [0, 1, 2, 255]);
    assert!(plain.mesh.uvs.is_empty());
    assert_eq!(class_at_middle(&plain.mesh, 0), STONE);
    assert_eq!(class_at_middle(&plain.mesh, 1), GLASS);
}

#[test]
fn the_texture_is_painted_the_right_way_up() {
    // Above the wall's lower left corner lies the image's lower left texel: metal.
    let folder = folder_with_labels();
    let imported = import_in(folder.path(), &two_walls(), &origin(0.0, 0.0, 0.0)).unwrap();
    let mesh = &imported.objects[0].mesh;
    let foot = mesh.vertices.iter().position(|&vertex| mesh.point(vertex) == GridPoint::new(0.0, 0.0, 0.0)).unwrap();
    let [u, v] = mesh.uvs[foot];
    let labels = &texture(mesh).labels;
    let row = ((v * 2.0).floor() as u32).min(1);
    assert_eq!(ClassId(labels.at((u * 2.0).floor() as u32, row)), METAL);
}

#[test]
fn up_and_rotation_come_before_the_origin() {
    let bytes = file(&[&wall("a", &[("stone", &[0, 1])], &[])]);
    let mut options = origin(100.0, 200.0, 10.0);
    options.rotate_deg = 90.0;
    let mesh = &import(&bytes, &options).unwrap().objects[0].mesh;
    // 4 m east turned clockwise by 90° is 4 m south.
    assert_eq!(corners(mesh, 0)[1], [100.0, 196.0, 10.0]);
    options.rotate_deg = 0.0;
    options.up = Some(Up::Y);
    // The file's z is south now.
    let mesh = &import(&bytes, &options).unwrap().objects[0].mesh;
    assert_eq!(corners(mesh, 0)[2], [104.0, 198.0, 10.0]);
    options.rotate_deg = f64::NAN;
    assert!(matches!(import(&bytes, &options), Err(ImportError::Option { .. })));
}

#[test]
fn all_names_without_a_class_are_listed_once() {
    let bytes = file(&[
        &material("never used", &[]),
        &wall("a", &[("wndow", &[0]), ("door", &[1])], &[]),
        &wall("b", &[("wndow", &[0])], &[]),
    ]);
    let error = import(&bytes, &ImportOptions::default()).unwrap_err();
    let ImportError::UnmappedNames { names, .. } = &error else { panic!("{error}") };
    assert_eq!(names[..], ["(no material)", "door", "wndow"]);
    assert!(error.to_string().contains("--map-classes"), "{error}");

    let map = "wndow = \"glass\"\n\"(no material)\" = \"stone\"\ndefault = \"metal\"";
    let options = ImportOptions { class_map: class_map(map), ..ImportOptions::default() };
    let objects = import(&bytes, &options).unwrap().objects;
    assert_eq!([class_at_middle(&objects[0].mesh, 0), class_at_middle(&objects[0].mesh, 1)], [GLASS, METAL]);
    assert_eq!([class_at_middle(&objects[1].mesh, 0), class_at_middle(&objects[1].mesh, 1)], [GLASS, STONE]);
}

#[test]
fn an_entry_of_the_class_map_goes_before_a_texture_and_the_default_does_not() {
    let options = ImportOptions { class_map: class_map("painted = \"metal\""), ..ImportOptions::default() };
    let imported = import(&two_walls(), &options).unwrap();
    assert_eq!(class_at_middle(&imported.objects[0].mesh, 0), METAL);
    let options = ImportOptions { class_map: class_map("default = \"metal\""), ..ImportOptions::default() };
    let folder = folder_with_labels();
    let imported = import_in(folder.path(), &two_walls(), &options).unwrap();
    assert_eq!(imported.report.textures, 1);
}

#[test]
fn a_missing_or_foreign_texture_is_named_with_its_material() {
    let error = import(&two_walls(), &ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("LABELS.PNG") && error.contains("\"painted\"") && error.contains("no such file"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("labels.png"), b"GIF89a").unwrap();
    let error = import_in(folder.path(), &two_walls(), &ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("expected a PNG or JPG"), "{error}");
}

#[test]
fn the_tiling_of_a_texture_map_is_kept_and_a_moved_map_is_refused() {
    let folder = folder_with_labels();
    let import_with = |more: &[u8]| {
        let bytes =
            file(&[&material("painted", &texture_map("labels.png", more)), &wall("a", &[("painted", &[0, 1])], &[])]);
        import_in(folder.path(), &bytes, &ImportOptions::default())
    };
    for (bits, wrap) in [(0u16, Wrap::Repeat), (0x02, Wrap::Mirror), (0x10, Wrap::Clamp)] {
        let imported = import_with(&chunk(0xA351, &[&bits.to_le_bytes()])).unwrap();
        let texture = texture(&imported.objects[0].mesh);
        assert_eq!((texture.wrap_u, texture.wrap_v), (wrap, wrap));
    }
    assert!(import_with(&chunk(0xA354, &[&floats(&[1.0])])).is_ok());
    let error = import_with(&chunk(0xA35A, &[&floats(&[0.25])])).unwrap_err().to_string();
    assert!(error.contains("\"labels.png\": the texture map is scaled, shifted or turned"), "{error}");
}

#[test]
fn an_object_with_mirrored_local_axes_is_turned_back_as_lib3ds_does() {
    // Local axes −x, y, z around (1, 0, 0): x becomes 2 − x.
    let axes = chunk(0x4160, &[&floats(&[-1., 0., 0., 0., 1., 0., 0., 0., 1., 1., 0., 0.])]);
    let bytes = file(&[&wall("a", &[("stone", &[0, 1])], &axes)]);
    let mesh = &import(&bytes, &origin(0.0, 0.0, 0.0)).unwrap().objects[0].mesh;
    assert_eq!(corners(mesh, 0), [[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0], [-2.0, 0.0, 2.0]]);
    // A right-handed matrix moves nothing: vertices are in world space.
    let axes = chunk(0x4160, &[&floats(&[0., 1., 0., -1., 0., 0., 0., 0., 1., 9., 9., 9.])]);
    let bytes = file(&[&wall("a", &[("stone", &[0, 1])], &axes)]);
    let mesh = &import(&bytes, &origin(0.0, 0.0, 0.0)).unwrap().objects[0].mesh;
    assert_eq!(corners(mesh, 0), [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 0.0, 2.0]]);
}

/// An object of stone with these vertices and faces.
fn object(points: &[[f32; 3]], faces: &[[u16; 3]]) -> Vec<u8> {
    let corners: Vec<u16> = faces.iter().flat_map(|&[a, b, c]| [a, b, c, 0]).collect();
    let all: Vec<u16> = (0..faces.len() as u16).collect();
    let stone = chunk(0x4130, &[&text("stone"), &words(&[all.len() as u16]), &words(&all)]);
    let mesh = chunk(
        0x4100,
        &[
            &chunk(0x4110, &[&words(&[points.len() as u16]), &floats(points.as_flattened())]),
            &chunk(0x4120, &[&words(&[faces.len() as u16]), &words(&corners), &stone]),
        ],
    );
    chunk(0x4000, &[&text("thing"), &mesh])
}

#[test]
fn faces_without_area_and_objects_without_faces_are_counted_and_left_out() {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0]];
    let bytes = file(&[
        &object(&points, &[[0, 1, 2], [0, 1, 1], [0, 1, 3]]),
        &object(&points, &[]),
        &object(&points, &[[1, 1, 2]]),
    ]);
    let imported = import(&bytes, &origin(1.0, 1.0, 1.0)).unwrap();
    let report = &imported.report;
    assert_eq!((report.objects, report.triangles, report.degenerate_faces, report.empty_objects), (1, 1, 3, 2));
    // Vertices that no face needs go, too, even one that is not a number.
    assert_eq!(imported.objects[0].mesh.vertices.len(), 3);
    let error = import(&file(&[&object(&points, &[[1, 1, 2]])]), &ImportOptions::default()).unwrap_err();
    assert!(error.to_string().contains("no triangles to import (1 empty objects, 1 faces of no area"), "{error}");
}

#[test]
fn impossible_geometry_is_refused_with_its_place() {
    let good = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let with =
        |points: &[[f32; 3]], face| import(&file(&[&object(points, &[face])]), &ImportOptions::default()).unwrap_err();
    assert!(matches!(with(&good, [0, 1, 3]), ImportError::VertexIndex { face: 0, index: 3, vertices: 3, .. }));
    let mut bad = good;
    bad[1][2] = f32::INFINITY;
    assert!(matches!(with(&bad, [0, 1, 2]), ImportError::Coordinate { vertex: 1, .. }));
    bad[1][2] = 5000.0;
    let error = with(&bad, [0, 1, 2]).to_string();
    assert!(error.contains("\"thing\" is 1 × 1 × 5000 m") && error.contains("4096 m"), "{error}");
}

#[test]
fn far_objects_have_near_origins() {
    let points = [[-3000.25, 0.0, 0.0], [-2999.25, 0.0, 0.0], [-3000.25, 1.0, 0.0]];
    let more = points.map(|[x, y, z]| [x + 6000.0, y, z]);
    let faces = [[0, 1, 2]];
    let imported = import(&file(&[&object(&points, &faces), &object(&more, &faces)]), &origin(8e5, 8e5, 0.0)).unwrap();
    for object in &imported.objects {
        assert!(object.mesh.vertices.as_flattened().iter().all(|value| value.abs() <= 1.5), "{:?}", object.mesh);
    }
    assert_eq!(corners(&imported.objects[0].mesh, 0)[0], [796_999.75, 8e5, 0.0]);
}

#[test]
fn a_file_without_a_place_and_one_with_coarse_coordinates_are_warned_about() {
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let warnings = |shift: f32| {
        let points = points.map(|[x, y, z]| [x + shift, y + shift, z]);
        import(&file(&[&object(&points, &[[0, 1, 2]])]), &ImportOptions::default()).unwrap().report.warnings
    };
    assert!(warnings(0.0)[0].contains("--origin"));
    // At 836 694 m the f32 step is 62.5 mm (conventions.md).
    assert!(warnings(836_694.0)[0].contains("steps of 62.5 mm"), "{:?}", warnings(836_694.0));
}

#[test]
fn a_chunk_that_is_cut_off_names_its_byte() {
    let bytes = two_walls();
    let error = import(&bytes[..bytes.len() - 1], &ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("at byte 0") && error.contains("chunk 0x4d4d"), "{error}");
    let inner = file(&[&chunk(0x4000, &[b"a\0", &0x4100u16.to_le_bytes(), &1000u32.to_le_bytes()])]);
    let error = import(&inner, &ImportOptions::default()).unwrap_err().to_string();
    assert!(error.contains("at byte 30") && error.contains("found 1000 in chunk 0x4100"), "{error}");
}
