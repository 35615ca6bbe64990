//! Reads the cases of `shared/cases`: just enough GLB for their maps, so that rendering is checked without the importer.
#![allow(dead_code, reason = "every test binary uses its own share")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a broken case is a failed test")]

use resurvey_core::camera::Camera;
use resurvey_core::image::LabelImage;
use resurvey_core::mesh::{LabelTexture, Mesh, Object, Surface, Wrap};
use resurvey_core::render::Scene;
use resurvey_schema::position::PoseFile;
use resurvey_schema::{CaptureFile, ClassId, ClassTable, GridPoint, Pose};
use std::path::{Path, PathBuf};

/// The folder of cases; `None`, and a line that says so, where there is none.
pub fn cases() -> Option<PathBuf> {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared"));
    let shared = std::env::var_os("RESURVEY_SHARED").map_or(beside, PathBuf::from);
    let cases = shared.join("cases");
    if !cases.is_dir() {
        eprintln!("skipped: no cases at {}; set RESURVEY_SHARED", cases.display());
        return None;
    }
    Some(cases)
}

/// Labels, camera and true pose of a case.
pub fn capture(case: &Path) -> (LabelImage, Camera, Pose) {
    let text = std::fs::read_to_string(case.join("capture.json")).unwrap();
    let capture: CaptureFile = serde_json::from_str(&text).unwrap();
    let truth: serde_json::Value = serde_json::from_slice(&std::fs::read(case.join("truth.json")).unwrap()).unwrap();
    let pose: PoseFile = serde_json::from_value(truth["pose"].clone()).unwrap();
    let png = std::fs::read(case.join(capture.labels.as_ref().unwrap())).unwrap();
    (labels(&png, &ClassTable::default()), Camera::from_file(&capture.camera).unwrap(), pose.into())
}

/// The objects of a map.
pub fn map(folder: &Path) -> (GridPoint, Vec<Object>) {
    let name = folder.file_name().unwrap().to_str().unwrap();
    let about: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("map.json")).unwrap()).unwrap();
    let origin: GridPoint = serde_json::from_value(about["origin"].clone()).unwrap();
    let glb = gltf::Gltf::from_slice(&std::fs::read(folder.join(format!("{name}.glb"))).unwrap()).unwrap();
    let blob = glb.blob.as_deref().unwrap();
    let objects = glb.nodes().filter_map(|node| object(&node, blob, origin)).collect();
    (origin, objects)
}

/// The scene of a map without descriptors.
pub fn scene(folder: &Path) -> (Scene, Vec<Object>) {
    let (origin, objects) = map(folder);
    let with_ids: Vec<(u64, &Object)> = objects.iter().enumerate().map(|(fid, object)| (fid as u64, object)).collect();
    (Scene::new(origin, &with_ids, &[], &ClassTable::default()), objects)
}

fn object(node: &gltf::Node, blob: &[u8], origin: GridPoint) -> Option<Object> {
    let primitive = node.mesh()?.primitives().next()?;
    let reader = primitive.reader(|_| Some(blob));
    let indices: Vec<u32> = reader.read_indices()?.into_u32().collect();
    let triangles: Vec<[u32; 3]> = indices.chunks_exact(3).map(|corner| [corner[0], corner[1], corner[2]]).collect();
    let material = primitive.material();
    let surface = match material.pbr_metallic_roughness().base_color_texture() {
        None => Surface::Class(ClassTable::default().by_name(material.name()?)?.index),
        Some(info) => {
            let gltf::image::Source::View { view, .. } = info.texture().source().source() else { return None };
            let png = &blob[view.offset()..view.offset() + view.length()];
            let labels = labels(png, &ClassTable::default());
            Surface::Texture(LabelTexture { name: String::new(), labels, wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat })
        }
    };
    // glTF is y up and z towards the viewer: E = x, N = −z, H = y.
    let vertices = reader.read_positions()?.map(|[x, y, z]| [x, -z, y]).collect();
    let uvs = reader.read_tex_coords(0).map(|uvs| uvs.into_f32().collect()).unwrap_or_default();
    let triangle_surfaces = vec![0; triangles.len()];
    let mesh = Mesh { origin, vertices, uvs, triangles, triangle_surfaces, surfaces: vec![surface] };
    Some(Object { name: node.name()?.to_owned(), mesh })
}

fn labels(png: &[u8], classes: &ClassTable) -> LabelImage {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    bytes.truncate(info.buffer_size());
    let values = match info.color_type {
        png::ColorType::Indexed | png::ColorType::Grayscale => unpacked(&bytes, &info),
        png::ColorType::Rgb | png::ColorType::Rgba => {
            let samples = info.color_type.samples();
            let class =
                |pixel: &[u8]| classes.by_colour([pixel[0], pixel[1], pixel[2]]).map_or(255, |class| class.index.0);
            bytes.chunks_exact(samples).map(class).collect()
        }
        other => panic!("a label image of {other:?}"),
    };
    LabelImage::from_values(info.width, info.height, values).unwrap()
}

/// One byte per pixel, whatever the bit depth.
fn unpacked(bytes: &[u8], info: &png::OutputInfo) -> Vec<u8> {
    let bits = info.bit_depth as usize;
    let at = |row: &[u8], u: usize| (row[u * bits / 8] >> (8 - bits - u * bits % 8)) & (0xFF >> (8 - bits)) as u8;
    bytes.chunks_exact(info.line_size).flat_map(|row| (0..info.width as usize).map(move |u| at(row, u))).collect()
}

/// Share of the pixels, void ones of `truth` left out, that differ.
pub fn disagreement(truth: &LabelImage, found: &LabelImage) -> (usize, usize) {
    let pairs = truth.values().iter().zip(found.values()).filter(|(truth, _)| **truth != ClassId::VOID.0);
    let compared = pairs.clone().count();
    (pairs.filter(|(truth, found)| truth != found).count(), compared)
}
