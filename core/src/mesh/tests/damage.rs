//! Model files cut off at every byte, with flipped bytes, and random: an error or a mesh that keeps its promises.

use super::*;
use crate::image::LabelReading;

/// Imports what may be damaged; whatever comes out must be a valid mesh.
fn survive(folder: &Path, bytes: &[u8]) -> bool {
    let labels = LabelReading { nearest_colour: Some(442.0), ..LabelReading::default() };
    let options = ImportOptions { class_map: class_map("default = \"others\""), labels, ..ImportOptions::default() };
    match import_in(folder, bytes, &options) {
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
        Ok(imported) => {
            assert!(!imported.objects.is_empty());
            for object in &imported.objects {
                assert_eq!(decode_mesh(&encode_mesh(&object.mesh)).as_ref(), Ok(&object.mesh));
                assert!(!object.mesh.triangles.is_empty());
            }
            true
        }
    }
}

/// Cuts `bytes` off at every `step`th byte and flips up to four bytes, `flips` times.
fn torture(folder: &Path, bytes: &[u8], step: usize, flips: u64) {
    assert!(survive(folder, bytes));
    for length in (0..bytes.len()).step_by(step) {
        assert!(!survive(folder, &bytes[..length]), "{length} of {} bytes", bytes.len());
    }
    let mut seed = bytes.len() as u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize
    };
    for _ in 0..flips {
        let mut damaged = bytes.to_vec();
        for _ in 0..=next() % 4 {
            let position = next() % damaged.len();
            // Extremes break more than random values do.
            damaged[position] = [0x00, 0xFF, 0x7F, 0x80, next() as u8][next() % 5];
        }
        survive(folder, &damaged);
    }
}

#[test]
fn a_3ds_file_survives_damage() {
    let folder = three_ds_files::folder_with_labels();
    torture(folder.path(), &three_ds_files::two_walls(), 1, 3000);
}

#[test]
fn a_glb_file_survives_damage() {
    let (json, binary) = gltf_files::square();
    let folder = tempfile::tempdir().unwrap();
    torture(folder.path(), &gltf_files::glb(&json, &binary), 1, 3000);
}

#[test]
fn real_files_survive_damage() {
    let names = [
        "data/3ds/test1.3ds",
        "data/3ds/cube_with_diffuse_texture.3DS",
        "data/gltf/house-4-2.glb",
        "cases/maps/library/library.glb",
    ];
    for name in names {
        let Some(path) = shared(name) else { return };
        let folder = tempfile::tempdir().unwrap();
        for neighbour in std::fs::read_dir(path.parent().unwrap()).unwrap().map(|entry| entry.unwrap().path()) {
            if neighbour.extension().is_some_and(|suffix| ["png", "PNG"].iter().any(|&known| suffix == known)) {
                std::fs::copy(&neighbour, folder.path().join(neighbour.file_name().unwrap())).unwrap();
            }
        }
        // The photos of test1 are large: small label images stand in for them.
        for texture in ["IMAGE1.JPG", "IMAGE2.JPG", "CWALL02.JPG"] {
            std::fs::write(folder.path().join(texture), four_labels()).unwrap();
        }
        torture(folder.path(), &std::fs::read(path).unwrap(), 211, 200);
    }
}

#[test]
fn random_bytes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut seed = 7u64;
    for start in [&b""[..], b"MM", b"glTF", b"{\"asset\":"] {
        for length in 0..200 {
            let mut bytes = start.to_vec();
            bytes.extend((0..length).map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                (seed >> 40) as u8
            }));
            assert!(!survive(folder.path(), &bytes));
        }
    }
}
