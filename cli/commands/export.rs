//! `resurvey export`.

use super::{crs_of, write_file};
use crate::args::Export;
use crate::console::Console;
use crate::failure::{Failure, MAP};
use crate::region;
use resurvey_core::export::{ExportScene, glb, gltf};
use resurvey_core::mesh::{Object, decode_mesh};
use resurvey_core::store::MapFile;
use resurvey_core::version::FeatureState;
use resurvey_schema::Descriptor;
use serde_json::json;
use std::path::Path;

/// Writes a version or a region of it.
pub fn run(options: &Export, console: &mut Console<'_>) -> Result<u8, Failure> {
    let form = form(&options.out)?;
    let map = MapFile::open_read_only(&options.map)?;
    let snapshot = map.snapshot(map.resolve(&options.at)?)?;
    let features = match region::bbox(&options.region, crs_of(&map)?, false)? {
        Some(bounds) => snapshot.features_in(&bounds)?,
        None => snapshot.features()?,
    };
    let mut objects: Vec<(u64, Object)> = Vec::new();
    let mut descriptors: Vec<(u64, Descriptor)> = Vec::new();
    for feature in features {
        let fid = feature.fid.0;
        match feature.state {
            FeatureState::Descriptor(descriptor) => descriptors.push((fid, descriptor)),
            FeatureState::Object { name, geometry, .. } => {
                let mesh = decode_mesh(&snapshot.geometry(geometry)?)
                    .map_err(|error| Failure::new(MAP, anyhow::anyhow!("geometry of object {fid}: {error}")))?;
                objects.push((fid, Object { name, mesh }));
            }
        }
    }
    let frame = map.info()?.frame;
    let scene = ExportScene {
        version: snapshot.version().0,
        crs: &frame.crs,
        vertical_datum: &frame.vertical_datum,
        classes: snapshot.classes(),
        objects: objects.iter().map(|(fid, object)| (*fid, object)).collect(),
        descriptors: descriptors.iter().map(|(fid, descriptor)| (*fid, descriptor)).collect(),
    };
    let bytes = match form {
        Form::Glb => {
            let bytes = glb(&scene)?;
            write_file(&options.out, &bytes)?;
            bytes.len()
        }
        Form::Gltf => {
            let buffer = options.out.with_extension("bin");
            let name = buffer.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let files = gltf(&scene, &name)?;
            write_file(&buffer, &files.buffer)?;
            write_file(&options.out, &files.json)?;
            files.json.len() + files.buffer.len()
        }
    };
    let (version, out) = (snapshot.version().0, options.out.display());
    let (objects, descriptors) = (objects.len(), descriptors.len());
    if console.is_json() {
        console.document(&json!({
            "version": version, "file": out.to_string(), "bytes": bytes,
            "objects": objects, "descriptors": descriptors,
        }))?;
    } else {
        console.line(format_args!(
            "{out}: version {version}, {objects} objects, {descriptors} descriptors, {bytes} bytes"
        ))?;
    }
    Ok(0)
}

#[derive(Clone, Copy)]
enum Form {
    Glb,
    Gltf,
}

fn form(out: &Path) -> Result<Form, Failure> {
    match out.extension().and_then(|suffix| suffix.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("glb") => Ok(Form::Glb),
        Some("gltf") => Ok(Form::Gltf),
        _ => Err(Failure::usage(format!("{}: expected a file that ends in .glb or .gltf", out.display()))),
    }
}
