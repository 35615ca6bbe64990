//! Real files from other tools: assimp's 3DS samples and a glTF house and tree.

use super::*;
use crate::image::LabelReading;

fn import_shared(name: &str, options: &ImportOptions) -> Option<Result<Imported, ImportError>> {
    Some(import_model(&shared(name)?, options, &ClassTable::default()))
}

fn lossy() -> ImportOptions {
    let labels = LabelReading { nearest_colour: Some(442.0), ..LabelReading::default() };
    ImportOptions { labels, ..origin(0.0, 0.0, 0.0) }
}

#[test]
fn all_objects_faces_and_texture_coordinates_of_test1_are_read() {
    let Some(imported) = import_shared("data/3ds/test1.3ds", &lossy()) else { return };
    let Imported { objects, report } = imported.unwrap();
    // The source has 9 objects, 108 faces, 288 texture coordinates; texture names differ in case from the files.
    assert_eq!((report.objects, report.triangles, report.degenerate_faces), (9, 108, 0));
    assert_eq!(objects.iter().map(|object| object.mesh.uvs.len()).sum::<usize>(), 288);
    assert_eq!(report.textures, 9);
}

#[test]
fn photos_as_textures_are_refused_with_both_ways_out() {
    let Some(imported) = import_shared("data/3ds/test1.3ds", &ImportOptions::default()) else { return };
    let error = imported.unwrap_err().to_string();
    assert!(error.contains("IMAGE1.JPG") && error.contains("CWALL02.JPG") && error.contains("IMAGE2.JPG"), "{error}");
    assert!(error.contains("--nearest-colour") && error.contains("--map-classes"), "{error}");
    let map = "\"1 - Default\" = \"stone\"\n\"2 - default\" = \"glass\"\n\"3 - Default\" = \"metal\"";
    let options = ImportOptions { class_map: class_map(map), ..ImportOptions::default() };
    let imported = import_shared("data/3ds/test1.3ds", &options).unwrap().unwrap();
    assert_eq!((imported.report.textures, imported.report.triangles), (0, 108));
}

#[test]
fn the_other_3ds_files_read_or_say_why_not() {
    let Some(cube) = import_shared("data/3ds/cube_with_diffuse_texture.3DS", &lossy()) else { return };
    let cube = cube.unwrap();
    assert_eq!((cube.report.objects, cube.report.triangles, cube.report.textures), (1, 12, 1));
    let fels = import_shared("data/3ds/fels.3ds", &ImportOptions::default()).unwrap().unwrap_err();
    assert!(fels.to_string().contains("\"Default\""), "{fels}");
    let options = ImportOptions { class_map: class_map("default = \"foliage\""), ..ImportOptions::default() };
    let fels = import_shared("data/3ds/fels.3ds", &options).unwrap().unwrap();
    // The face chunk at byte 5622 holds 768 faces.
    assert_eq!(fels.report.triangles + fels.report.degenerate_faces, 768);
    let empty = import_shared("data/3ds/empty.3ds", &ImportOptions::default()).unwrap().unwrap_err();
    assert!(empty.to_string().contains("an empty file"), "{empty}");
}

#[test]
fn the_house_lists_its_five_materials() {
    let Some(house) = import_shared("data/gltf/house-4-2.glb", &ImportOptions::default()) else { return };
    let ImportError::UnmappedNames { names, .. } = house.unwrap_err() else { panic!() };
    assert_eq!(names[..], ["border", "door", "main", "roof", "wndow"]);
}

#[test]
fn the_tree_has_a_picture_and_no_labels() {
    let Some(tree) = import_shared("data/gltf/tree-beech-1-0.glb", &ImportOptions::default()) else { return };
    let error = tree.unwrap_err().to_string();
    assert!(
        error.contains("color-atlas-gradient") && error.contains("\"color_main\"") && error.contains("pixel ("),
        "{error}"
    );
    let tree = import_shared("data/gltf/tree-beech-1-0.glb", &lossy()).unwrap().unwrap();
    // 498 indices in the accessor.
    assert_eq!(tree.report.triangles + tree.report.degenerate_faces, 166);
}

/// Corners of all triangles as the `gltf` crate reads them, x east, y up, z south.
fn second_opinion(path: &Path) -> Vec<[f64; 3]> {
    let gltf = gltf::Gltf::open(path).unwrap();
    let blob = gltf.blob.as_deref().unwrap();
    let mut corners = Vec::new();
    for node in gltf.nodes() {
        let matrix = nalgebra::Matrix4::from(node.transform().matrix()).cast::<f64>();
        for primitive in node.mesh().unwrap().primitives() {
            let reader = primitive.reader(|_| Some(blob));
            let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
            for index in reader.read_indices().unwrap().into_u32() {
                let point = nalgebra::Point3::from(positions[index as usize]).cast::<f64>();
                corners.push(matrix.transform_point(&point).coords.into());
            }
        }
    }
    corners
}

#[test]
fn geometry_is_what_another_gltf_reader_finds() {
    let mut options = origin(1000.0, 2000.0, 3000.0);
    options.class_map = class_map("default = \"stone\"\ncolor_main = \"foliage\"");
    for name in ["data/gltf/house-4-2.glb", "data/gltf/tree-beech-1-0.glb", "cases/maps/street/street.glb"] {
        let Some(path) = shared(name) else { return };
        let imported = import_model(&path, &options, &ClassTable::default()).unwrap();
        let found = imported
            .objects
            .iter()
            .flat_map(|object| (0..object.mesh.triangles.len()).map(|index| corners(&object.mesh, index)));
        let found: Vec<[f64; 3]> = found.flatten().collect();
        let expected = second_opinion(&path);
        assert_eq!(found.len() + 3 * imported.report.degenerate_faces, expected.len());
        if imported.report.degenerate_faces == 0 {
            for (found, [x, y, z]) in found.iter().zip(expected) {
                let apart =
                    nalgebra::Vector3::from(*found) - nalgebra::Vector3::new(1000.0 + x, 2000.0 - z, 3000.0 + y);
                assert!(apart.norm() < 1e-4, "{name}: {found:?}");
            }
        }
    }
}
