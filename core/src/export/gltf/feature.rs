//! Class and feature id for every vertex: `EXT_mesh_features` on each primitive points into one property table of
//! `EXT_structural_metadata`, a row per primitive.

use super::super::ExportError;
use super::asset::Asset;
use gltf_json::extensions::mesh::Primitive;
use resurvey_schema::{ClassId, ClassTable};
use serde_json::{Map, Value, json};

/// Name of the vertex attribute, after the underscore that glTF puts before it.
pub(super) const ATTRIBUTE: &str = "FEATURE_ID_0";

const MESH_FEATURES: &str = "EXT_mesh_features";
const STRUCTURAL_METADATA: &str = "EXT_structural_metadata";

/// What a primitive shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) fid: u64,
    /// `None` where a label texture holds a class per texel.
    pub(super) class: Option<ClassId>,
    pub(super) kind: Kind,
}

/// What a feature is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Object,
    Material,
    Dynamic,
}

impl Kind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Object => "object",
            Self::Material => "material",
            Self::Dynamic => "dynamic",
        }
    }
}

/// The property table in the making.
#[derive(Debug, Default)]
pub(super) struct Table {
    rows: Vec<Row>,
}

impl Table {
    /// Adds a row; the feature id that every vertex of its primitive carries, and the primitive's extension.
    pub(super) fn push(&mut self, row: Row) -> Result<(f32, Primitive), ExportError> {
        // Vertex attributes have no 32-bit integers; `f32` counts exactly up to here.
        const LIMIT: usize = 1 << 24;
        let id = self.rows.len();
        if id >= LIMIT {
            return Err(ExportError::TooLarge { unit: "surfaces", found: id as u64 + 1, limit: LIMIT as u64 });
        }
        self.rows.push(row);
        let features = json!({ "featureIds": [{ "featureCount": 1, "attribute": 0, "propertyTable": 0 }] });
        Ok((id as f32, Primitive { others: Map::from_iter([(MESH_FEATURES.to_owned(), features)]) }))
    }

    /// Writes the table and its schema; nothing when it is empty.
    pub(super) fn finish(self, asset: &mut Asset, classes: &ClassTable) {
        if self.rows.is_empty() {
            return;
        }
        let fids: Vec<u8> = self.rows.iter().flat_map(|row| row.fid.to_le_bytes()).collect();
        let indices: Vec<u8> = self.rows.iter().map(|row| row.class.unwrap_or(ClassId::VOID).0).collect();
        let names = strings(asset, self.rows.iter().map(|row| row.class.map_or("", |class| classes.name(class))));
        let kinds = strings(asset, self.rows.iter().map(|row| row.kind.name()));
        let table = json!({
            "name": "features",
            "class": "feature",
            "count": self.rows.len(),
            "properties": {
                "fid": { "values": asset.push_view(&fids, None).value() },
                "class": { "values": asset.push_view(&indices, None).value() },
                "class_name": names,
                "kind": kinds,
            },
        });
        let metadata = json!({ "schema": schema(), "propertyTables": [table] });
        let extensions = asset.root.extensions.get_or_insert_default();
        extensions.others.insert(STRUCTURAL_METADATA.to_owned(), metadata);
        asset.root.extensions_used.extend([MESH_FEATURES.to_owned(), STRUCTURAL_METADATA.to_owned()]);
    }
}

/// A string property: all strings end to end, and where each starts.
fn strings<'a>(asset: &mut Asset, strings: impl Iterator<Item = &'a str>) -> Value {
    let mut text = Vec::new();
    let mut offsets = 0_u32.to_le_bytes().to_vec();
    for string in strings {
        text.extend_from_slice(string.as_bytes());
        // At most 2²⁴ rows of class names; longer than 4 GiB fails with the buffer.
        offsets.extend_from_slice(&(text.len() as u32).to_le_bytes());
    }
    if text.is_empty() {
        // A view must not be empty.
        text.push(0);
    }
    let (values, offsets) = (asset.push_view(&text, None), asset.push_view(&offsets, None));
    json!({ "values": values.value(), "stringOffsets": offsets.value() })
}

fn schema() -> Value {
    json!({
        "id": "resurvey",
        "classes": { "feature": {
            "name": "Feature",
            "properties": {
                "fid": {
                    "description": "Feature id in the map",
                    "type": "SCALAR", "componentType": "UINT64", "required": true,
                },
                "class": {
                    "description": "Index in the map's class table; no data where a label texture holds the classes",
                    "type": "SCALAR", "componentType": "UINT8", "noData": ClassId::VOID.0,
                },
                "class_name": {
                    "description": "Name in the map's class table",
                    "type": "STRING", "noData": "",
                },
                "kind": {
                    "description": "object, material or dynamic (descriptor)",
                    "type": "STRING", "required": true,
                },
            },
        } },
    })
}
