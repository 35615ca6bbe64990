//! 3DS files: objects, faces with their materials, texture coordinates, texture file names. The chunk kinds are those
//! of Autodesk's 3D Studio File Toolkit, as lib3ds and assimp read them.
//!
//! Vertices are stored in world space; the object's matrix (0x4160) only tells its local axes and moves nothing, except
//! that an object with a mirrored matrix is stored unmirrored along its local x axis (both readers undo that). The
//! keyframer (animation) is ignored.

use super::chunks::{Chunk, Cursor};
use super::model::{Image, Material, Model, Part, Texture, check_count, coarse_coordinates};
use super::{ImportError, Up, Wrap};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

const MAIN: u16 = 0x4D4D;
const EDITOR: u16 = 0x3D3D;
const MASTER_SCALE: u16 = 0x0100;
const OBJECT: u16 = 0x4000;
const TRIANGLE_MESH: u16 = 0x4100;
const VERTICES: u16 = 0x4110;
const FACES: u16 = 0x4120;
const FACE_MATERIAL: u16 = 0x4130;
const TEXTURE_COORDINATES: u16 = 0x4140;
const LOCAL_AXES: u16 = 0x4160;
const MATERIAL: u16 = 0xAFFF;
const MATERIAL_NAME: u16 = 0xA000;
const TEXTURE_MAP: u16 = 0xA200;
const MAP_FILE: u16 = 0xA300;
const MAP_TILING: u16 = 0xA351;
const MAP_SCALE: [u16; 2] = [0xA354, 0xA356];
const MAP_OFFSET: [u16; 2] = [0xA358, 0xA35A];
const MAP_ANGLE: u16 = 0xA35C;

/// Tiling bits: every other repetition mirrored; no repetition at all.
const TILING_MIRROR: u16 = 0x0002;
const TILING_NONE: u16 = 0x0010;

/// The name of faces that no material is given to.
pub(super) const NO_MATERIAL: &str = "(no material)";

/// Whether `bytes` begin like a 3DS file.
pub(super) fn is_3ds(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAIN.to_le_bytes())
}

/// The model in the 3DS file `bytes`.
pub(super) fn read_3ds(bytes: &[u8]) -> Result<Model, ImportError> {
    let mut file = Reading::default();
    let mut main = match Cursor::new(bytes).chunk()? {
        Some(Chunk { kind: MAIN, body }) => body,
        _ => return Err(ImportError::Damaged3ds { offset: 0, reason: "expected the main chunk 0x4d4d".to_owned() }),
    };
    while let Some(mut section) = main.chunk()? {
        if section.kind == EDITOR {
            while let Some(chunk) = section.body.chunk()? {
                file.editor_chunk(chunk)?;
            }
        }
    }
    Ok(file.into_model())
}

/// What has been read so far. Materials may come after the faces that name them.
#[derive(Default)]
struct Reading {
    parts: Vec<(Part, Vec<Option<String>>)>,
    materials: Vec<Material>,
    images: Vec<Image>,
    image_of_name: HashMap<String, usize>,
    warnings: Vec<String>,
    vertex_count: usize,
    face_count: usize,
}

impl Reading {
    fn editor_chunk(&mut self, mut chunk: Chunk<'_>) -> Result<(), ImportError> {
        match chunk.kind {
            MATERIAL => self.material(chunk.body)?,
            OBJECT => {
                let name = chunk.body.text()?;
                while let Some(part) = chunk.body.chunk()? {
                    if part.kind == TRIANGLE_MESH {
                        self.part(&name, part.body)?;
                    }
                }
            }
            MASTER_SCALE => {
                let [scale] = chunk.body.floats()?;
                if (scale - 1.0).abs() > 1e-6 {
                    self.warnings.push(format!("the file's master scale of {scale} is not applied"));
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn material(&mut self, mut body: Cursor<'_>) -> Result<(), ImportError> {
        let mut material = Material { name: String::new(), texture: None };
        while let Some(mut chunk) = body.chunk()? {
            match chunk.kind {
                MATERIAL_NAME => material.name = chunk.body.text()?,
                TEXTURE_MAP => material.texture = self.texture(chunk.body)?,
                _ => {}
            }
        }
        self.materials.push(material);
        Ok(())
    }

    fn texture(&mut self, mut body: Cursor<'_>) -> Result<Option<Texture>, ImportError> {
        let (mut file, mut tiling) = (String::new(), 0);
        let mut moved = Vec::new();
        while let Some(mut chunk) = body.chunk()? {
            let still = match chunk.kind {
                MAP_FILE => {
                    file = chunk.body.text()?;
                    continue;
                }
                MAP_TILING => {
                    tiling = chunk.body.u16()?;
                    continue;
                }
                kind if MAP_SCALE.contains(&kind) => 1.0,
                kind if kind == MAP_ANGLE || MAP_OFFSET.contains(&kind) => 0.0,
                _ => continue,
            };
            let [value] = chunk.body.floats::<1>()?;
            if value.is_nan() || (value - still).abs() > 1e-6 {
                moved.push(value);
            }
        }
        if file.is_empty() {
            return Ok(None);
        }
        let image = match moved[..] {
            [] => Ok(self.image(file)),
            _ => Err(format!("{file:?}: the texture map is scaled, shifted or turned; bake that into the coordinates")),
        };
        let wrap = match tiling {
            bits if bits & TILING_MIRROR != 0 => Wrap::Mirror,
            bits if bits & TILING_NONE != 0 => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        Ok(Some(Texture { image, wrap_u: wrap, wrap_v: wrap }))
    }

    fn image(&mut self, name: String) -> usize {
        *self.image_of_name.entry(name).or_insert_with_key(|name| {
            self.images.push(Image { name: name.clone(), bytes: None });
            self.images.len() - 1
        })
    }

    fn part(&mut self, name: &str, mut body: Cursor<'_>) -> Result<(), ImportError> {
        let mut part = Part { name: name.to_owned(), ..Part::default() };
        let mut coordinates = Vec::new();
        let mut names = Vec::new();
        let mut axes = None;
        while let Some(mut chunk) = body.chunk()? {
            match chunk.kind {
                VERTICES => part.vertices = points(chunk.body)?,
                TEXTURE_COORDINATES => coordinates = texture_coordinates(chunk.body)?,
                FACES => (part.triangles, names) = faces(chunk.body)?,
                LOCAL_AXES => axes = Some(chunk.body.floats()?),
                _ => {}
            }
        }
        if let Some(axes) = axes {
            part.vertices = unmirrored(part.vertices, axes);
        }
        coordinates.resize(part.vertices.len(), None);
        part.uvs = coordinates;
        self.vertex_count += part.vertices.len();
        self.face_count += part.triangles.len();
        check_count("vertices", self.vertex_count)?;
        check_count("triangles", self.face_count)?;
        self.parts.push((part, names));
        Ok(())
    }

    fn into_model(self) -> Model {
        let mut materials = self.materials;
        let mut material_of_name = HashMap::new();
        for (index, material) in materials.iter().enumerate() {
            material_of_name.entry(material.name.clone()).or_insert(index);
        }
        let mut parts = Vec::with_capacity(self.parts.len());
        for (mut part, names) in self.parts {
            for name in names {
                let name = name.unwrap_or_else(|| NO_MATERIAL.to_owned());
                let index = *material_of_name.entry(name).or_insert_with_key(|name| {
                    materials.push(Material { name: name.clone(), texture: None });
                    materials.len() - 1
                });
                part.triangle_materials.push(index);
            }
            parts.push(part);
        }
        let mut warnings = self.warnings;
        warnings.extend(coarse_coordinates(parts.iter().flat_map(|part| &part.vertices).flatten().copied()));
        Model {
            format: "3DS",
            up: Up::Z,
            grid_origin: None,
            parts,
            materials,
            images: self.images,
            skipped_primitives: 0,
            warnings,
        }
    }
}

fn points(mut body: Cursor<'_>) -> Result<Vec<[f64; 3]>, ImportError> {
    (0..body.u16()?).map(|_| body.floats::<3>().map(|point| point.map(f64::from))).collect()
}

/// v = 0 is the bottom row in the file and the top row here.
fn texture_coordinates(mut body: Cursor<'_>) -> Result<Vec<Option<[f32; 2]>>, ImportError> {
    let flipped = |[u, v]: [f32; 2]| Some([u, (1.0 - f64::from(v)) as f32]);
    (0..body.u16()?).map(|_| body.floats::<2>().map(flipped)).collect()
}

/// Vertex indices and the material name of each face.
type Faces = (Vec<[u32; 3]>, Vec<Option<String>>);

fn faces(mut body: Cursor<'_>) -> Result<Faces, ImportError> {
    let count = usize::from(body.u16()?);
    let mut triangles = Vec::new();
    for _ in 0..count {
        triangles.push([body.u16()?, body.u16()?, body.u16()?].map(u32::from));
        let _edge_flags = body.u16()?;
    }
    let mut names = vec![None; count];
    while let Some(mut chunk) = body.chunk()? {
        if chunk.kind != FACE_MATERIAL {
            continue;
        }
        let name = chunk.body.text()?;
        for _ in 0..chunk.body.u16()? {
            let face = chunk.body.u16()?;
            let slot = names.get_mut(usize::from(face)).ok_or_else(|| {
                chunk.body.damaged(format!("expected a face number below {count} for material {name:?}, found {face}"))
            })?;
            *slot = Some(name.clone());
        }
    }
    Ok((triangles, names))
}

/// The vertices with their local x reversed when the local axes (x, y, z, origin) are left-handed.
fn unmirrored(vertices: Vec<[f64; 3]>, axes: [f32; 12]) -> Vec<[f64; 3]> {
    let axes = axes.map(f64::from);
    let world_from_local = Matrix3::from_column_slice(&axes[..9]);
    let origin = Vector3::new(axes[9], axes[10], axes[11]);
    if world_from_local.determinant() >= 0.0 {
        return vertices;
    }
    let Some(local_from_world) = world_from_local.try_inverse() else { return vertices };
    let turned = world_from_local * Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0)) * local_from_world;
    vertices.into_iter().map(|vertex| (turned * (Vector3::from(vertex) - origin) + origin).into()).collect()
}
