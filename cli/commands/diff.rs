//! `resurvey diff`.

use super::{crs_of, one_format};
use crate::args::{Diff, DiffFormat};
use crate::console::Console;
use crate::document;
use crate::failure::Failure;
use crate::plain::plain;
use crate::region;
use resurvey_core::crs::Crs;
use resurvey_core::store::{History, MapFile};
use resurvey_core::version::{Delta, FeatureState, Fid};
use resurvey_schema::{ClassTable, Descriptor};
use serde_json::{Value, json};

/// What differs between two versions.
pub fn run(options: &Diff, console: &mut Console<'_>) -> Result<u8, Failure> {
    let map = MapFile::open_read_only(&options.map)?;
    let (from, to) = map.resolve_range(&options.range)?;
    let crs = crs_of(&map)?;
    let bounds = region::bbox(&options.region, crs)?;
    let deltas = map.changes(from, to, bounds.as_ref())?;
    let (before, after) = (map.snapshot(from)?, map.snapshot(to)?);
    let sides = Sides { before: before.classes(), after: after.classes() };
    match one_format(options.format, [DiffFormat::Json, DiffFormat::Geojson], DiffFormat::Text, console)? {
        DiffFormat::Json => {
            let changes = deltas.iter().map(|delta| sides.document(delta)).collect::<Result<Vec<_>, _>>()?;
            console.document(&json!({ "from": from.0, "to": to.0, "changes": changes }))?;
        }
        DiffFormat::Geojson => {
            let mut features = Vec::new();
            for delta in &deltas {
                features.extend(sides.geojson(delta, crs)?);
            }
            region::tell_unplaced(features.iter().filter(|one| one["geometry"].is_null()).count(), crs, console);
            console.document(&json!({ "type": "FeatureCollection", "features": features }))?;
        }
        DiffFormat::Text => {
            for delta in &deltas {
                sides.text(delta, console)?;
            }
            console.message(&format!("{} features differ between version {from} and version {to}", deltas.len()));
        }
    }
    Ok(0)
}

/// The class tables of both versions.
pub(super) struct Sides<'a> {
    pub(super) before: &'a ClassTable,
    pub(super) after: &'a ClassTable,
}

impl Sides<'_> {
    /// One entry of `changes`, as `update` has them.
    pub(super) fn document(&self, delta: &Delta) -> Result<Value, Failure> {
        let side = |state: Option<&FeatureState>, classes: &ClassTable| {
            state.map(|state| document::state(state, classes)).transpose()
        };
        let (before, after) = (side(delta.before(), self.before)?, side(delta.after(), self.after)?);
        let class = after.as_ref().or(before.as_ref()).map(|state| state["class"].clone());
        Ok(json!({ "op": op(delta), "fid": delta.fid().0, "class": class, "before": before, "after": after }))
    }

    /// `++` and `--` for what came and went; for what changed `~~` with what it is now, and `-` and `+` for every value that
    /// is another.
    pub(super) fn text(&self, delta: &Delta, console: &mut Console<'_>) -> Result<(), Failure> {
        // Number 0 stands for one that the map has not given yet.
        let fid = if delta.fid() == Fid(0) { "new".to_owned() } else { delta.fid().to_string() };
        match (delta.before(), delta.after()) {
            (None, Some(after)) => console.line(format_args!("++ {fid} {}", words(after, self.after)))?,
            (Some(before), None) => console.line(format_args!("-- {fid} {}", words(before, self.before)))?,
            (Some(before), Some(after)) => {
                console.line(format_args!("~~ {fid} {}", words(after, self.after)))?;
                let (old, new) = (document::state(before, self.before)?, document::state(after, self.after)?);
                for key in new.keys().chain(old.keys().filter(|key| !new.contains_key(*key))) {
                    let (old, new) = (old.get(key), new.get(key));
                    if old == new {
                        continue;
                    }
                    for (sign, value) in [('-', old), ('+', new)] {
                        if let Some(value) = value {
                            console.line(format_args!("{sign} {fid} {key} = {}", plain(&value.to_string())))?;
                        }
                    }
                }
            }
            (None, None) => {}
        }
        Ok(())
    }

    fn geojson(&self, delta: &Delta, crs: Crs) -> Result<Vec<Value>, Failure> {
        let sides = [("before", delta.before(), self.before), ("after", delta.after(), self.after)];
        let mut features = Vec::new();
        for (side, state, classes) in sides {
            let Some(state) = state else { continue };
            let mut properties = serde_json::Map::new();
            properties.insert("fid".to_owned(), json!(delta.fid().0));
            properties.insert("op".to_owned(), json!(op(delta)));
            properties.insert("side".to_owned(), json!(side));
            properties.extend(document::state(state, classes)?);
            let geometry = region::geojson(crs, state)?;
            let id = format!("{}:{side}", delta.fid());
            features.push(json!({ "type": "Feature", "id": id, "geometry": geometry, "properties": properties }));
        }
        Ok(features)
    }
}

/// `add`, `remove` or `modify`.
pub(super) fn op(delta: &Delta) -> &'static str {
    match (delta.before(), delta.after()) {
        (None, _) => "add",
        (_, None) => "remove",
        _ => "modify",
    }
}

/// What and where something is, in one line.
pub(crate) fn words(state: &FeatureState, classes: &ClassTable) -> String {
    match state {
        FeatureState::Descriptor(descriptor) => {
            let at = descriptor.anchor();
            let class = plain(classes.name(descriptor.class()));
            let size = match descriptor {
                Descriptor::Material(_) => {
                    let file = resurvey_core::version::descriptor_to_file(descriptor, classes);
                    let (width, height) = (file.width_m.unwrap_or_default(), file.height_m.unwrap_or_default());
                    format!(", {width:.2} x {height:.2} m")
                }
                Descriptor::Dynamic(_) => String::new(),
            };
            format!("{class} at E {:.2} N {:.2} H {:.2}{size}", at.easting_m, at.northing_m, at.height_m)
        }
        FeatureState::Object { name, geometry, bounds } => {
            let [low, high] = bounds.corners();
            let middle = |low: f64, high: f64| (low + high) / 2.0;
            let (e, n) = (middle(low.easting_m, high.easting_m), middle(low.northing_m, high.northing_m));
            let digest = geometry.to_string();
            format!("object {name:?} at E {e:.2} N {n:.2}, geometry {}", &digest[..12])
        }
    }
}
