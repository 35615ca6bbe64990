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
        kind: None,
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read(json: &str) -> Result<Descriptor, InvalidDescriptor> {
        descriptor_from_file(&serde_json::from_str(json).unwrap(), &ClassTable::default())
    }

    fn message(json: &str) -> String {
        read(json).unwrap_err().to_string()
    }

    // From the case street-banner-removed: 9.6312 × 6.8852 m on a wall that faces east.
    const CORNERS: &str = "[[835567.7431,817816.2108,8.1296],[835567.7431,817825.842,8.1296],\
        [835567.7431,817825.842,15.0148],[835567.7431,817816.2108,15.0148]]";

    #[test]
    fn a_banner_needs_only_its_class_and_corners() {
        let Ok(Descriptor::Material(banner)) = read(&format!(r#"{{"class":"banner","corners":{CORNERS}}}"#)) else {
            panic!()
        };
        assert!((Vector3::from(banner.normal) - Vector3::x()).norm() < 1e-12);
        let file = descriptor_to_file(&Descriptor::Material(banner), &ClassTable::default());
        // 817825.842 − 817816.2108 and 15.0148 − 8.1296.
        let near = |value: Option<f64>, expected: f64| (value.unwrap() - expected).abs() < 1e-6;
        assert!(near(file.width_m, 9.6312) && near(file.height_m, 6.8852) && near(file.area_m2, 9.6312 * 6.8852));
        let centre = file.centre.unwrap();
        assert!((centre.northing_m - 817_821.026_4).abs() < 1e-6 && (centre.height_m - 11.572_2).abs() < 1e-6);
    }

    #[test]
    fn a_chair_needs_only_its_class_and_position_and_has_the_size_of_its_class() {
        let Ok(Descriptor::Dynamic(chair)) = read(r#"{"class":"chair","position":[836716.9865,818429.4205,7.2]}"#)
        else {
            panic!()
        };
        assert_eq!((chair.size_m, chair.yaw_rad, chair.sigma), ([0.5, 0.5, 0.9], None, None));
    }

    #[test]
    fn a_3_4_5_triangle_has_area_6() {
        let at = |x, y| Point3::new(x, y, 0.0);
        assert!((quad_area_m2([at(0.0, 0.0), at(3.0, 0.0), at(0.0, 4.0), at(0.0, 0.0)]) - 6.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_descriptor_is_refused_by_name() {
        let banner = |corners: &str| format!(r#"{{"class":"banner","corners":{corners}}}"#);
        let clockwise = "[[0,0,0],[0,0,2],[0,3,2],[0,3,0]]";
        let inward = format!(r#"{{"class":"banner","corners":{CORNERS},"normal":[-1,0,0]}}"#);
        for (json, expected) in [
            (
                r#"{"class":"poster","position":[0,0,0]}"#.to_owned(),
                "class \"poster\" is not in the map's class table; expected one of stone, ",
            ),
            (
                r#"{"class":"chair"}"#.to_owned(),
                "expected either \"corners\" (material) or \"position\" (dynamic), found neither",
            ),
            (
                r#"{"class":"banner","position":[0,0,0],"size_m":[1,1,1]}"#.to_owned(),
                "class \"banner\" is Material; a Dynamic descriptor",
            ),
            (r#"{"class":"banner","position":[0,0,0]}"#.to_owned(), "class \"banner\" has no predefined size"),
            (banner("[[0,0,0],[0,3,0],[0,3,2],[0,0,2]]").replace("banner", "sky"), "class \"sky\" is Ignored"),
            (inward, "corner 0 (of 0…3) does not turn left"),
            (banner("[[0,0,0],[0,3,0],[0,0,2],[0,3,2]]"), "corner 0"),
            (banner("[[0,0,0],[0,0,0],[0,0,0],[0,0,0]]"), "corner 0"),
            (banner("[[0,0,0],[0,3,0],[1,3,2],[0,0,2]]"), "corner 0 (of 0…3) is 0.2"),
            (banner("[[0,0,1e12],[0,3,0],[0,3,2],[0,0,2]]"), "height 1000000000000 m is not within"),
            (
                r#"{"class":"chair","position":[0,0,0],"size_m":[0,1,1]}"#.to_owned(),
                "size_m is 0; expected a finite number above zero",
            ),
            (r#"{"class":"chair","position":[0,0,0],"sigma_size_m":1}"#.to_owned(), "\"sigma_size_m\" and"),
            (
                r#"{"class":"chair","position":[0,0,0],"normal":[1,0,0]}"#.to_owned(),
                "\"normal\" does not belong to a dynamic",
            ),
        ] {
            let found = message(&json);
            assert!(found.contains(expected), "{json}\nexpected {expected}\nfound {found}");
        }
        // Clockwise from below faces the other way, which is a banner too.
        let Ok(Descriptor::Material(west)) = read(&banner(clockwise)) else { panic!() };
        assert!((Vector3::from(west.normal) + Vector3::x()).norm() < 1e-12);
    }

    #[test]
    fn a_rounded_normal_is_made_a_unit_normal() {
        let json = r#"{"class":"banner","corners":[[0,0,0],[-3,3,0],[-3,3,2],[0,0,2]],"normal":[0.7071,0.7071,0]}"#;
        let Ok(Descriptor::Material(banner)) = read(json) else { panic!() };
        assert!((Vector3::from(banner.normal).norm() - 1.0).abs() < 1e-12);
        assert!(message(&json.replace("0.7071", "0.6")).contains("the normal has length 0.848"));
    }

    proptest! {
        #[test]
        fn a_descriptor_comes_back_from_json_to_the_last_bit(
            e in 8e5..9e5_f64, n in 8e5..9e5_f64, h in -10.0..900.0_f64, yaw in 0.0..6.2_f64,
            width in 0.1..30.0_f64, height in 0.1..30.0_f64, sigma in 0.0..5.0_f64,
        ) {
            let classes = ClassTable::default();
            let (along_e, along_n) = (yaw.cos() * width, yaw.sin() * width);
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, height), (0.0, height)]
                .map(|(share, up)| GridPoint::new(e + share * along_e, n + share * along_n, h + up));
            let normal = quad_normal(&points(&corners)).unwrap().into();
            let sigma = Some(Uncertainty { position_m: sigma, size_m: Some(sigma / 3.0), area_m2: None });
            let class = classes.by_name("banner").unwrap().index;
            let banner = Descriptor::Material(MaterialDescriptor { class, corners, normal, sigma });
            let class = classes.by_name("chair").unwrap().index;
            let (position, size_m) = (corners[0], [0.5, 0.5, 0.9]);
            let chair = Descriptor::Dynamic(DynamicDescriptor { class, position, size_m, yaw_rad: Some(yaw), sigma });
            for descriptor in [banner, chair] {
                let json = serde_json::to_string(&descriptor_to_file(&descriptor, &classes)).unwrap();
                let back = descriptor_from_file(&serde_json::from_str(&json).unwrap(), &classes).unwrap();
                let (back, descriptor) = (FeatureState::Descriptor(back), FeatureState::Descriptor(descriptor));
                prop_assert!(back.is_same_as(&descriptor), "{back:?} {descriptor:?}");
            }
        }
    }
}
