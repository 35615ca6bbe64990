//! Import, scene and renderer against the generator's own ray caster: the model goes to disk as 3DS and GLB, comes back
//! through the product, and is drawn from the true pose. Nothing is shared between the two but the conventions.

#[path = "../examples/synthetic/mod.rs"]
mod synthetic;

use resurvey_core::camera::Camera;
use resurvey_core::mesh::{ImportOptions, Imported, Object, import_model};
use resurvey_core::render::{Scene as RenderScene, view};
use resurvey_schema::{ClassTable, GridPoint, Pose};
use std::path::Path;
use synthetic::{Case, CaseSpec, ChangeKind, NoiseLevel, Scene, SceneKind, write_map};

/// Share of pixels at which two views of the same world may differ: single pixels on the edges of faces and texels.
const EDGE_SHARE: f64 = 2e-4;

fn imported(scene: &Scene, folder: &Path, suffix: &str) -> Imported {
    let options = ImportOptions { origin: Some(scene.origin.into()), ..ImportOptions::default() };
    let path = folder.join(format!("{}.{suffix}", scene.name()));
    import_model(&path, &options, &ClassTable::default()).expect("the generated model is importable")
}

fn photo(scene: &Scene, seed: u64) -> Case {
    let spec = CaseSpec {
        name: "photo".to_owned(),
        change: ChangeKind::None,
        noise: NoiseLevel::IDEAL,
        seed,
        grid_prior: true,
    };
    Case::new(scene, spec).expect("any pose shows nothing new")
}

fn share_of_difference(case: &Case, objects: &[Object]) -> f64 {
    let numbered: Vec<_> = objects.iter().enumerate().map(|(index, object)| (index as u64, object)).collect();
    let [e, n, h] = case.truth.position;
    let position = GridPoint::new(e, n, h);
    let [yaw_rad, pitch_rad, roll_rad] = case.truth.attitude_deg.map(f64::to_radians);
    let world = RenderScene::new(position, &numbered, &[], &ClassTable::default());
    let camera = Camera::from_file(&case.capture.camera).expect("the camera of a capture");
    let drawn = view(&world, &camera, &Pose { position, yaw_rad, pitch_rad, roll_rad });
    let different = case.labels.iter().zip(drawn.labels.values()).filter(|(photo, drawn)| photo != drawn).count();
    different as f64 / case.labels.len() as f64
}

#[test]
fn the_map_drawn_at_the_true_pose_is_the_photo() {
    let folder = tempfile::tempdir().unwrap();
    for kind in SceneKind::ALL {
        let scene = Scene::new(kind, 2);
        let files = write_map(&scene, folder.path()).unwrap();
        let models = ["3ds", "glb"].map(|suffix| (suffix, imported(&scene, &files, suffix).objects));
        for seed in 0..3 {
            let case = photo(&scene, seed);
            for (suffix, objects) in &models {
                let share = share_of_difference(&case, objects);
                assert!(share < EDGE_SHARE, "{kind:?} {seed} {suffix}: {share:.6} of the pixels differ");
            }
        }
    }
}

#[test]
fn an_import_counts_the_triangles_that_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::new(SceneKind::Street, 2);
    let files = write_map(&scene, folder.path()).unwrap();
    let written: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(files.join("map.json")).unwrap()).unwrap();
    for suffix in ["3ds", "glb"] {
        assert_eq!(imported(&scene, &files, suffix).report.triangles, written["triangles"], "{suffix}");
    }
}
