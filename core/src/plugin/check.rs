//! What the host checks in every answer before anyone sees it.

use crate::image::LabelImage;
use crate::version::{FeatureState, InvalidState, UNIT_TOLERANCE};
use nalgebra::DMatrix;
use resurvey_schema::{
    ChangeRegion, ClassId, ClassKind, ClassTable, Descriptor, GridPoint, Localization, Proposal, Uncertainty,
};
use std::fmt::Display;

/// How far the length of a unit normal may be from 1: room for one that was computed in `f32`.
const NORMAL_TOLERANCE: f64 = 1e-6;
/// How far a covariance may be from symmetric, relative to its largest entry: rounding of one matrix product.
const SYMMETRY_TOLERANCE: f64 = 1e-9;
/// How far below zero a correlation matrix may reach, likewise: rounding, and what a plugin wrote with nine digits.
const DEFINITE_TOLERANCE: f64 = 1e-6;
/// How far a position may be from the origin of the map's frame, metres: that of every projected system is nearer.
const FARTHEST_M: f64 = 1e8;
/// How far an angle may be from zero, radians: a thousand turns.
pub(crate) const LARGEST_RAD: f64 = 1e3 * std::f64::consts::TAU;
/// How far what an estimator places or removes may be from the camera, and how unsure of it, metres: no photo shows more.
const FARTHEST_SEEN_M: f64 = 10_000.0;
/// Characters of the texts that the map keeps: a name, and a unit.
const LONGEST_NAME: usize = 64;
const LONGEST_UNIT: usize = 16;

/// A value that breaks a rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Violation {
    pub field: String,
    pub value: String,
    pub expected: String,
}

pub(super) fn violation(
    field: impl Into<String>,
    value: &dyn Display,
    expected: impl Into<String>,
) -> Result<(), Violation> {
    Err(Violation { field: field.into(), value: value.to_string(), expected: expected.into() })
}

type Checked = Result<(), Violation>;

/// What the answers to one call are checked against.
pub(super) struct Rules<'a> {
    pub classes: &'a ClassTable,
    pub width: u32,
    pub height: u32,
    pub regions: usize,
}

pub(super) fn ratio(field: &str, value: f64) -> Checked {
    if (0.0..=1.0).contains(&value) { Ok(()) } else { violation(field, &value, "a number from 0 to 1") }
}

fn finite(field: &str, values: &[f64]) -> Checked {
    match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => violation(field, &value, "a finite number"),
    }
}

fn not_negative(field: &str, value: f64) -> Checked {
    if value.is_finite() && value >= 0.0 { Ok(()) } else { violation(field, &value, "a finite number of at least 0") }
}

fn at_most(field: &str, unit: &str, limit: f64, values: &[f64]) -> Checked {
    finite(field, values)?;
    match values.iter().find(|value| value.abs() > limit) {
        None => Ok(()),
        Some(value) => violation(field, &format_args!("{value:e}"), format!("at most {limit:.0} {unit} from zero")),
    }
}

/// No direction has a variance below zero: the correlations, which have no units, are those of a covariance.
fn no_negative_variance<const N: usize>(field: &str, covariance: &[[f64; N]; N]) -> Checked {
    let correlation = |row: usize, column: usize| {
        let product = (covariance[row][row] * covariance[column][column]).sqrt();
        match covariance[row][column] {
            _ if row == column => 1.0 + DEFINITE_TOLERANCE,
            // Without variance there is nothing to be correlated with.
            value if product <= 0.0 => value.abs() * f64::INFINITY,
            value => value / product,
        }
    };
    let correlations = DMatrix::from_fn(N, N, |row, column| {
        let value = correlation(row, column);
        if value.is_nan() { 0.0 } else { value }
    });
    match correlations.cholesky() {
        Some(_) => Ok(()),
        None => violation(field, &format_args!("{covariance:?}"), "no variance below zero in any direction"),
    }
}

/// A line of text that fits into a table.
fn line(field: &str, text: &str, longest: usize) -> Checked {
    if text.chars().count() <= longest && !text.contains(char::is_control) {
        return Ok(());
    }
    let shown: String = text.chars().take(longest).collect();
    violation(
        field,
        &format_args!("{shown:?}…"),
        format!("at most {longest} characters, none of them a control character"),
    )
}

fn point(field: &str, point: GridPoint) -> Checked {
    finite(field, &<[f64; 3]>::from(point))
}

/// Every label is a class of the map, or void.
pub(super) fn labels(labels: &LabelImage, classes: &ClassTable) -> Checked {
    let mut is_known = [false; 256];
    is_known[usize::from(ClassId::VOID.0)] = true;
    classes.iter().for_each(|class| is_known[usize::from(class.index.0)] = true);
    match labels.values().iter().position(|label| !is_known[usize::from(*label)]) {
        None => Ok(()),
        Some(at) => {
            let width = labels.width() as usize;
            let field = format!("labels[{}][{}]", at / width, at % width);
            violation(field, &labels.values()[at], "a class of the map, or 255 for none")
        }
    }
}

pub(super) fn localization(found: &Localization) -> Checked {
    ratio("score", found.score)?;
    let [e, n, h, yaw, pitch, roll] = found.pose.into();
    at_most("pose", "m", FARTHEST_M, &[e, n, h])?;
    at_most("pose", "rad", LARGEST_RAD, &[yaw, pitch, roll])?;
    let c = &found.covariance;
    finite("covariance", c.as_flattened())?;
    let largest = c.as_flattened().iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    for (row, column) in [(0, 1), (0, 2), (1, 2)] {
        if (c[row][column] - c[column][row]).abs() > SYMMETRY_TOLERANCE * largest {
            let value = format!("{} against {}", c[row][column], c[column][row]);
            return violation(format!("covariance[{row}][{column}]"), &value, "a symmetric matrix");
        }
    }
    (0..3).try_for_each(|axis| not_negative(&format!("covariance[{axis}][{axis}]"), c[axis][axis]))?;
    no_negative_variance("covariance", c)?;
    if let Some(alignment) = &found.alignment {
        finite("alignment.covariance", alignment.covariance.as_flattened())?;
        (0..6).try_for_each(|axis| {
            not_negative(&format!("alignment.covariance[{axis}][{axis}]"), alignment.covariance[axis][axis])
        })?;
        no_negative_variance("alignment.covariance", &alignment.covariance)?;
        not_negative("alignment.map_sigma_m", alignment.map_sigma_m)?;
        not_negative("alignment.label_sigma_px", alignment.label_sigma_px)?;
    }
    if let Some(runner_up) = found.runner_up {
        not_negative("runner_up.distance_m", runner_up.distance_m)?;
        ratio("runner_up.score_ratio", runner_up.score_ratio)?;
    }
    found.heat.iter().enumerate().try_for_each(|(index, [e, n, score])| {
        let field = format!("heat[{index}]");
        at_most(&field, "m", FARTHEST_M, &[*e, *n])?;
        finite(&field, &[*score])
    })
}

/// What an estimator places or removes is where a photo that was taken at `camera` may show it, and known well enough.
pub(super) fn in_sight(proposals: &[Proposal], camera: GridPoint) -> Checked {
    let near = |field: String, at: GridPoint| {
        let ([e, n, h], [e0, n0, h0]) = (<[f64; 3]>::from(at), <[f64; 3]>::from(camera));
        let distance_m = (e - e0).hypot(n - n0).hypot(h - h0);
        if distance_m <= FARTHEST_SEEN_M {
            return Ok(());
        }
        violation(field, &format_args!("{distance_m:.0} m from the camera"), format!("at most {FARTHEST_SEEN_M:.0} m"))
    };
    proposals.iter().enumerate().try_for_each(|(index, proposal)| {
        let field = |name: &str| format!("proposal[{index}].{name}");
        match proposal {
            Proposal::Place { descriptor: Descriptor::Material(material), .. } => {
                material.corners.into_iter().try_for_each(|corner| near(field("descriptor.corners"), corner))
            }
            Proposal::Place { descriptor: Descriptor::Dynamic(dynamic), .. } => {
                near(field("descriptor.position"), dynamic.position)
            }
            Proposal::Remove { near: place, .. } => near(field("near"), *place),
            Proposal::Reject { .. } => Ok(()),
        }
    })
}

impl Rules<'_> {
    fn class(&self, field: &str, class: ClassId) -> Checked {
        match self.classes.get(class) {
            Some(_) => Ok(()),
            None => violation(field, &class.0, "a class of the map"),
        }
    }

    fn kind(&self, field: &str, class: ClassId, kind: ClassKind) -> Checked {
        self.class(field, class)?;
        if self.classes.kind(class) == kind {
            return Ok(());
        }
        let word = if kind == ClassKind::Material { "material" } else { "dynamic" };
        violation(field, &self.classes.name(class), format!("a class of kind {word}"))
    }

    pub(super) fn region(&self, index: usize, region: &ChangeRegion) -> Checked {
        let field = |name: &str| format!("region[{index}].{name}");
        self.class(&field("class_before"), region.class_before)?;
        self.class(&field("class_after"), region.class_after)?;
        let bounds = region.bounds;
        let inside = bounds.left < bounds.right
            && bounds.top < bounds.bottom
            && bounds.right <= self.width
            && bounds.bottom <= self.height;
        if !inside {
            let value = format!("{}…{} × {}…{}", bounds.left, bounds.right, bounds.top, bounds.bottom);
            return violation(field("bounds"), &value, format!("a box inside {}×{} pixels", self.width, self.height));
        }
        let size = bounds.width() as usize * bounds.height() as usize;
        if region.mask.len() != size {
            return violation(field("mask"), &format_args!("{} bytes", region.mask.len()), format!("{size} bytes"));
        }
        if let Some(value) = region.mask.iter().find(|value| **value > 1) {
            return violation(field("mask"), &value, "0 or 1");
        }
        let pixels = region.mask.iter().map(|value| usize::from(*value)).sum::<usize>();
        if pixels == 0 || pixels != region.pixels as usize {
            let expected = format!("the number of ones in the mask, {pixels}, above 0");
            return violation(field("pixels"), &region.pixels, expected);
        }
        Ok(())
    }

    /// Checks a proposal, and gives a normal that was computed in `f32` the length that the map asks for.
    pub(super) fn proposal(&self, index: usize, proposal: &mut Proposal) -> Checked {
        let field = |name: &str| format!("proposal[{index}].{name}");
        let (Proposal::Place { region, .. } | Proposal::Remove { region, .. } | Proposal::Reject { region, .. }) =
            proposal;
        if *region as usize >= self.regions {
            return violation(field("region"), &region, format!("an index below {}", self.regions));
        }
        match proposal {
            Proposal::Place { descriptor, .. } => self.descriptor(&field("descriptor"), descriptor),
            Proposal::Remove { class, near, sigma_m, .. } => {
                self.class(&field("class"), *class)?;
                point(&field("near"), *near)?;
                not_negative(&field("sigma_m"), *sigma_m)
            }
            Proposal::Reject { rejection, .. } => {
                self.class(&field("class_before"), rejection.class_before)?;
                self.class(&field("class_after"), rejection.class_after)?;
                if rejection.requirement.is_empty() {
                    return violation(field("requirement"), &"\"\"", "a short name");
                }
                line(&field("requirement"), &rejection.requirement, LONGEST_NAME)?;
                line(&field("unit"), &rejection.unit, LONGEST_UNIT)?;
                finite(&field("measured"), &[rejection.measured])?;
                finite(&field("limit"), &[rejection.limit])
            }
        }
    }

    fn descriptor(&self, field: &str, descriptor: &mut Descriptor) -> Checked {
        match descriptor {
            Descriptor::Material(material) => {
                self.kind(&format!("{field}.class"), material.class, ClassKind::Material)?;
                for (index, corner) in material.corners.into_iter().enumerate() {
                    point(&format!("{field}.corners[{index}]"), corner)?;
                }
                let length = material.normal.iter().map(|n| n * n).sum::<f64>().sqrt();
                let off = (length - 1.0).abs();
                if off.is_nan() || off > NORMAL_TOLERANCE {
                    return violation(
                        format!("{field}.normal"),
                        &format_args!("{:?}", material.normal),
                        "a unit vector",
                    );
                }
                if off > UNIT_TOLERANCE {
                    material.normal = material.normal.map(|n| n / length);
                }
            }
            Descriptor::Dynamic(dynamic) => {
                self.kind(&format!("{field}.class"), dynamic.class, ClassKind::Dynamic)?;
                point(&format!("{field}.position"), dynamic.position)?;
                at_most(&format!("{field}.yaw_rad"), "rad", LARGEST_RAD, dynamic.yaw_rad.as_slice())?;
                if let Some(size) = dynamic.size_m.iter().find(|size| !(size.is_finite() && **size > 0.0)) {
                    return violation(format!("{field}.size_m"), &size, "a finite number above 0");
                }
            }
        }
        if let Some(Uncertainty { position_m, size_m, area_m2 }) = descriptor.sigma() {
            let sigmas = [Some(position_m), size_m, area_m2].into_iter().flatten();
            sigmas.into_iter().try_for_each(|sigma| {
                not_negative(&format!("{field}.sigma"), sigma)?;
                at_most(&format!("{field}.sigma"), "m", FARTHEST_SEEN_M, &[sigma])
            })?;
        }
        // What the map would not take later is the plugin's doing, and told as that.
        let state = FeatureState::Descriptor(descriptor.clone());
        state.validate(self.classes).or_else(|invalid| not_for_the_map(field, &invalid))
    }
}

fn not_for_the_map(field: &str, invalid: &InvalidState) -> Checked {
    let corners = || format!("{field}.corners");
    match invalid {
        InvalidState::CornerOrder { corner } => violation(
            corners(),
            &format_args!("corner {corner} of 0…3 that does not turn left as seen from outside"),
            "bottom-left, bottom-right, top-right, top-left, as the normal shows outside",
        ),
        InvalidState::NotPlane { corner, distance_m, limit_m } => violation(
            corners(),
            &format_args!("corner {corner} of 0…3 at {distance_m:.3} m from the plane of the four"),
            format!("at most {limit_m:.3} m"),
        ),
        other => violation(field, &other, "what a map can hold"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_schema::{DynamicDescriptor, Pose};

    fn found([e, n, h, yaw_rad, pitch_rad, roll_rad]: [f64; 6], heat: Vec<[f64; 3]>) -> Localization {
        Localization {
            pose: Pose { position: GridPoint::new(e, n, h), yaw_rad, pitch_rad, roll_rad },
            score: 0.9,
            covariance: [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 1e-4]],
            alignment: None,
            runner_up: None,
            candidates: 1,
            skipped: 0,
            heat,
        }
    }

    #[test]
    fn a_pose_that_is_nowhere_on_earth_is_no_answer() {
        let street = [835_548.0, 817_800.0, 6.0, 3.9, 0.0, 0.0];
        assert_eq!(localization(&found(street, vec![[835_548.0, 817_800.0, 0.5]])), Ok(()));
        for (axis, value, expected) in [
            (0, 1e300, "at most 100000000 m from zero"),
            (1, -1.1e8, "at most 100000000 m from zero"),
            (3, 1e300, "at most 6283 rad from zero"),
            (5, f64::NAN, "a finite number"),
        ] {
            let mut pose = street;
            pose[axis] = value;
            let violation = localization(&found(pose, Vec::new())).unwrap_err();
            assert_eq!((violation.field.as_str(), violation.expected.as_str()), ("pose", expected), "{value}");
        }
        let far = localization(&found(street, vec![[0.0; 3], [8e8, 0.0, 0.5]])).unwrap_err();
        assert_eq!((far.field.as_str(), far.value.as_str()), ("heat[1]", "8e8"));
    }

    #[test]
    fn what_no_photo_can_show_is_no_proposal() {
        let camera = GridPoint::new(835_548.0, 817_800.0, 6.0);
        let place = |easting: f64| Proposal::Place {
            region: 0,
            descriptor: Descriptor::Dynamic(DynamicDescriptor {
                class: ClassId(4),
                position: GridPoint::new(easting, 817_800.0, 4.5),
                size_m: [0.5, 0.5, 1.7],
                yaw_rad: None,
                sigma: None,
            }),
        };
        assert_eq!(in_sight(&[place(835_560.0)], camera), Ok(()));
        let violation = in_sight(&[place(835_560.0), place(1_530.0)], camera).unwrap_err();
        assert_eq!(violation.field, "proposal[1].descriptor.position");
        assert_eq!(
            (violation.value.as_str(), violation.expected.as_str()),
            ("834018 m from the camera", "at most 10000 m")
        );
    }
}
