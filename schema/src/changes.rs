//! Change sets (`resurvey.changes/1`, JSON lines) and the JSON form of a descriptor.

use crate::class::ClassId;
use crate::position::GridPoint;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Value of `format` in the header line.
pub const FORMAT: &str = "resurvey.changes/1";

/// First line of a change set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a header, {\"format\": …}")]
pub struct ChangeSetHeader {
    /// Always [`FORMAT`].
    pub format: String,
    /// Version the operations were made against; `null` applies to any.
    pub base_version: Option<u64>,
    /// Who made it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub author: Option<String>,
    /// Why.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// When the world was so, a time with its zone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observed_at: Option<String>,
    /// The map it was made from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map_id: Option<String>,
    /// Hash of `base_version` in that map, 64 hexadecimal digits: in a map where that version has another one,
    /// `base_version` says nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_hash: Option<String>,
    /// Index of each class by name in that map: geometry has indices.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub classes: Option<BTreeMap<String, ClassId>>,
}

/// What an operation does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Op {
    /// Only `after`.
    Add,
    /// Only `before`.
    Remove,
    /// Both.
    Modify,
}

/// One operation, one line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "an operation, {\"op\": …}")]
pub struct ChangeLine {
    /// What it does.
    pub op: Op,
    /// Feature id; on `add` the map gives one when it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fid: Option<u64>,
    /// The live state it expects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before: Option<DescriptorFile>,
    /// The state it makes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<DescriptorFile>,
    /// The live state it expects of an object, instead of `before`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before_object: Option<ObjectFile>,
    /// The state it makes of an object, instead of `after`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after_object: Option<ObjectFile>,
}

/// Geometry that objects of the set need, one line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryLine {
    /// SHA-256 of the bytes, 64 hexadecimal digits.
    pub geometry: String,
    /// The bytes as the map keeps them, base 64 (RFC 4648, section 4).
    pub base64: String,
}

/// An object of the model as JSON has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectFile {
    /// Name in the source.
    pub name: String,
    /// SHA-256 of its geometry, 64 hexadecimal digits.
    pub geometry: String,
    /// Lower ends of the box around it: easting, northing, height, millimetres.
    pub min_mm: [i64; 3],
    /// Upper ends.
    pub max_mm: [i64; 3],
}

/// A descriptor as JSON has it: material when `corners` is there, dynamic when `position` is. Derived values (`centre`,
/// `width_m`, `height_m`, `area_m2`) are written for readers and ignored when read; so is the `kind` of a state that an
/// answer printed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a descriptor, {\"class\": …}")]
pub struct DescriptorFile {
    /// `material` or `dynamic`, which the other keys say too.
    #[serde(default, skip_serializing)]
    pub kind: Option<IgnoredAny>,
    /// Class name.
    pub class: String,
    /// Bottom-left, bottom-right, top-right, top-left, seen from outside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub corners: Option<[GridPoint; 4]>,
    /// Mean of the corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<GridPoint>,
    /// Mean length of bottom and top, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_m: Option<f64>,
    /// Mean length of left and right, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Area, m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area_m2: Option<f64>,
    /// Outward unit normal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// Ground contact of a dynamic descriptor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<GridPoint>,
    /// Along, across, up, metres; the class's own when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_m: Option<[f64; 3]>,
    /// Heading of the front, degrees clockwise from grid north.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub yaw_deg: Option<f64>,
    /// 1σ of the position, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_m: Option<f64>,
    /// 1σ of width and height, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_size_m: Option<f64>,
    /// 1σ of the area, m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sigma_area_m2: Option<f64>,
}
