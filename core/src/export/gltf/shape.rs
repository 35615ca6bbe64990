//! Surfaces of objects and bodies of descriptors as triangles of their own, in grid coordinates.

use super::super::ExportError;
use crate::crs::{GridPoint, LocalOrigin};
use crate::mesh::{Mesh, Object, Surface};
use resurvey_schema::{Descriptor, DynamicDescriptor};

/// Triangles of one surface, with only the vertices they use.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    pub(super) vertices: Vec<GridPoint>,
    /// One per vertex, or empty.
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// One shape per surface of `object` that has triangles, in the order of the surfaces.
pub(super) fn shapes_of_object(fid: u64, object: &Object) -> Result<Vec<(&Surface, Shape)>, ExportError> {
    let mesh = &object.mesh;
    let invalid =
        |expected: String, found: String| Err(ExportError::Mesh { fid, name: object.name.clone(), expected, found });
    if mesh.triangle_surfaces.len() != mesh.triangles.len() {
        let expected = format!("a surface for each of {} triangles", mesh.triangles.len());
        return invalid(expected, mesh.triangle_surfaces.len().to_string());
    }
    let mut triangles_by_surface = vec![Vec::new(); mesh.surfaces.len()];
    for (triangle, &surface) in mesh.triangles.iter().zip(&mesh.triangle_surfaces) {
        if let Some(corner) = triangle.iter().find(|&&corner| corner as usize >= mesh.vertices.len()) {
            return invalid(format!("vertex indices below {}", mesh.vertices.len()), corner.to_string());
        }
        match triangles_by_surface.get_mut(usize::from(surface)) {
            Some(triangles) => triangles.push(*triangle),
            None => return invalid(format!("surface indices below {}", mesh.surfaces.len()), surface.to_string()),
        }
    }
    let textured = mesh.surfaces.iter().any(|surface| matches!(surface, Surface::Texture(_)));
    if textured && mesh.uvs.len() != mesh.vertices.len() {
        let expected = format!("texture coordinates for each of {} vertices", mesh.vertices.len());
        return invalid(expected, mesh.uvs.len().to_string());
    }
    if let Some(uv) = mesh.uvs.iter().flatten().find(|coordinate| !coordinate.is_finite()) {
        return invalid("finite texture coordinates".to_owned(), uv.to_string());
    }
    let origin = LocalOrigin::new(mesh.origin).map_err(|source| ExportError::Position { fid, source })?;
    Ok(mesh
        .surfaces
        .iter()
        .zip(triangles_by_surface)
        .filter(|(_, triangles)| !triangles.is_empty())
        .map(|(surface, triangles)| {
            (surface, compact(mesh, &origin, &triangles, matches!(surface, Surface::Texture(_))))
        })
        .collect())
}

/// The vertices that `triangles` use, in the order of first use. Indices were checked.
fn compact(mesh: &Mesh, origin: &LocalOrigin, triangles: &[[u32; 3]], textured: bool) -> Shape {
    const UNSEEN: u32 = u32::MAX;
    let mut renumbered = vec![UNSEEN; mesh.vertices.len()];
    let mut shape = Shape::default();
    for triangle in triangles {
        let corners = triangle.map(|corner| {
            let vertex = corner as usize;
            if renumbered[vertex] == UNSEEN {
                renumbered[vertex] = shape.vertices.len() as u32;
                shape.vertices.push(origin.to_grid(mesh.vertices[vertex]));
                if textured {
                    shape.uvs.push(mesh.uvs[vertex]);
                }
            }
            renumbered[vertex]
        });
        shape.triangles.push(corners);
    }
    shape
}

/// The exact rectangle of a material descriptor, facing outwards; the box of a dynamic one on its ground contact.
pub(super) fn shape_of_descriptor(descriptor: &Descriptor) -> Shape {
    match descriptor {
        Descriptor::Material(material) => {
            let drawn = material.corners.map(|corner| lifted(corner, &material.normal));
            Shape { vertices: drawn.to_vec(), uvs: Vec::new(), triangles: vec![[0, 1, 2], [0, 2, 3]] }
        }
        Descriptor::Dynamic(dynamic) => shape_of_box(dynamic),
    }
}

/// How far a rectangle is drawn in front of its corners, metres: they lie on the wall, and a viewer shows two surfaces in
/// one place as a flicker of both. The corners themselves stand in the extras.
pub(super) const DRAWN_OFF_M: f64 = 0.02;

fn lifted(corner: GridPoint, normal: &[f64; 3]) -> GridPoint {
    GridPoint::new(
        corner.easting_m + DRAWN_OFF_M * normal[0],
        corner.northing_m + DRAWN_OFF_M * normal[1],
        corner.height_m + DRAWN_OFF_M * normal[2],
    )
}

/// Eight corners, twelve triangles that face outwards. Without a heading the box stands along the grid.
fn shape_of_box(dynamic: &DynamicDescriptor) -> Shape {
    let [along_m, across_m, up_m] = dynamic.size_m;
    let (sin, cos) = dynamic.yaw_rad.unwrap_or(0.0).sin_cos();
    let corner = |right: f64, ahead: f64, above: f64| {
        let (right_m, ahead_m) = (right * across_m / 2.0, ahead * along_m / 2.0);
        GridPoint::new(
            dynamic.position.easting_m + right_m * cos + ahead_m * sin,
            dynamic.position.northing_m - right_m * sin + ahead_m * cos,
            dynamic.position.height_m + above * up_m,
        )
    };
    let ring = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let vertices = [0.0, 1.0].into_iter().flat_map(|above| ring.map(|(right, ahead)| corner(right, ahead, above)));
    let sides = (0..4_u32).flat_map(|i| {
        let next = (i + 1) % 4;
        [[i, next, next + 4], [i, next + 4, i + 4]]
    });
    let ends = [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
    Shape { vertices: vertices.collect(), uvs: Vec::new(), triangles: sides.chain(ends).collect() }
}
