//! glTF 2.0 files, `.gltf` and `.glb`: the triangles of the default scene with their materials and label textures.
//!
//! The file's axes are y up, z south. A file of our own export says in `asset.extras.resurvey.grid_origin` where its
//! zero lies, as [E, N, H]; the descriptors in it are not objects and are left out. Appearance, animation, skins and cameras are left alone.

use super::gltf_buffers::{Buffers, damaged, data_uri, percent_decoded, split_container};
use super::gltf_scene::{Placed, placed_meshes};
use super::gltf_schema::{self as schema, Root};
use super::model::{Image, Material, Model, Part, Texture, check_count, coarse_coordinates};
use super::neighbours::Neighbours;
use super::{ImportError, Up, Wrap};
use nalgebra::{Matrix4, Point3};
use resurvey_schema::GridPoint;

/// Required extensions that change nothing here or are decoded, beside all `KHR_materials_…`.
const HARMLESS: [&str; 10] = [
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_lights_punctual",
    "KHR_animation_pointer",
    "KHR_xmp_json_ld",
    "EXT_lights_image_based",
    "EXT_mesh_features",
    "EXT_instance_features",
    "EXT_structural_metadata",
    "CESIUM_primitive_outline",
];

/// Most bytes of all embedded images together.
const MAX_EMBEDDED_BYTES: usize = 1 << 30;

/// The model in the glTF file `bytes`; buffers and images that it names are `neighbours`.
pub(super) fn read_gltf(bytes: &[u8], neighbours: &Neighbours) -> Result<Model, ImportError> {
    let (json, binary) = split_container(bytes)?;
    let root: Root = serde_json::from_slice(json).map_err(|error| damaged("the JSON text", error.to_string()))?;
    if root.asset.version.split('.').next() != Some("2") {
        return Err(damaged("asset.version", format!("expected 2.0, found {:?}", root.asset.version)));
    }
    let is_harmless = |name: &str| HARMLESS.contains(&name) || name.starts_with("KHR_materials_");
    let names: Vec<String> = root.extensions_required.iter().filter(|name| !is_harmless(name)).cloned().collect();
    if !names.is_empty() {
        return Err(ImportError::GltfExtensions { names });
    }
    let mut warnings = Vec::new();
    let grid_origin = grid_origin(&root, &mut warnings);
    if root.extensions_used.iter().any(|name| name == "EXT_mesh_gpu_instancing") {
        warnings.push("EXT_mesh_gpu_instancing is not read: each instanced mesh is imported once".to_owned());
    }
    if root.nodes.iter().any(|node| node.skin.is_some()) {
        warnings.push("skins are not read: skinned meshes are imported in their rest pose".to_owned());
    }
    let buffers = Buffers::load(&root, binary, neighbours)?;
    let mut reading = Reading {
        root: &root,
        buffers: &buffers,
        materials: materials(&root)?,
        skipped_primitives: 0,
        vertex_count: 0,
        face_count: 0,
        coarse: None,
    };
    let mut placed = placed_meshes(&root)?;
    let found = placed.len();
    placed.retain(|placed| !is_descriptor(&root, placed.node));
    if placed.len() < found {
        let left_out = found - placed.len();
        warnings.push(format!("{left_out} descriptors of the export are left out: an import adds objects only"));
    }
    let parts = placed.iter().map(|placed| reading.part(placed)).collect::<Result<_, _>>()?;
    warnings.extend(reading.coarse);
    Ok(Model {
        format: "glTF",
        up: Up::Y,
        grid_origin,
        parts,
        materials: reading.materials,
        images: images(&root, &buffers)?,
        skipped_primitives: reading.skipped_primitives,
        warnings,
    })
}

/// Whether `node` stands for a descriptor in a file of our own export.
fn is_descriptor(root: &Root, node: usize) -> bool {
    let is_own = root.asset.extras.as_ref().is_some_and(|extras| extras.get("resurvey").is_some());
    let kind = root.nodes[node].extras.as_ref().and_then(|extras| extras.get("kind")?.as_str());
    is_own && matches!(kind, Some("material" | "dynamic"))
}

fn grid_origin(root: &Root, warnings: &mut Vec<String>) -> Option<GridPoint> {
    let value = root.asset.extras.as_ref()?.get("resurvey")?.get("grid_origin")?;
    let point = serde_json::from_value::<[f64; 3]>(value.clone()).ok().map(GridPoint::from);
    let point = point.filter(GridPoint::is_finite);
    if point.is_none() {
        warnings.push("asset.extras.resurvey.grid_origin is not [E, N, H] and is ignored".to_owned());
    }
    point
}

/// The materials of the file, then one for primitives without any.
fn materials(root: &Root) -> Result<Vec<Material>, ImportError> {
    let mut materials = Vec::with_capacity(root.materials.len() + 1);
    for (index, material) in root.materials.iter().enumerate() {
        let texture = match texture_info(material) {
            Some(info) => Some(texture(root, index, info)?),
            None => None,
        };
        let name = material.name.clone().unwrap_or_else(|| format!("(unnamed material {index})"));
        materials.push(Material { name, texture });
    }
    materials.push(Material { name: super::import_3ds::NO_MATERIAL.to_owned(), texture: None });
    Ok(materials)
}

fn texture_info(material: &schema::Material) -> Option<&schema::TextureInfo> {
    material.pbr_metallic_roughness.as_ref()?.base_color_texture.as_ref()
}

fn texture(root: &Root, material: usize, info: &schema::TextureInfo) -> Result<Texture, ImportError> {
    let at = || format!("materials[{material}].pbrMetallicRoughness.baseColorTexture");
    let missing = |what: &str, index: usize| damaged(at(), format!("there is no {what} {index}"));
    let texture = root.textures.get(info.index).ok_or_else(|| missing("texture", info.index))?;
    let image = match texture.source {
        Some(source) if source < root.images.len() => Ok(source),
        Some(source) => return Err(missing("image", source)),
        None => Err(format!("texture {}: it has no PNG or JPG image", info.index)),
    };
    let is_turned = info.extensions.transform.is_some_and(|transform| transform.rotation.abs() > 1e-9);
    let image = match is_turned {
        true => Err(format!("texture {}: KHR_texture_transform turns it; bake that into the coordinates", info.index)),
        false => image,
    };
    let (wrap_u, wrap_v) = match texture.sampler {
        None => (Wrap::Repeat, Wrap::Repeat),
        Some(index) => {
            let sampler = root.samplers.get(index).ok_or_else(|| missing("sampler", index))?;
            (wrap(sampler.wrap_s), wrap(sampler.wrap_t))
        }
    };
    Ok(Texture { image, wrap_u, wrap_v })
}

fn wrap(mode: u32) -> Wrap {
    match mode {
        33_071 => Wrap::Clamp,
        33_648 => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

fn images(root: &Root, buffers: &Buffers<'_>) -> Result<Vec<Image>, ImportError> {
    let mut images = Vec::with_capacity(root.images.len());
    let mut embedded_bytes = 0;
    for (index, image) in root.images.iter().enumerate() {
        let made_up = || image.name.clone().unwrap_or_else(|| format!("image{index}"));
        let at = || format!("images[{index}]");
        images.push(match (&image.uri, image.buffer_view) {
            (Some(uri), _) => match data_uri(uri) {
                Some(bytes) => Image { name: made_up(), bytes: Some(bytes.map_err(|reason| damaged(at(), reason))?) },
                None => Image { name: percent_decoded(uri), bytes: None },
            },
            (None, Some(view)) => Image { name: made_up(), bytes: Some(buffers.view(view)?.0.to_vec()) },
            (None, None) => return Err(damaged(at(), "expected a URI or a buffer view, found neither")),
        });
        // Many images may name the same bytes: a small file could ask for any amount of memory.
        embedded_bytes += images.last().and_then(|image| image.bytes.as_ref()).map_or(0, Vec::len);
        if embedded_bytes > MAX_EMBEDDED_BYTES {
            return Err(ImportError::TooMany { what: "bytes of embedded images", limit: MAX_EMBEDDED_BYTES });
        }
    }
    Ok(images)
}

struct Reading<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    materials: Vec<Material>,
    skipped_primitives: usize,
    vertex_count: usize,
    face_count: usize,
    coarse: Option<String>,
}

impl Reading<'_> {
    fn part(&mut self, placed: &Placed) -> Result<Part, ImportError> {
        let mesh = self.root.meshes.get(placed.mesh);
        let mesh = mesh.ok_or_else(|| damaged(format!("nodes[{}]", placed.node), "there is no such mesh"))?;
        let name = self.root.nodes[placed.node].name.clone().or_else(|| mesh.name.clone());
        let mut part = Part { name: name.unwrap_or_else(|| format!("node{}", placed.node)), ..Part::default() };
        for (index, primitive) in mesh.primitives.iter().enumerate() {
            let at = format!("meshes[{}].primitives[{index}]", placed.mesh);
            self.primitive(&at, primitive, &placed.file_from_node, &mut part)?;
        }
        Ok(part)
    }

    fn primitive(
        &mut self,
        at: &str,
        primitive: &schema::Primitive,
        file_from_node: &Matrix4<f64>,
        part: &mut Part,
    ) -> Result<(), ImportError> {
        if primitive.mode < 4 {
            self.skipped_primitives += 1;
            return Ok(());
        }
        let Some(&position) = primitive.attributes.get("POSITION") else {
            return Err(damaged(at, "expected a POSITION attribute, found none"));
        };
        let positions = self.buffers.elements::<3>(position)?;
        // The node may move them far away without loss: only the stored numbers count.
        self.coarse = self.coarse.take().or_else(|| coarse_coordinates(positions.iter().flatten().copied()));
        let count = positions.len();
        let indices = match primitive.indices {
            Some(index) => self.buffers.indices(index)?,
            None => (0..count as u32).collect(),
        };
        if let Some(index) = indices.iter().find(|&&index| index as usize >= count) {
            return Err(damaged(at, format!("expected vertex indices below {count}, found {index}")));
        }
        let no_material = self.materials.len() - 1;
        let material = primitive.material.unwrap_or(no_material);
        if material > no_material {
            return Err(damaged(at, format!("there is no material {material}")));
        }
        let first = part.vertices.len() as u32;
        let triangles = triangles(at, primitive.mode, &indices)?;
        self.vertex_count += count;
        self.face_count += triangles.len();
        check_count("vertices", self.vertex_count)?;
        check_count("triangles", self.face_count)?;
        part.triangle_materials.resize(part.triangles.len() + triangles.len(), material);
        part.triangles.extend(triangles.iter().map(|triangle| triangle.map(|index| first + index)));
        part.vertices.extend(
            positions
                .iter()
                .map(|&position| <[f64; 3]>::from(file_from_node.transform_point(&Point3::from(position)).coords)),
        );
        part.uvs.extend(self.texture_coordinates(at, primitive, count)?);
        Ok(())
    }

    /// One per vertex of the primitive, moved and scaled as its material's texture says.
    fn texture_coordinates(
        &self,
        at: &str,
        primitive: &schema::Primitive,
        count: usize,
    ) -> Result<Vec<Option<[f32; 2]>>, ImportError> {
        let info = primitive.material.and_then(|index| self.root.materials.get(index)).and_then(texture_info);
        let Some(info) = info else { return Ok(vec![None; count]) };
        let transform = info.extensions.transform;
        let set = transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord);
        let Some(&accessor) = primitive.attributes.get(&format!("TEXCOORD_{set}")) else {
            return Ok(vec![None; count]);
        };
        let coordinates = self.buffers.elements::<2>(accessor)?;
        if coordinates.len() != count {
            let found = coordinates.len();
            return Err(damaged(at, format!("expected {count} texture coordinates, found {found}")));
        }
        let ([u0, v0], [su, sv]) = transform.map_or(([0.0; 2], [1.0; 2]), |moved| (moved.offset, moved.scale));
        Ok(coordinates.into_iter().map(|[u, v]| Some([(u0 + su * u) as f32, (v0 + sv * v) as f32])).collect())
    }
}

/// Triangles of a list (4), strip (5) or fan (6) of vertices: glTF 2.0, 3.7.2.1.
fn triangles(at: &str, mode: u32, indices: &[u32]) -> Result<Vec<[u32; 3]>, ImportError> {
    match mode {
        4 if indices.len().is_multiple_of(3) => Ok(indices.as_chunks::<3>().0.to_vec()),
        4 => Err(damaged(at, format!("expected three indices a triangle, found {} in all", indices.len()))),
        5 => Ok(indices
            .windows(3)
            .enumerate()
            .map(|(turn, corner)| [corner[0], corner[1 + turn % 2], corner[2 - turn % 2]])
            .collect()),
        6 => Ok(indices.windows(2).skip(1).map(|edge| [indices[0], edge[0], edge[1]]).collect()),
        _ => Err(damaged(at, format!("expected a mode of 0 to 6, found {mode}"))),
    }
}
