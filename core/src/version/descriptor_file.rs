//! A descriptor as JSON has it, and the checks at that door.

use super::feature_state::quad_normal;
use super::{FeatureState, InvalidState};
use nalgebra::{Point3, Vector3};
use resurvey_schema::changes::DescriptorFile;
use resurvey_schema::{ClassTable, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Uncertainty};

/// Why a JSON descriptor is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidDescriptor {
    /// Not in the class table.
    #[error("class {found:?} is not in the map's class table; expected one of {}", known.join(", "))]
    UnknownClass {
        /// What was found.
        found: String,
        /// Names in the table.
        known: Vec<String>,
    },
    /// Both or neither of the two keys.
    #[error("expected either \"corners\" (material) or \"position\" (dynamic), found {0}")]
    Kind(&'static str),
    /// A key of the other kind of descriptor.
    #[error("{key:?} does not belong to a {kind} descriptor")]
    ForeignKey {
        /// The key.
        key: &'static str,
        /// The kind.
        kind: &'static str,
    },
    /// A class without a predefined size, and no `size_m`.
    #[error("class {0:?} has no predefined size; give \"size_m\"")]
    NoSize(String),
    /// `sigma_size_m` or `sigma_area_m2` alone.
    #[error("\"sigma_size_m\" and \"sigma_area_m2\" need \"sigma_m\"")]
    NoSigma,
    /// A value that no map takes.
    #[error(transparent)]
    State(#[from] InvalidState),
}

/// A given normal whose length is this near 1 is rounded, not wrong, and is made a unit normal.
const ROUNDED_NORMAL: f64 = 1e-3;
/// A given normal whose length is this near 1 is kept to the last bit, so that files come back unchanged.
const EXACT_NORMAL: f64 = 1e-12;

/// The descriptor in `file`, with its normal computed from the order of the corners, and its size taken from its class,
/// where `file` does not give them. Derived keys are ignored.
pub fn descriptor_from_file(file: &DescriptorFile, classes: &ClassTable) -> Result<Descriptor, InvalidDescriptor> {
    let class = classes.by_name(&file.class).ok_or_else(|| InvalidDescriptor::UnknownClass {
        found: file.class.clone(),
        known: classes.iter().map(|class| class.name.clone()).collect(),
    })?;
    let sigma = sigma_from_file(file)?;
    let descriptor = match (file.corners, file.position) {
        (Some(corners), None) => {
            refuse_keys("material", &[("size_m", file.size_m.is_some()), ("yaw_deg", file.yaw_deg.is_some())])?;
            let normal = normal_from_file(file, &corners)?;
            Descriptor::Material(MaterialDescriptor { class: class.index, corners, normal, sigma })
        }
        (None, Some(position)) => {
            refuse_keys("dynamic", &[("normal", file.normal.is_some())])?;
            let size_m = file.size_m.or(class.size_m).ok_or_else(|| InvalidDescriptor::NoSize(class.name.clone()))?;
            let yaw_rad = file.yaw_deg.map(f64::to_radians);
            Descriptor::Dynamic(DynamicDescriptor { class: class.index, position, size_m, yaw_rad, sigma })
        }
        (Some(_), Some(_)) => return Err(InvalidDescriptor::Kind("both")),
        (None, None) => return Err(InvalidDescriptor::Kind("neither")),
    };
    FeatureState::Descriptor(descriptor.clone()).validate(classes)?;
    Ok(descriptor)
}

/// `descriptor` as JSON, with the derived keys for readers.
pub fn descriptor_to_file(descriptor: &Descriptor, classes: &ClassTable) -> DescriptorFile {
    let sigma = descriptor.sigma();
    let mut file = DescriptorFile {
        class: classes.name(descriptor.class()).to_owned(),
        corners: None,
        centre: None,
        width_m: None,
        height_m: None,
        area_m2: None,
        normal: None,
        position: None,
        size_m: None,
        yaw_deg: None,
        sigma_m: sigma.map(|sigma| sigma.position_m),
        sigma_size_m: sigma.and_then(|sigma| sigma.size_m),
        sigma_area_m2: sigma.and_then(|sigma| sigma.area_m2),
    };
    match descriptor {
        Descriptor::Material(material) => {
            let [bottom, right, top, left] = edge_lengths_m(&points(&material.corners));
            file.corners = Some(material.corners);
            file.centre = Some(material.centre());
            file.width_m = Some((bottom + top) / 2.0);
            file.height_m = Some((left + right) / 2.0);
            file.area_m2 = Some(quad_area_m2(points(&material.corners)));
            file.normal = Some(material.normal);
        }
        Descriptor::Dynamic(dynamic) => {
            file.position = Some(dynamic.position);
            file.size_m = Some(dynamic.size_m);
            file.yaw_deg = dynamic.yaw_rad.map(f64::to_degrees);
        }
    }
    file
}

/// Area of the planar quadrilateral `abcd`, m², as two triangles.
///
/// Lee & Hsu, Algorithm 3. The paper prints `|ab|² + |ac|²` under the root; the identity needs `|ab|²·|ac|²`, which is
/// what the cross product gives.
fn quad_area_m2([a, b, c, d]: [Point3<f64>; 4]) -> f64 {
    let ac = c - a;
    ((b - a).cross(&ac).norm() + ac.cross(&(d - a)).norm()) / 2.0
}

fn points(corners: &[GridPoint; 4]) -> [Point3<f64>; 4] {
    corners.map(|corner| Point3::from(<[f64; 3]>::from(corner)))
}

/// Bottom, right, top, left, metres.
fn edge_lengths_m(corners: &[Point3<f64>; 4]) -> [f64; 4] {
    [0, 1, 2, 3].map(|start| (corners[(start + 1) % 4] - corners[start]).norm())
}

fn refuse_keys(kind: &'static str, keys: &[(&'static str, bool)]) -> Result<(), InvalidDescriptor> {
    match keys.iter().find(|(_, given)| *given) {
        Some(&(key, _)) => Err(InvalidDescriptor::ForeignKey { key, kind }),
        None => Ok(()),
    }
}

fn sigma_from_file(file: &DescriptorFile) -> Result<Option<Uncertainty>, InvalidDescriptor> {
    match file.sigma_m {
        Some(position_m) => {
            Ok(Some(Uncertainty { position_m, size_m: file.sigma_size_m, area_m2: file.sigma_area_m2 }))
        }
        None if file.sigma_size_m.is_some() || file.sigma_area_m2.is_some() => Err(InvalidDescriptor::NoSigma),
        None => Ok(None),
    }
}

fn normal_from_file(file: &DescriptorFile, corners: &[GridPoint; 4]) -> Result<[f64; 3], InvalidState> {
    let Some(given) = file.normal else {
        // Corners without area have no normal; validation then names the corner.
        return Ok(quad_normal(&points(corners)).map_or([0.0, 0.0, 1.0], Into::into));
    };
    let off = (Vector3::from(given).norm() - 1.0).abs();
    if off > EXACT_NORMAL && off <= ROUNDED_NORMAL {
        return Ok(Vector3::from(given).normalize().into());
    }
    Ok(given)
}
