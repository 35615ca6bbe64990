//! The objects of a model: every check that a mesh must pass before it enters a map.

use super::axes::Placement;
use super::model::{Model, Part};
use super::{ImportError, Mesh, Object, Surface};
use crate::crs::{LOCAL_LIMIT_M, LocalOrigin};
use resurvey_schema::GridPoint;
use std::collections::BTreeMap;

/// Largest coordinate before the origin is added, metres; ten times round the Earth's quarter.
const MAX_COORDINATE_M: f64 = 1e8;

/// Faces smaller than this, m², are degenerate: a square of 0.1 mm, which no picture shows.
const MIN_AREA_M2: f64 = 1e-8;

/// Most texels of all objects together. Objects that share a texture hold a copy each.
const MAX_TEXELS: usize = 1 << 30;

/// The objects that passed, and what was left out.
#[derive(Debug, Default)]
pub(super) struct Assembled {
    pub objects: Vec<Object>,
    pub triangles: usize,
    pub degenerate_faces: usize,
    pub empty_objects: usize,
    pub textures: usize,
    texels: usize,
}

/// The objects of `model` with `surfaces` by material, placed and moved to `origin`. Each has an origin of its own: the
/// model's, moved by whole metres to the middle of the object.
pub(super) fn assemble(
    model: Model,
    surfaces: &[Option<Surface>],
    placement: &Placement,
    origin: GridPoint,
) -> Result<Assembled, ImportError> {
    let mut assembled = Assembled::default();
    for part in model.parts {
        assembled.add(part, surfaces, placement, origin)?;
    }
    Ok(assembled)
}

impl Assembled {
    fn add(
        &mut self,
        part: Part,
        surfaces: &[Option<Surface>],
        placement: &Placement,
        origin: GridPoint,
    ) -> Result<(), ImportError> {
        let part = Checked::new(part, placement)?;
        let Some(Offsets { shift, offsets }) = part.offsets()? else {
            self.empty_objects += 1;
            return Ok(());
        };
        let is_kept: Vec<bool> =
            part.triangles.iter().map(|corners| area_m2(corners, &offsets) >= MIN_AREA_M2).collect();
        let kept = is_kept.iter().filter(|&&kept| kept).count();
        self.degenerate_faces += is_kept.len() - kept;
        self.triangles += kept;
        if kept == 0 {
            self.empty_objects += 1;
            return Ok(());
        }
        let mut mesh = Mesh {
            origin: GridPoint::new(
                origin.easting_m + shift[0],
                origin.northing_m + shift[1],
                origin.height_m + shift[2],
            ),
            vertices: Vec::new(),
            uvs: Vec::new(),
            triangles: Vec::new(),
            triangle_surfaces: Vec::new(),
            surfaces: Vec::new(),
        };
        let materials = self.lay_surfaces(&part, &is_kept, surfaces, &mut mesh)?;
        part.fill(&is_kept, &materials, &offsets, &mut mesh)?;
        self.objects.push(Object { name: part.name, mesh });
        Ok(())
    }

    /// Gives `mesh` the surfaces that its faces have, each once, in order of use; returns their index by material.
    fn lay_surfaces(
        &mut self,
        part: &Checked,
        is_kept: &[bool],
        surfaces: &[Option<Surface>],
        mesh: &mut Mesh,
    ) -> Result<BTreeMap<usize, u16>, ImportError> {
        let mut index_of_material = BTreeMap::new();
        for (&material, _) in part.triangle_materials.iter().zip(is_kept).filter(|(_, kept)| **kept) {
            if index_of_material.contains_key(&material) {
                continue;
            }
            let surface = surfaces[material].as_ref().expect("invariant: every used material was classified");
            let is_class = matches!(surface, Surface::Class(_));
            let same = mesh.surfaces.iter().position(|known| is_class && known == surface);
            let index = same.unwrap_or(mesh.surfaces.len());
            if same.is_none() {
                self.count_texels(surface)?;
                mesh.surfaces.push(surface.clone());
            }
            let limit = usize::from(u16::MAX);
            let index = u16::try_from(index).map_err(|_| ImportError::TooMany { what: "surfaces an object", limit })?;
            index_of_material.insert(material, index);
        }
        Ok(index_of_material)
    }

    fn count_texels(&mut self, surface: &Surface) -> Result<(), ImportError> {
        if let Surface::Texture(texture) = surface {
            self.textures += 1;
            self.texels += texture.labels.values().len();
        }
        if self.texels > MAX_TEXELS {
            return Err(ImportError::TooMany {
                what: "texels in the label textures of its objects",
                limit: MAX_TEXELS,
            });
        }
        Ok(())
    }
}

/// A part whose face indices are in range and whose used vertices are finite, in metres east, north, up.
struct Checked {
    name: String,
    vertices: Vec<[f64; 3]>,
    is_used: Vec<bool>,
    uvs: Vec<Option<[f32; 2]>>,
    triangles: Vec<[u32; 3]>,
    triangle_materials: Vec<usize>,
}

/// Vertices around a near origin.
struct Offsets {
    /// From the model's origin to the near one, whole metres.
    shift: [f64; 3],
    /// One per vertex; zero where no face uses it.
    offsets: Vec<[f32; 3]>,
}

impl Checked {
    fn new(part: Part, placement: &Placement) -> Result<Self, ImportError> {
        let Part { name, mut vertices, uvs, triangles, triangle_materials } = part;
        let mut is_used = vec![false; vertices.len()];
        for (face, corners) in triangles.iter().enumerate() {
            for &index in corners {
                let vertices = vertices.len();
                let object = || name.clone();
                let used = is_used.get_mut(index as usize);
                *used.ok_or_else(|| ImportError::VertexIndex { object: object(), face, index, vertices })? = true;
            }
        }
        for (index, vertex) in vertices.iter_mut().enumerate().filter(|(index, _)| is_used[*index]) {
            let placed = placement.grid_from_file(*vertex);
            if !placed.iter().all(|value| value.abs() <= MAX_COORDINATE_M) {
                let found = format!("{vertex:?}");
                return Err(ImportError::Coordinate { object: name, vertex: index, found, limit_m: MAX_COORDINATE_M });
            }
            *vertex = placed;
        }
        Ok(Self { name, vertices, is_used, uvs, triangles, triangle_materials })
    }

    /// The middle of the used vertices in whole metres, and every vertex relative to it; `None` without used vertices.
    fn offsets(&self) -> Result<Option<Offsets>, ImportError> {
        let used = || self.vertices.iter().zip(&self.is_used).filter(|(_, used)| **used).map(|(vertex, _)| *vertex);
        let (mut low, mut high) = match used().next() {
            Some(first) => (first, first),
            None => return Ok(None),
        };
        for vertex in used() {
            for axis in 0..3 {
                low[axis] = low[axis].min(vertex[axis]);
                high[axis] = high[axis].max(vertex[axis]);
            }
        }
        // Whole metres leave the fraction of every coordinate as it is.
        let middle: [f64; 3] = std::array::from_fn(|axis| ((low[axis] + high[axis]) / 2.0).round());
        let too_large = || ImportError::ObjectTooLarge {
            object: self.name.clone(),
            size_m: std::array::from_fn(|axis| high[axis] - low[axis]),
            limit_m: 2.0 * LOCAL_LIMIT_M,
        };
        let near = LocalOrigin::new(middle.into()).map_err(|_| too_large())?;
        let offset = |(vertex, is_used): (&[f64; 3], &bool)| match is_used {
            true => near.to_local((*vertex).into()).map_err(|_| too_large()),
            false => Ok([0.0; 3]),
        };
        let offsets = self.vertices.iter().zip(&self.is_used).map(offset).collect::<Result<_, _>>()?;
        Ok(Some(Offsets { shift: middle, offsets }))
    }

    /// Fills `mesh` with the kept faces and only the vertices that they use, in the order of the file.
    fn fill(
        &self,
        is_kept: &[bool],
        surface_of_material: &BTreeMap<usize, u16>,
        offsets: &[[f32; 3]],
        mesh: &mut Mesh,
    ) -> Result<(), ImportError> {
        let kept =
            || self.triangles.iter().zip(&self.triangle_materials).enumerate().filter(|(face, _)| is_kept[*face]);
        let has_textures = mesh.surfaces.iter().any(|surface| matches!(surface, Surface::Texture(_)));
        let mut new_index = vec![None; offsets.len()];
        for (_, (corners, _)) in kept() {
            for &corner in corners {
                new_index[corner as usize] = Some(0);
            }
        }
        for (old, slot) in new_index.iter_mut().enumerate().filter(|(_, slot)| slot.is_some()) {
            *slot = Some(mesh.vertices.len() as u32);
            mesh.vertices.push(offsets[old]);
            if has_textures {
                let uv = self.uvs[old].filter(|uv| uv.iter().all(|value| value.is_finite()));
                mesh.uvs.push(uv.unwrap_or_default());
            }
        }
        for (face, (corners, &material)) in kept() {
            let surface = surface_of_material[&material];
            if matches!(mesh.surfaces[usize::from(surface)], Surface::Texture(_)) {
                let is_bare = |corner: &&u32| self.uvs[**corner as usize].is_none_or(|[u, v]| !(u + v).is_finite());
                if let Some(&vertex) = corners.iter().find(is_bare) {
                    return Err(ImportError::NoTextureCoordinates { object: self.name.clone(), face, vertex });
                }
            }
            let new = |corner: u32| new_index[corner as usize].expect("invariant: vertices of kept faces are numbered");
            mesh.triangles.push(corners.map(new));
            mesh.triangle_surfaces.push(surface);
        }
        Ok(())
    }
}

fn area_m2(corners: &[u32; 3], offsets: &[[f32; 3]]) -> f64 {
    let [a, b, c] = corners.map(|corner| nalgebra::Vector3::from(offsets[corner as usize].map(f64::from)));
    (b - a).cross(&(c - a)).norm() / 2.0
}
