//! Import through the public door: small files built here, the shared maps, foreign files, and damage.

mod damage;
mod encoding;
mod foreign;
mod gltf_files;
mod shared_maps;
mod three_ds_files;

use super::*;
use crate::image::{Raster, write_label_png};
use resurvey_schema::{ClassId, ClassTable, GridPoint};
use std::path::{Path, PathBuf};

const STONE: ClassId = ClassId(0);
const GLASS: ClassId = ClassId(1);
const METAL: ClassId = ClassId(2);

/// The folder of shared test files, or `None` with a note when it is missing.
fn shared(name: &str) -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared"));
    let path = std::env::var_os("RESURVEY_SHARED").map_or(beside, PathBuf::from).join(name);
    if !path.exists() {
        eprintln!("SKIPPED: {} is missing (set RESURVEY_SHARED)", path.display());
        return None;
    }
    Some(path)
}

/// Imports `bytes` as a file in `folder`.
fn import_in(folder: &Path, bytes: &[u8], options: &ImportOptions) -> Result<Imported, ImportError> {
    let path = folder.join("model.bin");
    std::fs::write(&path, bytes).unwrap();
    import_model(&path, options, &ClassTable::default())
}

/// Imports `bytes` as a file alone in its folder.
fn import(bytes: &[u8], options: &ImportOptions) -> Result<Imported, ImportError> {
    import_in(tempfile::tempdir().unwrap().path(), bytes, options)
}

/// A label image of 2×2 texels: stone and glass above, metal and void below.
fn four_labels() -> Vec<u8> {
    let labels = Raster::from_values(2, 2, vec![0, 1, 2, 255]).unwrap();
    write_label_png(&labels, &ClassTable::default()).unwrap()
}

/// The class at the middle of triangle `index`.
fn class_at_middle(mesh: &Mesh, index: usize) -> ClassId {
    class_at(mesh, index, [1.0 / 3.0; 3])
}

/// The class where the corners of triangle `index` weigh `weights`, with the texel rule of `conventions.md` written out
/// anew.
fn class_at(mesh: &Mesh, index: usize, weights: [f64; 3]) -> ClassId {
    let corners = mesh.triangles[index];
    match &mesh.surfaces[usize::from(mesh.triangle_surfaces[index])] {
        Surface::Class(class) => *class,
        Surface::Texture(texture) => {
            let mean = |axis: usize| -> f64 {
                corners
                    .iter()
                    .zip(weights)
                    .map(|(&corner, weight)| f64::from(mesh.uvs[corner as usize][axis]) * weight)
                    .sum()
            };
            let texel = |value: f64, wrap: Wrap, size: u32| {
                let value = match wrap {
                    Wrap::Repeat => value.rem_euclid(1.0),
                    Wrap::Clamp => value.clamp(0.0, 1.0),
                    Wrap::Mirror => 1.0 - (value.rem_euclid(2.0) - 1.0).abs(),
                };
                ((value * f64::from(size)).floor() as u32).min(size - 1)
            };
            let labels = &texture.labels;
            let column = texel(mean(0), texture.wrap_u, labels.width());
            ClassId(labels.at(column, texel(mean(1), texture.wrap_v, labels.height())))
        }
    }
}

/// Corners of triangle `index` in grid coordinates.
fn corners(mesh: &Mesh, index: usize) -> [[f64; 3]; 3] {
    mesh.triangles[index].map(|corner| mesh.point(mesh.vertices[corner as usize]).into())
}

fn origin(easting_m: f64, northing_m: f64, height_m: f64) -> ImportOptions {
    ImportOptions { origin: Some(GridPoint::new(easting_m, northing_m, height_m)), ..ImportOptions::default() }
}

fn class_map(text: &str) -> Option<ClassMap> {
    Some(ClassMap::parse(text, &ClassTable::default()).unwrap())
}
