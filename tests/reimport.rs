//! An export comes back as it was: geometry, classes and place, without a flag.
#![allow(clippy::unwrap_used, reason = "a test's helpers may fail loudly")]

use resurvey_core::export::{ExportScene, glb};
use resurvey_core::image::LabelImage;
use resurvey_core::mesh::{ImportOptions, Imported, LabelTexture, Mesh, Object, Surface, Wrap, import_model};
use resurvey_schema::{ClassId, ClassTable, Descriptor, DynamicDescriptor, GridPoint};
use sha2::Digest;
use std::path::PathBuf;

/// The folder of shared test files, or `None` with a note when it is missing.
fn shared(name: &str) -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared"));
    let path = std::env::var_os("RESURVEY_SHARED").map_or(beside, PathBuf::from).join(name);
    if !path.exists() {
        eprintln!("SKIPPED: {} is missing (set RESURVEY_SHARED)", path.display());
        return None;
    }
    Some(path)
}

/// `objects` and `descriptors` exported and imported again with no option at all.
fn again(objects: &[Object], descriptors: &[Descriptor]) -> Imported {
    let classes = ClassTable::default();
    let scene = ExportScene {
        version: 1,
        crs: "EPSG:2326",
        vertical_datum: "hkpd",
        classes: &classes,
        objects: (1..).zip(objects).collect(),
        descriptors: (100..).zip(descriptors).collect(),
        marks: std::collections::BTreeMap::new(),
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("export.glb");
    std::fs::write(&path, glb(&scene).unwrap()).unwrap();
    import_model(&path, &ImportOptions::default(), &classes).unwrap()
}

/// Surface, corners and texture coordinates of a triangle.
type Face = (String, [[f64; 3]; 3], Vec<[f32; 2]>);

/// The faces of `mesh`, in an order of their own: an export groups faces by
/// surface.
fn faces(mesh: &Mesh) -> Vec<Face> {
    let surface = |surface: &Surface| match surface {
        Surface::Class(class) => format!("class {}", class.0),
        Surface::Texture(LabelTexture { name, labels, wrap_u, wrap_v }) => {
            let digest = sha2::Sha256::digest(labels.values());
            format!("{name} {wrap_u:?} {wrap_v:?} {} {digest:x}", labels.width())
        }
    };
    let surfaces: Vec<String> = mesh.surfaces.iter().map(surface).collect();
    let mut faces: Vec<_> = mesh
        .triangles
        .iter()
        .zip(&mesh.triangle_surfaces)
        .map(|(corners, &index)| {
            let is_textured = matches!(mesh.surfaces[usize::from(index)], Surface::Texture(_));
            let uvs = corners.iter().filter(|_| is_textured).map(|&corner| mesh.uvs[corner as usize]).collect();
            (
                surfaces[usize::from(index)].clone(),
                corners.map(|corner| mesh.point(mesh.vertices[corner as usize]).into()),
                uvs,
            )
        })
        .collect();
    faces.sort_by(|a, b| a.partial_cmp(b).unwrap());
    faces
}

fn assert_same(before: &[Object], after: &[Object]) {
    assert_eq!(before.len(), after.len());
    for (before, after) in before.iter().zip(after) {
        assert_eq!(before.name, after.name);
        let (before, after) = (faces(&before.mesh), faces(&after.mesh));
        assert_eq!(before.len(), after.len());
        for ((surface, corners, uvs), (other_surface, other_corners, other_uvs)) in before.iter().zip(&after) {
            assert_eq!((surface, uvs), (other_surface, other_uvs));
            for (a, b) in corners.iter().flatten().zip(other_corners.iter().flatten()) {
                // An f32 step at 400 m, twice: docs/export-gltf.md.
                assert!((a - b).abs() < 1e-4, "{a} became {b}");
            }
        }
    }
}

#[test]
fn a_wall_with_labels_comes_back_in_place_and_descriptors_stay_out() {
    let labels = LabelImage::from_values(2, 1, vec![1, 255]).unwrap();
    let texture = LabelTexture { name: "façade.png".into(), labels, wrap_u: Wrap::Mirror, wrap_v: Wrap::Clamp };
    let wall = Object {
        name: "wall".into(),
        mesh: Mesh {
            origin: GridPoint::new(836_694.0, 819_069.0, 4.0),
            vertices: vec![[0.05, 0.0, 0.0], [4.05, 0.0, 0.0], [4.05, 0.0, 2.5], [0.05, 3.0, 2.5]],
            uvs: vec![[0.0, 1.0], [1.5, 1.0], [1.5, -0.25], [0.0, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            triangle_surfaces: vec![0, 1],
            surfaces: vec![Surface::Texture(texture), Surface::Class(ClassId(2))],
        },
    };
    let chair = Descriptor::Dynamic(DynamicDescriptor {
        class: ClassId(5),
        position: GridPoint::new(836_700.0, 819_070.0, 4.0),
        size_m: [0.5, 0.5, 0.9],
        yaw_rad: None,
        sigma: None,
    });
    let imported = again(std::slice::from_ref(&wall), &[chair]);
    assert_same(std::slice::from_ref(&wall), &imported.objects);
    assert!(imported.report.warnings[0].contains("1 descriptors"), "{:?}", imported.report.warnings);
}

#[test]
fn the_shared_maps_come_back_in_place() {
    for scene in ["street", "library", "kowloon"] {
        let Some(folder) = shared(&format!("cases/maps/{scene}")) else { return };
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("map.json")).unwrap()).unwrap();
        let origin = serde_json::from_value::<GridPoint>(json["origin"].clone()).unwrap();
        let options = ImportOptions { origin: Some(origin), ..ImportOptions::default() };
        let path = folder.join(format!("{scene}.3ds"));
        let before = import_model(&path, &options, &ClassTable::default()).unwrap();
        let after = again(&before.objects, &[]);
        assert!(after.report.warnings.is_empty(), "{:?}", after.report.warnings);
        assert_eq!(before.report.triangles, after.report.triangles);
        assert_same(&before.objects, &after.objects);
    }
}
