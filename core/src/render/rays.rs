//! Single rays and nearest surfaces, through parry's bounding volume hierarchy; images go through the rasteriser.

use super::scene::Scene;
use nalgebra::Vector3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::{CompositeShapeRef, TriMesh};
use resurvey_schema::{ClassId, GridPoint};

/// How far below a point its ground is looked for, metres.
const GROUND_REACH_M: f64 = 1000.0;

/// Stands for a limit that is not finite, metres.
const UNLIMITED_M: f64 = 1e7;

/// Rays into a scene. Built once per scene (about half a second per million triangles); surfaces are two-sided.
pub struct RayCaster<'a> {
    scene: &'a Scene,
    /// `None` for a scene without triangles.
    mesh: Option<TriMesh>,
}

/// What a ray met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where.
    pub point: GridPoint,
    /// Distance along the ray, metres.
    pub range_m: f64,
    /// Unit normal of the surface on the side the ray came from: E, N, H.
    pub normal: [f64; 3],
    /// Class there.
    pub class: ClassId,
    /// 0 for the base map, otherwise 1 + index into the scene's feature table.
    pub feature: u32,
    /// Index of the triangle in the scene.
    pub triangle: u32,
}

/// The surface nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Its nearest point.
    pub point: GridPoint,
    /// How far that is, metres.
    pub distance_m: f64,
    /// Class there.
    pub class: ClassId,
    /// 0 for the base map, otherwise 1 + index into the scene's feature table.
    pub feature: u32,
    /// Index of the triangle in the scene.
    pub triangle: u32,
}

impl<'a> RayCaster<'a> {
    /// A caster into `scene`.
    pub fn new(scene: &'a Scene) -> Self {
        let corner = |corner: &[f32; 3]| Vector::from(corner.map(f64::from));
        let corners: Vec<Vector> = scene.positions().iter().flatten().map(corner).collect();
        let triangles =
            (0..scene.positions().len() as u32).map(|triangle| [0, 1, 2].map(|k| triangle * 3 + k)).collect();
        Self { scene, mesh: TriMesh::new(corners, triangles).ok() }
    }

    /// The first surface from `origin` along `direction` within `limit_m`; the direction need not be a unit vector.
    /// `None` where there is none, and for a direction without length or with a coordinate that is not finite.
    pub fn cast(&self, origin: GridPoint, direction: [f64; 3], limit_m: f64) -> Option<Hit> {
        self.cast_at(origin, direction, limit_m, |_| true)
    }

    /// The surface of the base map straight below `point`, within 1000 m; descriptors are looked through.
    pub fn ground_below(&self, point: GridPoint) -> Option<Hit> {
        self.cast_at(point, [0.0, 0.0, -1.0], GROUND_REACH_M, |triangle| self.scene.feature(triangle as usize) == 0)
    }

    /// Whether nothing lies between two points; surfaces within 0.1 mm of either do not count.
    pub fn sees(&self, from: GridPoint, to: GridPoint) -> bool {
        const END_M: f64 = 1e-4;
        let (start, end) = (Vector3::from(self.scene.offset(from)), Vector3::from(self.scene.offset(to)));
        let Some(direction) = (end - start).try_normalize(1e-12) else { return true };
        let origin = self.scene.point((start + direction * END_M).into());
        let length_m = (end - start).norm() - 2.0 * END_M;
        length_m <= 0.0 || self.cast(origin, direction.into(), length_m).is_none()
    }

    /// The surface nearest to `point` within `limit_m`.
    pub fn nearest_surface(&self, point: GridPoint, limit_m: f64) -> Option<Nearest> {
        let from = Vector3::from(self.scene.offset(point));
        if !from.iter().all(|value| value.is_finite()) {
            return None;
        }
        let mesh = self.mesh.as_ref()?;
        let (triangle, projection) =
            CompositeShapeRef(mesh).project_local_point(to_parry(from), limit_m.min(UNLIMITED_M), false)?;
        let found = Vector3::new(projection.point.x, projection.point.y, projection.point.z);
        Some(Nearest {
            point: self.scene.point(found.into()),
            distance_m: (found - from).norm(),
            class: self.class_at(triangle, found),
            feature: self.scene.feature(triangle as usize),
            triangle,
        })
    }

    fn cast_at(
        &self,
        origin: GridPoint,
        direction: [f64; 3],
        limit_m: f64,
        counts: impl Fn(u32) -> bool,
    ) -> Option<Hit> {
        let direction = Vector3::from(direction).try_normalize(1e-12).filter(|d| d.iter().all(|x| x.is_finite()))?;
        let start = Vector3::from(self.scene.offset(origin));
        if !start.iter().all(|value| value.is_finite()) {
            return None;
        }
        let mesh = self.mesh.as_ref()?;
        let ray = Ray::new(to_parry(start), to_parry(direction));
        let (triangle, range_m) = mesh.bvh().cast_ray(&ray, limit_m.min(UNLIMITED_M), |triangle, nearest_m| {
            if counts(triangle) { mesh.triangle(triangle).cast_local_ray(&ray, nearest_m, false) } else { None }
        })?;
        let [a, b, c] = self.scene.positions()[triangle as usize].map(|corner| Vector3::from(corner.map(f64::from)));
        let normal = (b - a).cross(&(c - a)).normalize();
        let toward = if normal.dot(&direction) > 0.0 { -normal } else { normal };
        let point = start + direction * range_m;
        (range_m <= limit_m).then(|| Hit {
            point: self.scene.point(point.into()),
            range_m,
            normal: toward.into(),
            class: self.class_at(triangle, point),
            feature: self.scene.feature(triangle as usize),
            triangle,
        })
    }

    fn class_at(&self, triangle: u32, point: Vector3<f64>) -> ClassId {
        self.scene.class_at(triangle as usize, self.scene.uv_at(triangle as usize, point.into()))
    }
}

fn to_parry(vector: Vector3<f64>) -> Vector {
    Vector::new(vector.x, vector.y, vector.z)
}
