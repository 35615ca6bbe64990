//! What a feature is at a version: an object of the model, or a descriptor.

use super::{BoxMm, Digest, InvalidBox};
use nalgebra::{Point3, Vector3};
use resurvey_schema::{
    ClassId, ClassKind, ClassTable, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Uncertainty,
};

/// The state of one feature.
#[derive(Clone, Debug, PartialEq)]
pub enum FeatureState {
    /// A thing of the imported model.
    Object {
        /// Name in the source; not unique.
        name: String,
        /// Digest of its geometry.
        geometry: Digest,
        /// Box around its geometry.
        bounds: BoxMm,
    },
    /// Something a photo or a change set put on the map.
    Descriptor(Descriptor),
}

/// Why a state cannot be in a map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidState {
    /// Not in the map's class table.
    #[error("class {} is not in the map's class table", .0.0)]
    UnknownClass(ClassId),
    /// A class of another kind.
    #[error("class {class:?} is {found:?}; a {expected:?} descriptor needs a class of its own kind")]
    WrongKind {
        /// Name of the class.
        class: String,
        /// Kind of the descriptor.
        expected: ClassKind,
        /// Kind of the class.
        found: ClassKind,
    },
    /// A number that is not finite, or not positive where it has to be.
    #[error("{quantity} is {value}; expected a finite number{}", if *positive { " above zero" } else { "" })]
    BadNumber {
        /// What it stands for.
        quantity: &'static str,
        /// What was found.
        value: f64,
        /// Whether it must be above zero.
        positive: bool,
    },
    /// A normal that is not of length one.
    #[error("the normal has length {length}; expected 1")]
    NotUnit {
        /// What was found.
        length: f64,
    },
    /// Corners out of order, folded, or without area.
    #[error(
        "corner {corner} (of 0…3) does not turn left as seen from outside; expected bottom-left, bottom-right, top-right, top-left"
    )]
    CornerOrder {
        /// Index of the first such corner.
        corner: usize,
    },
    /// Corners off their plane.
    #[error("corner {corner} (of 0…3) is {distance_m:.3} m off the plane of the four; the limit is {limit_m:.3} m")]
    NotPlane {
        /// Index of the furthest corner.
        corner: usize,
        /// Its distance, metres.
        distance_m: f64,
        /// The limit, metres.
        limit_m: f64,
    },
    /// Beyond any map.
    #[error(transparent)]
    Box(#[from] InvalidBox),
}

/// A unit normal is this near length 1: what twelve decimal digits keep.
pub(crate) const UNIT_TOLERANCE: f64 = 1e-9;
/// Corners may be this far off their plane, metres (as the coplanarity requirement of the estimator) …
const PLANE_LIMIT_M: f64 = 0.10;
/// … or this share of the diagonal, whichever is more.
const PLANE_LIMIT_SHARE: f64 = 0.02;
/// Headings this near are the same: a heading goes through degrees in files, which is not exact to the last bit.
const SAME_YAW_RAD: f64 = 1e-9;

impl FeatureState {
    /// The smallest box around it; around the whole turning circle of a dynamic descriptor.
    pub fn bounds(&self) -> Result<BoxMm, InvalidBox> {
        match self {
            Self::Object { bounds, .. } => Ok(*bounds),
            Self::Descriptor(Descriptor::Material(material)) => BoxMm::around(material.corners),
            Self::Descriptor(Descriptor::Dynamic(dynamic)) => {
                let [along, across, up] = dynamic.size_m;
                let radius = (along * along + across * across).sqrt() / 2.0;
                let GridPoint { easting_m: e, northing_m: n, height_m: h } = dynamic.position;
                BoxMm::new(GridPoint::new(e - radius, n - radius, h), GridPoint::new(e + radius, n + radius, h + up))
            }
        }
    }

    /// Its class, when it is a descriptor.
    pub fn class(&self) -> Option<ClassId> {
        match self {
            Self::Object { .. } => None,
            Self::Descriptor(descriptor) => Some(descriptor.class()),
        }
    }

    /// Digest of its geometry, when it is an object.
    pub fn geometry(&self) -> Option<Digest> {
        match self {
            Self::Object { geometry, .. } => Some(*geometry),
            Self::Descriptor(_) => None,
        }
    }

    /// `object`, `material` or `dynamic`.
    pub fn kind_name(&self) -> &'static str {
        match self {
            Self::Object { .. } => "object",
            Self::Descriptor(Descriptor::Material(_)) => "material",
            Self::Descriptor(Descriptor::Dynamic(_)) => "dynamic",
        }
    }

    /// Whether it is `other`: exactly so, but for a heading that went through degrees.
    pub fn is_same_as(&self, other: &Self) -> bool {
        let (Self::Descriptor(Descriptor::Dynamic(a)), Self::Descriptor(Descriptor::Dynamic(b))) = (self, other) else {
            return self == other;
        };
        let same_yaw = match (a.yaw_rad, b.yaw_rad) {
            (Some(a), Some(b)) => (a - b).abs() <= SAME_YAW_RAD,
            (a, b) => a.is_none() && b.is_none(),
        };
        same_yaw && DynamicDescriptor { yaw_rad: b.yaw_rad, ..a.clone() } == *b
    }

    /// Checks what must hold for every state in a map with `classes`.
    pub fn validate(&self, classes: &ClassTable) -> Result<(), InvalidState> {
        self.bounds()?;
        let Self::Descriptor(descriptor) = self else { return Ok(()) };
        let expected = match descriptor {
            Descriptor::Material(_) => ClassKind::Material,
            Descriptor::Dynamic(_) => ClassKind::Dynamic,
        };
        let class = classes.get(descriptor.class()).ok_or(InvalidState::UnknownClass(descriptor.class()))?;
        if class.kind != expected {
            return Err(InvalidState::WrongKind { class: class.name.clone(), expected, found: class.kind });
        }
        if let Some(sigma) = descriptor.sigma() {
            check_sigma(&sigma)?;
        }
        match descriptor {
            Descriptor::Material(material) => check_material(material),
            Descriptor::Dynamic(dynamic) => check_dynamic(dynamic),
        }
    }
}

fn finite(quantity: &'static str, value: f64) -> Result<(), InvalidState> {
    value.is_finite().then_some(()).ok_or(InvalidState::BadNumber { quantity, value, positive: false })
}

fn check_sigma(sigma: &Uncertainty) -> Result<(), InvalidState> {
    for (quantity, value) in
        [("sigma_m", Some(sigma.position_m)), ("sigma_size_m", sigma.size_m), ("sigma_area_m2", sigma.area_m2)]
    {
        let Some(value) = value else { continue };
        finite(quantity, value)?;
        if value < 0.0 {
            return Err(InvalidState::BadNumber { quantity, value, positive: true });
        }
    }
    Ok(())
}

fn check_dynamic(dynamic: &DynamicDescriptor) -> Result<(), InvalidState> {
    for value in dynamic.size_m {
        if !(value.is_finite() && value > 0.0) {
            return Err(InvalidState::BadNumber { quantity: "size_m", value, positive: true });
        }
    }
    dynamic.yaw_rad.map_or(Ok(()), |yaw| finite("yaw", yaw))
}

fn check_material(material: &MaterialDescriptor) -> Result<(), InvalidState> {
    let normal = Vector3::from(material.normal);
    let length = normal.norm();
    if length.is_nan() || (length - 1.0).abs() > UNIT_TOLERANCE {
        return Err(InvalidState::NotUnit { length });
    }
    let corners = material.corners.map(|corner| Point3::from(<[f64; 3]>::from(corner)));
    check_plane(&corners)?;
    for (corner, _) in corners.iter().enumerate() {
        let [previous, this, next] = [3, 0, 1].map(|step| corners[(corner + step) % 4]);
        if (this - previous).cross(&(next - this)).dot(&normal) <= 0.0 {
            return Err(InvalidState::CornerOrder { corner });
        }
    }
    Ok(())
}

fn check_plane(corners: &[Point3<f64>; 4]) -> Result<(), InvalidState> {
    let Some(normal) = quad_normal(corners) else { return Err(InvalidState::CornerOrder { corner: 0 }) };
    let diagonal = (corners[2] - corners[0]).norm().max((corners[3] - corners[1]).norm());
    let limit_m = PLANE_LIMIT_M.max(PLANE_LIMIT_SHARE * diagonal);
    let centre = Point3::from(corners.iter().map(|corner| corner.coords).sum::<Vector3<f64>>() / 4.0);
    for (corner, point) in corners.iter().enumerate() {
        let distance_m = (point - centre).dot(&normal).abs();
        if distance_m > limit_m {
            return Err(InvalidState::NotPlane { corner, distance_m, limit_m });
        }
    }
    Ok(())
}

/// Unit normal of the quadrilateral, towards those who see its corners turn left; `None` when it has no area.
pub(super) fn quad_normal(corners: &[Point3<f64>; 4]) -> Option<Vector3<f64>> {
    let [a, b, c, d] = corners;
    (c - a).cross(&(d - b)).try_normalize(f64::MIN_POSITIVE)
}
