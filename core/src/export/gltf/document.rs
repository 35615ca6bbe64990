//! The whole document: nodes, their extras, and the file forms.

use super::super::{ExportError, ExportScene};
use super::asset::Asset;
use super::feature::{self, Kind, Row, Table};
use super::frame::{Extent, GLTF_FROM_MAP};
use super::material::Materials;
use super::shape::{DRAWN_OFF_M, Shape, shape_of_descriptor, shapes_of_object};
use crate::crs::{CrsError, LocalOrigin};
use crate::mesh::Surface;
use crate::version::descriptor_to_file;
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Extras, Index, Material, Mesh, Node, Scene};
use resurvey_schema::{ClassId, Descriptor};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// A document as JSON with its buffer beside it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GltfFiles {
    /// The `.gltf` file.
    pub json: Vec<u8>,
    /// The file that it refers to; empty when it needs none.
    pub buffer: Vec<u8>,
}

/// `scene` as binary glTF. Same scene, same bytes.
pub fn glb(scene: &ExportScene) -> Result<Vec<u8>, ExportError> {
    let (json, bytes) = document(scene)?.finish(None)?;
    // Lengths are 32-bit, and the container needs a few bytes for itself.
    let (found, limit) = (json.len() as u64 + bytes.len() as u64, u64::from(u32::MAX) - 64);
    if found > limit {
        return Err(ExportError::TooLarge { unit: "bytes", found, limit });
    }
    let header = ::gltf::binary::Header { magic: *b"glTF", version: 2, length: 0 };
    let bin = (!bytes.is_empty()).then(|| bytes.into());
    let container = ::gltf::binary::Glb { header, json: align_buffer(json).into(), bin };
    container.to_vec().map_err(|error| ExportError::Container(error.to_string()))
}

/// `scene` as JSON whose buffer is the file `buffer_uri`. Same scene, same bytes.
pub fn gltf(scene: &ExportScene, buffer_uri: &str) -> Result<GltfFiles, ExportError> {
    let (json, buffer) = document(scene)?.finish(Some(buffer_uri))?;
    Ok(GltfFiles { json, buffer })
}

/// Spaces after the JSON so that the buffer starts at a multiple of eight: after a header of 12 bytes and two chunk
/// headers of 8.
fn align_buffer(mut json: Vec<u8>) -> Vec<u8> {
    json.resize((json.len() + 4).next_multiple_of(8) - 4, b' ');
    json
}

/// Something to become a node.
struct Part<'a> {
    fid: u64,
    name: String,
    extras: Value,
    kind: Kind,
    shapes: Vec<(Look<'a>, Shape)>,
    extent: Extent,
}

/// What a shape looks like.
enum Look<'a> {
    Class(ClassId),
    Surface(&'a Surface),
}

impl Look<'_> {
    /// Its class; `None` where a label texture holds the classes.
    fn class(&self) -> Option<ClassId> {
        match self {
            Self::Class(class) | Self::Surface(Surface::Class(class)) => Some(*class),
            Self::Surface(Surface::Texture(_)) => None,
        }
    }
}

fn document(scene: &ExportScene) -> Result<Asset, ExportError> {
    let mut parts = Vec::with_capacity(scene.objects.len() + scene.descriptors.len());
    for &(fid, object) in &scene.objects {
        let shapes = shapes_of_object(fid, object)?;
        let shapes = shapes.into_iter().map(|(surface, shape)| (Look::Surface(surface), shape)).collect();
        let mut extras = json!({ "fid": fid, "kind": Kind::Object.name(), "name": object.name });
        mark(&mut extras, fid, scene);
        parts.push(Part::new(fid, object.name.clone(), extras, Kind::Object, shapes)?);
    }
    for &(fid, descriptor) in &scene.descriptors {
        let (kind, mut extras) = describe(fid, descriptor, scene)?;
        mark(&mut extras, fid, scene);
        let name = format!("{} {fid}", scene.classes.name(descriptor.class()));
        let shapes = vec![(Look::Class(descriptor.class()), shape_of_descriptor(descriptor))];
        parts.push(Part::new(fid, name, extras, kind, shapes)?);
    }
    let mut extent = Extent::default();
    parts.iter().for_each(|part| extent.join(&part.extent));
    let origin = extent.export_origin().map_err(|source| ExportError::Position { fid: 0, source })?;
    let mut writer =
        Writer { scene, origin, asset: Asset::default(), materials: Materials::default(), table: Table::default() };
    let nodes = parts.iter().map(|part| writer.node(part)).collect::<Result<Vec<_>, _>>()?;
    writer.finish(nodes)
}

/// Says in its extras what became of a feature.
fn mark(extras: &mut Value, fid: u64, scene: &ExportScene) {
    if let Some(mark) = scene.marks.get(&fid) {
        extras["difference"] = json!(mark.name());
    }
}

impl<'a> Part<'a> {
    fn new(
        fid: u64,
        name: String,
        extras: Value,
        kind: Kind,
        shapes: Vec<(Look<'a>, Shape)>,
    ) -> Result<Self, ExportError> {
        let points = shapes.iter().flat_map(|(_, shape)| shape.vertices.iter().copied());
        let extent = Extent::around(points).map_err(|source| ExportError::Position { fid, source })?;
        Ok(Self { fid, name, extras, kind, shapes, extent })
    }
}

/// Extras of a descriptor: ids and its JSON form.
fn describe(fid: u64, descriptor: &Descriptor, scene: &ExportScene) -> Result<(Kind, Value), ExportError> {
    let kind = match descriptor {
        Descriptor::Material(_) => Kind::Material,
        Descriptor::Dynamic(_) => Kind::Dynamic,
    };
    let mut extras = serde_json::to_value(descriptor_to_file(descriptor, scene.classes))?;
    extras["fid"] = json!(fid);
    extras["kind"] = json!(kind.name());
    if kind == Kind::Material {
        extras["drawn_off_m"] = json!(DRAWN_OFF_M);
    }
    Ok((kind, extras))
}

struct Writer<'a, 'b> {
    scene: &'b ExportScene<'a>,
    origin: LocalOrigin,
    asset: Asset,
    materials: Materials<'a>,
    table: Table,
}

impl<'a> Writer<'a, '_> {
    /// One node with one primitive per shape; a node without a mesh where there is none.
    fn node(&mut self, part: &Part<'a>) -> Result<Index<Node>, ExportError> {
        let at = |source: CrsError| ExportError::Position { fid: part.fid, source };
        let mut node = Node { name: Some(part.name.clone()), extras: extras(&part.extras)?, ..Node::default() };
        if !part.shapes.is_empty() {
            let (translation_m, origin) = part.extent.node_origin(&self.origin).map_err(at)?;
            let mut primitives = Vec::with_capacity(part.shapes.len());
            for (look, shape) in &part.shapes {
                primitives.push(self.primitive(part, look, shape, &origin)?);
            }
            let mesh =
                Mesh { extensions: None, extras: None, name: Some(part.name.clone()), primitives, weights: None };
            node.translation = Some(translation_m);
            node.mesh = Some(self.asset.root.push(mesh));
        }
        Ok(self.asset.root.push(node))
    }

    fn primitive(
        &mut self,
        part: &Part<'a>,
        look: &Look<'a>,
        shape: &Shape,
        origin: &LocalOrigin,
    ) -> Result<Primitive, ExportError> {
        let (class, material) = match self.scene.marks.get(&part.fid) {
            Some(mark) => (look.class(), self.materials.of_mark(&mut self.asset, *mark)),
            None => self.material(part.fid, look)?,
        };
        let (feature, extension) = self.table.push(Row { fid: part.fid, class, kind: part.kind })?;
        let positions = shape
            .vertices
            .iter()
            .map(|&vertex| origin.to_local(vertex))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|source| ExportError::Position { fid: part.fid, source })?;
        let features = vec![[feature]; positions.len()];
        let mut attributes = BTreeMap::from([
            (Valid(Semantic::Positions), self.asset.push_positions(&positions)),
            (Valid(Semantic::Extras(feature::ATTRIBUTE.to_owned())), self.asset.push_vectors(&features)),
        ]);
        if !shape.uvs.is_empty() && !self.scene.marks.contains_key(&part.fid) {
            attributes.insert(Valid(Semantic::TexCoords(0)), self.asset.push_vectors(&shape.uvs));
        }
        Ok(Primitive {
            attributes,
            extensions: Some(extension),
            extras: None,
            indices: Some(self.asset.push_triangles(&shape.triangles, positions.len())),
            material: Some(material),
            mode: Valid(Mode::Triangles),
            targets: None,
        })
    }

    fn material(&mut self, fid: u64, look: &Look<'a>) -> Result<(Option<ClassId>, Index<Material>), ExportError> {
        let (asset, classes) = (&mut self.asset, self.scene.classes);
        match look {
            Look::Class(class) | Look::Surface(Surface::Class(class)) => {
                Ok((Some(*class), self.materials.of_class(asset, classes, fid, *class)?))
            }
            Look::Surface(Surface::Texture(texture)) => Ok((None, self.materials.of_texture(asset, classes, texture)?)),
        }
    }

    fn finish(mut self, nodes: Vec<Index<Node>>) -> Result<Asset, ExportError> {
        self.table.finish(&mut self.asset, self.scene.classes);
        let root = &mut self.asset.root;
        if !root.materials.is_empty() {
            root.extensions_used.push("KHR_materials_unlit".to_owned());
        }
        root.asset.generator = Some(concat!("resurvey ", env!("CARGO_PKG_VERSION")).to_owned());
        root.asset.extras = extras(&json!({ "resurvey": {
            "version": self.scene.version,
            "crs": self.scene.crs,
            "vertical_datum": self.scene.vertical_datum,
            "grid_origin": self.origin.grid(),
        } }))?;
        let map = root.push(Node {
            name: Some("map".to_owned()),
            matrix: Some(GLTF_FROM_MAP),
            children: (!nodes.is_empty()).then_some(nodes),
            ..Node::default()
        });
        let scene = root.push(Scene { extensions: None, extras: None, name: None, nodes: vec![map] });
        root.scene = Some(scene);
        Ok(self.asset)
    }
}

fn extras(value: &Value) -> Result<Extras, serde_json::Error> {
    serde_json::value::to_raw_value(value).map(Some)
}
