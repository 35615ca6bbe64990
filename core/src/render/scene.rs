//! The triangles of the map around a local origin: what the rasteriser and the rays see.

use super::clip::{Corner, within_reach};
use super::code::{Code, MOST_TRIANGLES};
use super::hierarchy::Hierarchy;
use super::plate;
use crate::crs::{LOCAL_LIMIT_M, LocalOrigin};
use crate::mesh::{Mesh, Object, Surface};
use nalgebra::Vector3;
use resurvey_schema::service::ViewFeature;
use resurvey_schema::{ClassId, ClassTable, Descriptor, GridPoint};
use std::ops::Range;

/// Triangles in a cluster: small enough to be rejected whole, large enough that its box is cheap.
const CLUSTER_TRIANGLES: usize = 32;

/// Texture coordinates stay this share of a triangle's range inside it: rounding at the rim does not wrap round to the
/// other side of the texture.
const UV_INSET: f64 = 1e-6;

/// The base map with descriptors on it, as f32 offsets from a local origin.
#[derive(Clone, Debug)]
pub struct Scene {
    origin: GridPoint,
    positions: Vec<[[f32; 3]; 3]>,
    uvs: Vec<[[f32; 2]; 3]>,
    surface_indices: Vec<u32>,
    codes: Vec<Code>,
    features: Vec<u32>,
    surfaces: Vec<Surface>,
    clusters: Vec<Cluster>,
    hierarchy: Hierarchy,
    objects: Vec<SceneObject>,
    feature_table: Vec<ViewFeature>,
    sky: ClassId,
}

/// An object of the base map and its triangles.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneObject {
    /// Feature id in the map.
    pub fid: u64,
    /// Its triangles in the scene.
    pub triangles: Range<usize>,
}

/// Consecutive triangles and the box around them, offsets from the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// Its triangles in the scene.
    pub triangles: Range<usize>,
    /// Smallest E, N, H.
    pub min: [f32; 3],
    /// Largest E, N, H.
    pub max: [f32; 3],
}

impl Scene {
    /// A scene around `origin`, which should lie near the cameras: what is more than 2048 m from it along an axis is cut
    /// off, and offsets are exact to 0.12 mm.
    /// Triangles beyond 268 million are left out.
    /// Descriptors appear in the feature table in the order given, and later ones lie on top of earlier ones; without
    /// descriptors it is the base map alone. Sky is the class of that name in `classes`, void where there is none.
    pub fn new(
        origin: GridPoint,
        objects: &[(u64, &Object)],
        descriptors: &[(u64, Descriptor)],
        classes: &ClassTable,
    ) -> Self {
        let mut scene = Self {
            origin,
            positions: Vec::new(),
            uvs: Vec::new(),
            surface_indices: Vec::new(),
            codes: Vec::new(),
            features: Vec::new(),
            surfaces: Vec::new(),
            clusters: Vec::new(),
            hierarchy: Hierarchy::default(),
            objects: Vec::new(),
            feature_table: Vec::new(),
            sky: classes.by_name("sky").map_or(ClassId::VOID, |class| class.index),
        };
        for (fid, object) in objects {
            scene.add_object(*fid, &object.mesh);
        }
        for (fid, descriptor) in descriptors {
            scene.add_descriptor(*fid, descriptor);
        }
        scene.hierarchy = Hierarchy::new(&scene.clusters);
        scene
    }

    /// Where offsets start.
    pub fn origin(&self) -> GridPoint {
        self.origin
    }

    /// Corners of every triangle, offsets from the origin, E, N, H, metres.
    pub fn positions(&self) -> &[[[f32; 3]; 3]] {
        &self.positions
    }

    /// Texture coordinates of the corners of every triangle; without meaning where its surface has no texture.
    pub fn uvs(&self) -> &[[[f32; 2]; 3]] {
        &self.uvs
    }

    /// What `triangle` is made of; panics outside.
    pub fn surface(&self, triangle: usize) -> &Surface {
        &self.surfaces[self.surface_indices[triangle] as usize]
    }

    /// Codes of the triangles.
    pub(super) fn codes(&self) -> &[Code] {
        &self.codes
    }

    /// Class of `triangle` at texture coordinates `uv`; panics outside the triangles.
    pub fn class_at(&self, triangle: usize, [u, v]: [f32; 2]) -> ClassId {
        match self.surface(triangle) {
            Surface::Class(class) => *class,
            Surface::Texture(texture) => super::texel_class(texture, u, v),
        }
    }

    /// Texture coordinates at an offset on `triangle`, held inside the triangle's own range; panics outside the
    /// triangles.
    pub fn uv_at(&self, triangle: usize, offset: [f64; 3]) -> [f32; 2] {
        let uvs = &self.uvs[triangle];
        let [a, b, c] = self.positions[triangle].map(|corner| Vector3::from(corner.map(f64::from)));
        let normal = (b - a).cross(&(c - a));
        let area = normal.norm_squared();
        if area < f64::MIN_POSITIVE {
            return uvs[0];
        }
        let point = Vector3::from(offset);
        let weight = |from: &Vector3<f64>, to: &Vector3<f64>| (to - from).cross(&(point - from)).dot(&normal) / area;
        let weights = [weight(&b, &c), weight(&c, &a), weight(&a, &b)];
        std::array::from_fn(|axis| {
            let at_corners = [0, 1, 2].map(|corner| f64::from(uvs[corner][axis]));
            let [low, high] =
                [at_corners.iter().copied().reduce(f64::min), at_corners.iter().copied().reduce(f64::max)];
            let (low, high) = (low.unwrap_or_default(), high.unwrap_or_default());
            let inset = (high - low) * UV_INSET;
            let interpolated: f64 = (0..3).map(|corner| weights[corner] * at_corners[corner]).sum();
            interpolated.max(low + inset).min(high - inset) as f32
        })
    }

    /// 0 for a triangle of the base map, otherwise 1 + index into the feature table; panics outside.
    pub fn feature(&self, triangle: usize) -> u32 {
        self.features[triangle]
    }

    /// The descriptors of the scene.
    pub fn feature_table(&self) -> &[ViewFeature] {
        &self.feature_table
    }

    /// Boxes around consecutive triangles; together they hold every triangle once, in order.
    pub fn clusters(&self) -> &[Cluster] {
        &self.clusters
    }

    /// The hierarchy of boxes over the clusters.
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }

    /// The objects of the base map.
    pub fn objects(&self) -> &[SceneObject] {
        &self.objects
    }

    /// Class of a pixel whose ray hits nothing.
    pub fn sky(&self) -> ClassId {
        self.sky
    }

    /// Offset of a grid point, metres.
    pub fn offset(&self, point: GridPoint) -> [f64; 3] {
        [
            point.easting_m - self.origin.easting_m,
            point.northing_m - self.origin.northing_m,
            point.height_m - self.origin.height_m,
        ]
    }

    /// The grid point at an offset.
    pub fn point(&self, [east, north, up]: [f64; 3]) -> GridPoint {
        GridPoint::new(self.origin.easting_m + east, self.origin.northing_m + north, self.origin.height_m + up)
    }

    fn add_object(&mut self, fid: u64, mesh: &Mesh) {
        let start = self.positions.len();
        let first_surface = self.surfaces.len() as u32;
        self.surfaces.extend(mesh.surfaces.iter().cloned());
        let offsets: Vec<[f64; 3]> = {
            let start = self.offset(mesh.origin);
            let from_start = |vertex: &[f32; 3]| std::array::from_fn(|axis| start[axis] + f64::from(vertex[axis]));
            mesh.vertices.iter().map(from_start).collect()
        };
        for (triangle, &surface) in mesh.triangles.iter().zip(&mesh.triangle_surfaces) {
            let corner = |vertex: u32| Corner { offset: offsets[vertex as usize], uv: uv_of(mesh, vertex as usize) };
            self.add_triangle(triangle.map(corner), first_surface + u32::from(surface), 0);
        }
        self.objects.push(SceneObject { fid, triangles: start..self.positions.len() });
        self.add_clusters(start);
    }

    fn add_descriptor(&mut self, fid: u64, descriptor: &Descriptor) {
        self.feature_table.push(ViewFeature { fid, class: descriptor.class() });
        let feature = self.feature_table.len() as u32;
        let start = self.positions.len();
        let triangles = match descriptor {
            Descriptor::Material(material) => plate::on_wall(self, material),
            Descriptor::Dynamic(dynamic) => plate::block(self, dynamic),
        };
        let surface = self.surfaces.len() as u32;
        self.surfaces.push(Surface::Class(descriptor.class()));
        for triangle in triangles {
            self.add_triangle(triangle.map(|offset| Corner { offset, uv: [0.0; 2] }), surface, feature);
        }
        self.add_clusters(start);
    }

    /// Adds the part of a triangle within 2048 m of the origin; one with a coordinate that is not a number is nowhere.
    fn add_triangle(&mut self, corners: [Corner; 3], surface: u32, feature: u32) {
        if corners.iter().flat_map(|corner| &corner.offset).all(|value| value.abs() <= LOCAL_LIMIT_M) {
            self.push(corners, surface, feature);
        } else {
            within_reach(corners).into_iter().for_each(|part| self.push(part, surface, feature));
        }
    }

    fn push(&mut self, corners: [Corner; 3], surface: u32, feature: u32) {
        // Fails for an origin that is not finite, around which there is nothing.
        let Ok(origin) = LocalOrigin::new(self.origin) else { return };
        let [Ok(a), Ok(b), Ok(c)] = corners.map(|corner| origin.to_local(origin.at(corner.offset))) else { return };
        if self.positions.len() >= MOST_TRIANGLES {
            return;
        }
        self.codes.push(Code::of_triangle(self.positions.len(), &self.surfaces[surface as usize]));
        self.positions.push([a, b, c]);
        self.uvs.push(corners.map(|corner| corner.uv.map(|value| value as f32)));
        self.surface_indices.push(surface);
        self.features.push(feature);
    }

    fn add_clusters(&mut self, start: usize) {
        for first in (start..self.positions.len()).step_by(CLUSTER_TRIANGLES) {
            let triangles = first..(first + CLUSTER_TRIANGLES).min(self.positions.len());
            let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
            for corner in self.positions[triangles.clone()].iter().flatten() {
                for axis in 0..3 {
                    min[axis] = min[axis].min(corner[axis]);
                    max[axis] = max[axis].max(corner[axis]);
                }
            }
            self.clusters.push(Cluster { triangles, min, max });
        }
    }
}

fn uv_of(mesh: &Mesh, vertex: usize) -> [f64; 2] {
    mesh.uvs.get(vertex).copied().unwrap_or_default().map(f64::from)
}
