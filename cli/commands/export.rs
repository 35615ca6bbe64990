//! `resurvey export`.

use super::crs_of;
use crate::args::Export;
use crate::console::Console;
use crate::failure::{Failure, MAP};
use crate::out_file::{check_file, write_file, write_files};
use crate::region;
use resurvey_core::export::{ExportScene, Mark, glb, gltf};
use resurvey_core::mesh::{Object, decode_mesh};
use resurvey_core::store::{History, MapFile};
use resurvey_core::version::{BoxMm, Delta, FeatureState, VersionId};
use resurvey_schema::Descriptor;
use serde_json::json;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::Path;

/// Writes a version, what differs between two, or a region of either.
pub fn run(options: &Export, console: &mut Console<'_>) -> Result<u8, Failure> {
    let form = form(&options.out)?;
    check_file(&options.out)?;
    let map = MapFile::open_read_only(&options.map)?;
    let bounds = region::bbox(&options.region, crs_of(&map)?)?;
    let mut things = Things::default();
    let range = options.diff.as_deref().map(|range| map.resolve_range(range)).transpose()?;
    let version = match range {
        Some((from, to)) => things.add_difference(&map, (from, to), bounds.as_ref())?,
        None => things.add_version(&map, map.resolve(&options.at)?, bounds.as_ref())?,
    };
    let (snapshot, frame) = (map.snapshot(version)?, map.info()?.frame);
    let scene = ExportScene {
        version: version.0,
        crs: &frame.crs,
        vertical_datum: &frame.vertical_datum,
        classes: snapshot.classes(),
        objects: things.objects.iter().map(|(fid, object)| (*fid, object)).collect(),
        descriptors: things.descriptors.iter().map(|(fid, descriptor)| (*fid, descriptor)).collect(),
        marks: things.marks,
    };
    let bytes = write(&scene, form, &options.out)?;
    let (version, out) = (version.0, options.out.display());
    let (objects, descriptors) = (things.objects.len(), things.descriptors.len());
    if console.is_json() {
        let mut document = json!({
            "version": version, "file": out.to_string(), "bytes": bytes,
            "objects": objects, "descriptors": descriptors,
        });
        if let Some((from, to)) = range {
            document["from"] = json!(from.0);
            document["to"] = json!(to.0);
            for mark in Mark::ALL {
                document[mark.name()] = json!(scene.marks.values().filter(|found| **found == mark).count());
            }
        }
        console.document(&document)?;
        return Ok(0);
    }
    let what = range.map_or_else(|| format!("version {version}"), |(from, to)| format!("difference {from}..{to}"));
    console.line(format_args!("{out}: {what}, {objects} objects, {descriptors} descriptors, {bytes} bytes"))?;
    Ok(0)
}

/// What is exported.
#[derive(Default)]
struct Things {
    objects: Vec<(u64, Object)>,
    descriptors: Vec<(u64, Descriptor)>,
    marks: BTreeMap<u64, Mark>,
}

impl Things {
    fn add_version(&mut self, map: &impl History, at: VersionId, bounds: Option<&BoxMm>) -> Result<VersionId, Failure> {
        let snapshot = map.snapshot(at)?;
        for feature in snapshot.features(bounds)? {
            self.add(map, feature.fid.0, feature.state)?;
        }
        Ok(at)
    }

    /// What came and changed as it is after, what went as it was before. Classes are those of the later version, which
    /// has every class of the earlier one.
    fn add_difference(
        &mut self,
        map: &impl History,
        (from, to): (VersionId, VersionId),
        bounds: Option<&BoxMm>,
    ) -> Result<VersionId, Failure> {
        for delta in map.changes(from, to, bounds)? {
            let fid = delta.fid().0;
            let mark = match (delta.before(), delta.after()) {
                (None, _) => Mark::Added,
                (_, None) => Mark::Removed,
                _ => Mark::Changed,
            };
            self.marks.insert(fid, mark);
            let state = |delta: &Delta| delta.after().or(delta.before()).cloned();
            if let Some(state) = state(&delta) {
                self.add(map, fid, state)?;
            }
        }
        Ok(from.max(to))
    }

    fn add(&mut self, map: &impl History, fid: u64, state: FeatureState) -> Result<(), Failure> {
        match state {
            FeatureState::Descriptor(descriptor) => self.descriptors.push((fid, descriptor)),
            FeatureState::Object { name, geometry, .. } => {
                let mesh = decode_mesh(&map.geometry(geometry)?)
                    .map_err(|error| Failure::new(MAP, anyhow::anyhow!("geometry of object {fid}: {error}")))?;
                self.objects.push((fid, Object { name, mesh }));
            }
        }
        Ok(())
    }
}

/// Writes the files and returns their bytes.
fn write(scene: &ExportScene<'_>, form: Form, out: &Path) -> Result<usize, Failure> {
    match form {
        Form::Glb => {
            let bytes = glb(scene)?;
            write_file(out, &bytes)?;
            Ok(bytes.len())
        }
        Form::Gltf => {
            let buffer = out.with_extension("bin");
            let files = gltf(scene, &reference(buffer.file_name().unwrap_or_default()))?;
            write_files(&[(&buffer, &files.buffer), (out, &files.json)])?;
            Ok(files.json.len() + files.buffer.len())
        }
    }
}

/// A relative URI of a file beside the one that names it (RFC 3986).
fn reference(name: &OsStr) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    let escape = |byte: &u8| if is_plain(*byte) { char::from(*byte).to_string() } else { format!("%{byte:02X}") };
    name.as_encoded_bytes().iter().map(escape).collect()
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
