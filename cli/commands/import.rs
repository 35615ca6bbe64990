//! `resurvey import`.

use super::crs_of;
use crate::args::{Import, UpAxis};
use crate::console::Console;
use crate::document;
use crate::failure::Failure;
use crate::plain::plain;
use crate::request::Request;
use jiff::Timestamp;
use resurvey_core::crs::{Crs, LocalOrigin};
use resurvey_core::image::LabelReading;
use resurvey_core::mesh::{ClassMap, ImportOptions, ImportReport, Imported, Object, Up, encode_mesh, import_model};
use resurvey_core::store::{History, Made, MapFile};
use resurvey_core::version::{BoxMm, Digest, FeatureState, UpdateTransaction, VersionKind};
use resurvey_schema::{ClassTable, GridPoint};
use serde_json::json;

/// Distance of black from white, √3 · 255, rounded up.
const FARTHEST_COLOUR: f64 = 442.0;

/// Adds the objects of all files as one version.
pub fn run(options: &Import, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open(&options.map)?;
    let key = options.retry.idempotency_key.as_deref();
    let request = key.map(|_| request(options)).transpose()?;
    let repeated = map.repeated(key, (VersionKind::Import, request))?;
    let head = map.head()?;
    // Of a retry the report is that of the first time, so the classes are.
    let snapshot = match repeated.map(|made| map.snapshot(made)) {
        Some(Ok(then)) => then,
        _ => map.snapshot(head)?,
    };
    let crs = crs_of(&map)?;
    let how = import_options(options, snapshot.classes())?;
    let message = options.message.clone().unwrap_or_else(|| {
        let names: Vec<String> = options.files.iter().map(|file| file.display().to_string()).collect();
        format!("import {}", names.join(", "))
    });
    let mut transaction = UpdateTransaction::new(head, VersionKind::Import, &options.author, message);
    transaction.observed_at = options.observed_at;
    transaction.idempotency_key = key.map(ToOwned::to_owned);
    transaction.request = request;
    let mut reports = Vec::new();
    let stage = console.stage("import");
    for file in &options.files {
        let mut imported =
            import_model(file, &how, snapshot.classes()).map_err(|error| Failure::from(error).about(file))?;
        if let Some(source) = &options.crs {
            move_between(&mut imported, crs, source.parse()?)?;
        }
        for object in &imported.objects {
            add_object(&mut transaction, object).map_err(|failure| failure.about(file))?;
        }
        reports.push((file.display().to_string(), imported.report));
    }
    let made = map.commit_once(&transaction, Timestamp::now())?;
    console.finish(&stage);
    console.did(format_args!("version {} was committed", made.version));
    print(made, &reports, console)
}

/// Prints what was read of each file, and the version.
fn print(made: Made, reports: &[(String, ImportReport)], console: &mut Console<'_>) -> Result<u8, Failure> {
    let version = made.version;
    for (file, report) in reports {
        for warning in &report.warnings {
            console.message(&plain(&format!("warning: {file}: {warning}")));
        }
    }
    if console.is_json() {
        let files: Vec<_> = reports
            .iter()
            .map(|(file, report)| {
                json!({
                    "file": file, "format": report.format, "origin": report.origin, "objects": report.objects,
                    "triangles": report.triangles, "textures": report.textures,
                    "degenerate_faces": report.degenerate_faces, "empty_objects": report.empty_objects,
                    "skipped_primitives": report.skipped_primitives, "warnings": report.warnings,
                })
            })
            .collect();
        let mut document = json!({ "version": version.0, "files": files });
        document::say_repeated(&mut document, made.repeated);
        console.document(&document)?;
    } else {
        for (file, report) in reports {
            let (objects, triangles, textures) = (report.objects, report.triangles, report.textures);
            console.line(format_args!(
                "{file}: {} with {objects} objects, {triangles} triangles, {textures} label textures",
                report.format
            ))?;
        }
        console.line(format_args!("version {version}"))?;
    }
    Ok(0)
}

/// The models, and how they are read.
fn request(options: &Import) -> Result<Digest, Failure> {
    let mut request = Request::of("import");
    for file in &options.files {
        request = request.with_file("file", Some(file))?;
    }
    let up = options.up.map(|up| match up {
        UpAxis::Y => "y",
        UpAxis::Z => "z",
    });
    let request = request
        .with_numbers("origin", options.origin.as_ref().map(<[f64; 3]>::as_slice))
        .with("crs", options.crs.as_ref())
        .with("up", up)
        .with("rotate", Some(options.rotate))
        .with_file("map-classes", options.map_classes.as_deref())?
        .with("nearest-colour", options.nearest_colour)
        .with("void-index", options.void_index)
        .with("observed-at", options.observed_at);
    Ok(request.digest())
}

fn import_options(options: &Import, classes: &ClassTable) -> Result<ImportOptions, Failure> {
    let class_map = options.map_classes.as_deref().map(|path| {
        let text =
            std::fs::read_to_string(path).map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
        ClassMap::parse(&text, classes).map_err(|error| Failure::input(format!("{}: {error}", path.display())))
    });
    if let Some(distance) = options.nearest_colour
        && !(0.0..=FARTHEST_COLOUR).contains(&distance)
    {
        return Err(Failure::usage(format!("--nearest-colour {distance}: expected 0 to 441")));
    }
    if !options.rotate.is_finite() {
        return Err(Failure::usage(format!("--rotate {}: expected degrees", options.rotate)));
    }
    Ok(ImportOptions {
        origin: options.origin.map(GridPoint::from),
        up: options.up.map(|up| match up {
            UpAxis::Y => Up::Y,
            UpAxis::Z => Up::Z,
        }),
        rotate_deg: options.rotate,
        class_map: class_map.transpose()?,
        labels: LabelReading { void_index: options.void_index, nearest_colour: options.nearest_colour },
    })
}

/// Moves objects whose coordinates are those of `source` into the map's grid, vertex by vertex: grids differ in scale and
/// in where their north is.
fn move_between(imported: &mut Imported, crs: Crs, source: Crs) -> Result<(), Failure> {
    for Object { name, mesh } in &mut imported.objects {
        let moved = |point| crs.grid_from_other(source, point);
        let failed = |error| Failure::input(format!("object {name:?}: {error}"));
        let GridPoint { easting_m, northing_m, height_m } = moved(mesh.origin).map_err(failed)?;
        let origin = GridPoint::new(easting_m.round(), northing_m.round(), height_m.round());
        let local = LocalOrigin::new(origin).map_err(failed)?;
        let vertices = mesh.vertices.iter().map(|vertex| local.to_local(moved(mesh.point(*vertex))?));
        mesh.vertices = vertices.collect::<Result<_, _>>().map_err(failed)?;
        mesh.origin = origin;
    }
    Ok(())
}

/// Adds `object` to what `transaction` brings.
pub(super) fn add_object(transaction: &mut UpdateTransaction, object: &Object) -> Result<(), Failure> {
    let (low, high) = object.mesh.bounds();
    let bounds = BoxMm::new(low, high).map_err(Failure::input)?;
    let geometry = transaction.add_geometry(encode_mesh(&object.mesh));
    transaction.additions.push(FeatureState::Object { name: object.name.clone(), geometry, bounds });
    Ok(())
}
