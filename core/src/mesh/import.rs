//! Import of a model file: which format, which axes, which classes, and what was left out.

use super::assemble::{Assembled, assemble};
use super::axes::Placement;
use super::classify::Classifying;
use super::import_3ds::{is_3ds, read_3ds};
use super::import_gltf::read_gltf;
use super::model::Model;
use super::neighbours::{Neighbours, read_file};
use super::{ClassMap, ImportError, Object, Up};
use crate::image::LabelReading;
use resurvey_schema::{ClassTable, GridPoint};
use std::path::Path;

/// How a model file is read; the default takes the format's own axes.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    /// Where the file's zero lies. `None`: where the file itself says (our own glTF exports do), else at grid zero.
    pub origin: Option<GridPoint>,
    /// The axis that points up. `None`: y for glTF, z for 3DS.
    pub up: Option<Up>,
    /// Turn about the up axis before the origin is added, degrees, clockwise as seen from above like a yaw.
    pub rotate_deg: f64,
    /// Classes of materials that are not named after a class; an entry here also goes before a texture.
    pub class_map: Option<ClassMap>,
    /// How label textures are read.
    pub labels: LabelReading,
}

/// What an import made of a model file.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The objects in the order of the file; none is empty.
    pub objects: Vec<Object>,
    /// What was read and what was left out.
    pub report: ImportReport,
}

/// What an import read and left out.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportReport {
    /// `3DS` or `glTF`.
    pub format: &'static str,
    /// Where the file's zero was laid.
    pub origin: GridPoint,
    /// Objects imported.
    pub objects: usize,
    /// Triangles imported.
    pub triangles: usize,
    /// Label textures, counted once for each object that has them.
    pub textures: usize,
    /// Faces of no area, left out.
    pub degenerate_faces: usize,
    /// Objects without a face, left out.
    pub empty_objects: usize,
    /// Points and lines, left out.
    pub skipped_primitives: usize,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// A plan position this near to grid zero is no position in a survey grid, metres.
const UNPLACED_M: f64 = 10_000.0;

/// The objects of the model file at `path`, whose format is told by its content. Textures and buffers are looked for
/// beside it.
pub fn import_model(path: &Path, options: &ImportOptions, classes: &ClassTable) -> Result<Imported, ImportError> {
    let bytes = read_file(path)?;
    let neighbours = Neighbours::of(path);
    let model = read_model(&bytes, &neighbours)?;
    drop(bytes);
    let origin = options.origin.or(model.grid_origin).unwrap_or(GridPoint::new(0.0, 0.0, 0.0));
    if !origin.is_finite() || !options.rotate_deg.is_finite() {
        return Err(ImportError::Option { found: format!("origin {origin:?}, rotation {}°", options.rotate_deg) });
    }
    let no_map = ClassMap::default();
    let class_map = options.class_map.as_ref().unwrap_or(&no_map);
    let classifying = Classifying { classes, class_map, reading: options.labels, neighbours: &neighbours };
    let surfaces = classifying.surfaces(&model)?;
    let report = ImportReport {
        format: model.format,
        origin,
        objects: 0,
        triangles: 0,
        textures: 0,
        degenerate_faces: 0,
        empty_objects: 0,
        skipped_primitives: model.skipped_primitives,
        warnings: model.warnings.clone(),
    };
    let is_placed = options.origin.is_some() || model.grid_origin.is_some();
    let placement = Placement::new(options.up.unwrap_or(model.up), options.rotate_deg);
    let assembled = assemble(model, &surfaces, &placement, origin)?;
    finish(assembled, report, is_placed)
}

fn finish(assembled: Assembled, mut report: ImportReport, is_placed: bool) -> Result<Imported, ImportError> {
    report.objects = assembled.objects.len();
    report.triangles = assembled.triangles;
    report.textures = assembled.textures;
    report.degenerate_faces = assembled.degenerate_faces;
    report.empty_objects = assembled.empty_objects;
    if assembled.objects.is_empty() {
        return Err(ImportError::Nothing(format!(
            "{} empty objects, {} faces of no area, {} points or lines",
            report.empty_objects, report.degenerate_faces, report.skipped_primitives
        )));
    }
    let is_near_zero = |object: &Object| {
        let origin = object.mesh.origin;
        origin.easting_m.hypot(origin.northing_m) < UNPLACED_M
    };
    if !is_placed && assembled.objects.iter().all(is_near_zero) {
        report
            .warnings
            .push("the file does not say where it lies: it was laid at grid 0, 0, 0; give --origin".to_owned());
    }
    Ok(Imported { objects: assembled.objects, report })
}

fn read_model(bytes: &[u8], neighbours: &Neighbours) -> Result<Model, ImportError> {
    let unsupported = |format| Err(ImportError::UnsupportedFormat { format });
    let unknown = |found: &str| Err(ImportError::UnknownFormat { found: found.to_owned() });
    let start = &bytes[..bytes.len().min(4096)];
    let text = String::from_utf8_lossy(start);
    let text = text.trim_start_matches('\u{feff}').trim_start();
    let is_obj_line =
        |line: &str| ["v ", "vt ", "vn ", "mtllib ", "o ", "g "].iter().any(|word| line.starts_with(word));
    match text {
        _ if bytes.starts_with(b"glTF") => read_gltf(bytes, neighbours),
        _ if is_3ds(bytes) => read_3ds(bytes),
        "" => unknown("an empty file"),
        _ if text.starts_with('{') && contains(bytes, "\"asset\"") => read_gltf(bytes, neighbours),
        _ if text.starts_with('{') && contains(bytes, "\"CityJSON") => unsupported("CityJSON"),
        _ if text.starts_with('{') => unknown("JSON without the \"asset\" of glTF"),
        _ if text.starts_with('<') && text.to_lowercase().contains("citygml") => unsupported("CityGML"),
        _ if text.starts_with("solid ") => unsupported("STL"),
        _ if text.starts_with("ply\n") || text.starts_with("ply\r") => unsupported("PLY"),
        _ if text.starts_with("Kaydara FBX") => unsupported("FBX"),
        _ if text.starts_with("PK") => unsupported("ZIP"),
        _ if text.starts_with("SQLite format 3") => unsupported("SQLite"),
        _ if text.lines().any(is_obj_line) => unsupported("OBJ"),
        _ => {
            let start: Vec<String> = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            unknown(&format!("content that begins with bytes {}", start.join(" ")))
        }
    }
}

fn contains(bytes: &[u8], word: &str) -> bool {
    bytes.windows(word.len()).any(|window| window == word.as_bytes())
}
