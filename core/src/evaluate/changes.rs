//! Changes against the true ones: found, missed, false, and how far off.

use super::second_photo::SecondPhoto;
use super::truth::{TrueChange, Truth};
use crate::update::Change;
use nalgebra::Vector3;
use resurvey_schema::changes::Op;
use resurvey_schema::{ClassTable, Descriptor, GridPoint};
use serde::Serialize;

/// A change further than this from the true one is another, and false, metres in plan.
pub(super) const SAME_CHANGE_M: f64 = 2.0;

/// What the changes of one capture came to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChangeScore {
    /// The true changes that a descriptor can say.
    pub expected: Vec<ExpectedChange>,
    /// Changes that are none, or elsewhere, or of another class.
    pub false_updates: Vec<FalseUpdate>,
    /// Share of the changed pixels that nothing hides, 0–1.
    pub visible_share: f64,
    /// Changes that the same capture made a second time, none if all is well; `None` when that run failed.
    pub second_run: Option<usize>,
    /// What another photo of the same place did afterwards; `None` when there is none, or its run failed.
    pub second_photo: Option<SecondPhoto>,
}

/// A true change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectedChange {
    /// Add or remove.
    pub op: Op,
    /// Class of the descriptor.
    pub class: String,
    /// Whether it is a rectangle on a surface; else an object on the ground.
    pub is_material: bool,
    /// Whether it stands for one that the map knew.
    pub is_replacement: bool,
    /// The change that was made of it.
    pub found: Option<FoundChange>,
    /// The requirement that came nearest, where it was missed and that was asked for.
    pub why_missed: Option<String>,
}

/// How far a change that was found is from the true one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FoundChange {
    /// Centre or ground contact in plan, metres; `None` for a removal, whose place the map knew.
    pub position_off_m: Option<f64>,
    /// Area over the true one, per cent above 0; `None` for removals and objects.
    pub area_error_pct: Option<f64>,
    /// Distance in 3D over the 1σ that the descriptor states; `None` where it states none.
    pub position_sigmas: Option<f64>,
    /// Absolute area error over the 1σ that the descriptor states; `None` where it states none.
    pub area_sigmas: Option<f64>,
    /// What became of the descriptor that it replaces; `None` where it replaces none.
    pub replacement: Option<Replacement>,
}

/// How a descriptor that stands for one that the map knew came in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Replacement {
    /// The one on the map was modified.
    InPlace,
    /// The one on the map was removed, and this one added.
    RemovedAndAdded,
    /// The one on the map is still there: the thing is on the map twice.
    Beside,
}

impl Replacement {
    /// Its name in tables and documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::InPlace => "in-place",
            Self::RemovedAndAdded => "removed-and-added",
            Self::Beside => "beside",
        }
    }
}

/// A change that never happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FalseUpdate {
    /// What was done.
    pub op: Op,
    /// To what.
    pub class: String,
    /// Centre or ground contact.
    pub position: GridPoint,
}

/// Scores `changes`, which were made of a capture with this `truth`, in their order: each takes the nearest true change
/// of its kind and class within 2 m that is left. Removing what a true change replaces is right and counts as no change
/// of its own.
pub fn score_changes(truth: &Truth, changes: &[Change], classes: &ClassTable) -> ChangeScore {
    let wanted = expected_changes(truth);
    let mut found: Vec<Option<FoundChange>> = vec![None; wanted.len()];
    let mut removed = vec![false; wanted.len()];
    let mut false_updates = Vec::new();
    for change in changes {
        let (op, descriptor) = made(change);
        let class = classes.name(descriptor.class());
        if let Some((index, distance_m)) = nearest_true_change(&wanted, change, classes, |index| found[index].is_none())
        {
            found[index] = Some(measured(change, wanted[index], distance_m, classes));
        } else if let Some(index) = replaced_by_removal(&wanted, &removed, change, classes) {
            removed[index] = true;
        } else if !is_piece_of_walls(truth, class) {
            false_updates.push(FalseUpdate { op, class: class.to_owned(), position: descriptor.anchor() });
        }
    }
    let expected = wanted.iter().zip(found).zip(removed).map(|((change, found), is_removed)| ExpectedChange {
        op: change.op,
        class: change.class.clone().unwrap_or_default(),
        is_material: change.corners.is_some(),
        is_replacement: change.replaces.is_some(),
        found: found.map(|found| match found.replacement {
            Some(Replacement::Beside) if is_removed => {
                FoundChange { replacement: Some(Replacement::RemovedAndAdded), ..found }
            }
            _ => found,
        }),
        why_missed: None,
    });
    ChangeScore {
        expected: expected.collect(),
        false_updates,
        visible_share: truth.visible_share(),
        second_run: None,
        second_photo: None,
    }
}

/// The true changes that a descriptor can say.
pub(super) fn expected_changes(truth: &Truth) -> Vec<&TrueChange> {
    truth.changes.iter().filter(|change| change.op != Op::Modify).collect()
}

/// What `change` did, and the descriptor that says where.
pub(super) fn made(change: &Change) -> (Op, &Descriptor) {
    match change {
        Change::Add(after) => (Op::Add, after),
        Change::Modify { after, .. } => (Op::Modify, after),
        Change::Remove { before, .. } => (Op::Remove, before),
    }
}

/// The nearest of the true changes that `is_left`, of the kind and class of `change` and within reach, and its distance
/// in plan.
pub(super) fn nearest_true_change(
    wanted: &[&TrueChange],
    change: &Change,
    classes: &ClassTable,
    is_left: impl Fn(usize) -> bool,
) -> Option<(usize, f64)> {
    let (op, descriptor) = made(change);
    let (class, at) = (classes.name(descriptor.class()), descriptor.anchor());
    let candidates = wanted.iter().enumerate().filter(|(index, true_change)| {
        let is_same_class = true_change.class.as_deref() == Some(class);
        is_left(*index) && is_same_class && (op == Op::Remove) == (true_change.op == Op::Remove)
    });
    let with_distance = candidates.filter_map(|(index, change)| Some((index, change.position?.plan_distance_m(&at))));
    with_distance.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, distance_m)| *distance_m <= SAME_CHANGE_M)
}

/// The true change whose predecessor a removal takes off the map.
fn replaced_by_removal(
    wanted: &[&TrueChange],
    removed: &[bool],
    change: &Change,
    classes: &ClassTable,
) -> Option<usize> {
    let Change::Remove { before, .. } = change else { return None };
    let left = wanted.iter().enumerate().filter(|(index, _)| !removed[*index]);
    let of_each = left.filter_map(|(index, change)| Some((index, replaced_off_m(change, before, classes)?)));
    of_each.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
}

/// Distance in plan of `before` from what `change` replaces, where `before` can be that.
fn replaced_off_m(change: &TrueChange, before: &Descriptor, classes: &ClassTable) -> Option<f64> {
    let replaced = change.replaces.as_ref().filter(|replaced| replaced.class == classes.name(before.class()))?;
    Some(replaced.place()?.plan_distance_m(&before.anchor())).filter(|distance_m| *distance_m <= SAME_CHANGE_M)
}

fn measured(change: &Change, truth: &TrueChange, distance_m: f64, classes: &ClassTable) -> FoundChange {
    let (op, descriptor) = made(change);
    if op == Op::Remove {
        return FoundChange::default();
    }
    let areas_m2 = match (descriptor, &truth.corners) {
        (Descriptor::Material(material), Some(corners)) => {
            Some((quad_area_m2(&material.corners), quad_area_m2(corners)))
        }
        _ => None,
    };
    let up_m = truth.position.map_or(0.0, |position| descriptor.anchor().height_m - position.height_m);
    let sigma = descriptor.sigma();
    let over = |error: f64, sigma: f64| Some(error / sigma).filter(|sigmas| sigmas.is_finite());
    let is_in_place = match change {
        Change::Modify { before, .. } => replaced_off_m(truth, before, classes).is_some(),
        _ => false,
    };
    let replacement = if is_in_place { Replacement::InPlace } else { Replacement::Beside };
    FoundChange {
        position_off_m: Some(distance_m),
        area_error_pct: areas_m2
            .map(|(area_m2, true_m2)| 100.0 * (area_m2 / true_m2 - 1.0))
            .filter(|error| error.is_finite()),
        position_sigmas: sigma.and_then(|sigma| over(distance_m.hypot(up_m), sigma.position_m)),
        area_sigmas: areas_m2
            .zip(sigma.and_then(|sigma| sigma.area_m2))
            .and_then(|((area_m2, true_m2), sigma_m2)| over((area_m2 - true_m2).abs(), sigma_m2)),
        replacement: truth.replaces.is_some().then_some(replacement),
    }
}

/// Whether walls that changed to `class` make a descriptor of that class a piece of what really changed.
pub(super) fn is_piece_of_walls(truth: &Truth, class: &str) -> bool {
    truth.changes.iter().any(|change| change.op == Op::Modify && change.to.as_deref() == Some(class))
}

/// Area of a quadrilateral with corners in order, m²: two triangles, each ½|ab × ac| (Lee & Hsu, Algorithm 3).
fn quad_area_m2(corners: &[GridPoint; 4]) -> f64 {
    let from_first = |corner: &GridPoint| {
        let first = &corners[0];
        Vector3::new(
            corner.easting_m - first.easting_m,
            corner.northing_m - first.northing_m,
            corner.height_m - first.height_m,
        )
    };
    let [_, b, c, d] = corners.each_ref().map(from_first);
    (b.cross(&c).norm() + c.cross(&d).norm()) / 2.0
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use resurvey_schema::{ClassId, DynamicDescriptor, MaterialDescriptor, Uncertainty};

    pub const BANNER: ClassId = ClassId(3);
    pub const CHAIR: ClassId = ClassId(5);

    /// A banner 3 m wide and 2 m high whose centre is at 1.5, 0, 1.
    pub fn truth(changes: &str) -> Truth {
        let pose = r#"{"easting":0,"northing":0,"height":0,"yaw_deg":0,"pitch_deg":0,"roll_deg":0}"#;
        serde_json::from_str(&format!(r#"{{"pose":{pose},"scene":"street","changes":[{changes}]}}"#)).unwrap()
    }

    pub const ADDED: &str = r#"{"op":"add","class":"banner","position":[1.5,0,1],
        "corners":[[0,0,0],[3,0,0],[3,0,2],[0,0,2]]}"#;
    pub const GONE: &str = r#"{"op":"remove","class":"chair","position":[10,10,0]}"#;
    /// The banner in the place of a metal panel that is 2.8 m wide.
    const REPLACED: &str = r#"{"op":"add","class":"banner","position":[1.5,0,1],
        "corners":[[0,0,0],[3,0,0],[3,0,2],[0,0,2]],
        "replaces":{"class":"metal","corners":[[0.1,0,0],[2.9,0,0],[2.9,0,2],[0.1,0,2]]}}"#;
    const WALLS: &str = r#"{"op":"modify","object":"b7","from":"stone","to":"glass"}"#;

    pub fn material(class: ClassId, width_m: f64, east_m: f64) -> Descriptor {
        let corner = |e, h| GridPoint::new(east_m + e, 0.0, h);
        let corners = [corner(0.0, 0.0), corner(width_m, 0.0), corner(width_m, 2.0), corner(0.0, 2.0)];
        Descriptor::Material(MaterialDescriptor { class, corners, normal: [0.0, -1.0, 0.0], sigma: None })
    }

    pub fn chair(east_m: f64, north_m: f64) -> Descriptor {
        let position = GridPoint::new(east_m, north_m, 0.0);
        Descriptor::Dynamic(DynamicDescriptor {
            class: CHAIR,
            position,
            size_m: [0.5, 0.5, 0.9],
            yaw_rad: None,
            sigma: None,
        })
    }

    pub fn score(truth: &Truth, changes: &[Change]) -> ChangeScore {
        score_changes(truth, changes, &ClassTable::default())
    }

    #[test]
    fn a_banner_half_a_metre_off_and_a_third_too_wide_is_found_with_both_errors() {
        // 4 m wide from E 0: centre 0.5 m off, 8 m² for 6 m².
        let score = score(&truth(ADDED), &[Change::Add(material(BANNER, 4.0, 0.0))]);
        let found = score.expected[0].found.unwrap();
        assert!((found.position_off_m.unwrap() - 0.5).abs() < 1e-9);
        assert!((found.area_error_pct.unwrap() - 100.0 / 3.0).abs() < 1e-9);
        assert!(score.expected[0].is_material && score.false_updates.is_empty());
    }

    #[test]
    fn what_is_elsewhere_of_another_class_or_done_twice_is_false() {
        let added = |class, east_m| Change::Add(material(class, 3.0, east_m));
        let removed = Change::Remove { fid: 7, before: chair(10.0, 11.0) };
        let of = |changes: &[Change]| {
            let score = score(&truth(&[ADDED, GONE].join(",")), changes);
            let found: Vec<bool> = score.expected.iter().map(|change| change.found.is_some()).collect();
            (found, score.false_updates.len())
        };
        assert_eq!(of(&[added(BANNER, 2.1)]), (vec![false, false], 1));
        assert_eq!(of(&[added(ClassId(1), 0.0)]), (vec![false, false], 1));
        assert_eq!(of(&[added(BANNER, 0.1), added(BANNER, 0.0)]), (vec![true, false], 1));
        assert_eq!(of(std::slice::from_ref(&removed)), (vec![false, true], 0));
        assert_eq!(of(&[Change::Add(chair(10.0, 10.0))]), (vec![false, false], 1));
        assert_eq!(of(&[]), (vec![false, false], 0));
        let modified = Change::Modify { fid: 3, before: material(BANNER, 9.0, 0.0), after: material(BANNER, 3.0, 0.0) };
        assert_eq!(of(&[modified, removed]), (vec![true, true], 0));
    }

    #[test]
    fn a_piece_of_walls_that_really_changed_is_not_false_and_another_class_there_is() {
        let glass = score(&truth(WALLS), &[Change::Add(material(ClassId(1), 3.0, 40.0))]);
        assert!(glass.false_updates.is_empty() && glass.expected.is_empty());
        assert_eq!(score(&truth(WALLS), &[Change::Add(material(BANNER, 3.0, 40.0))]).false_updates.len(), 1);
    }

    #[test]
    fn errors_are_compared_with_the_sigmas_that_the_descriptor_states() {
        // 0.3 m east and 0.4 m up: 0.5 m in 3D for 0.2 m, 2.5 σ; 8 m² for 6 m² with 1 m², 2 σ.
        let Descriptor::Material(mut banner) = material(BANNER, 4.0, -0.2) else { panic!("a rectangle") };
        banner.corners.iter_mut().for_each(|corner| corner.height_m += 0.4);
        banner.sigma = Some(Uncertainty { position_m: 0.2, size_m: None, area_m2: Some(1.0) });
        let found = score(&truth(ADDED), &[Change::Add(Descriptor::Material(banner))]).expected[0].found.unwrap();
        assert!((found.position_off_m.unwrap() - 0.3).abs() < 1e-9);
        assert!((found.position_sigmas.unwrap() - 2.5).abs() < 1e-9, "{found:?}");
        assert!((found.area_sigmas.unwrap() - 2.0).abs() < 1e-9, "{found:?}");
        let unsure = score(&truth(ADDED), &[Change::Add(material(BANNER, 4.0, 0.0))]).expected[0].found.unwrap();
        assert_eq!((unsure.position_sigmas, unsure.area_sigmas), (None, None));
    }

    #[test]
    fn what_is_replaced_is_modified_or_removed_and_added_and_never_there_twice() {
        let truth = truth(REPLACED);
        let (old, new) = (material(ClassId(2), 2.8, 0.1), material(BANNER, 3.0, 0.0));
        let of = |changes: &[Change]| {
            let score = score(&truth, changes);
            assert!(score.expected[0].is_replacement);
            (score.expected[0].found.map(|found| found.replacement.unwrap()), score.false_updates.len())
        };
        let removed = Change::Remove { fid: 3, before: old.clone() };
        let modified = Change::Modify { fid: 3, before: old, after: new.clone() };
        let elsewhere = Change::Remove { fid: 4, before: material(ClassId(2), 2.8, 30.0) };
        assert_eq!(of(&[modified]), (Some(Replacement::InPlace), 0));
        assert_eq!(of(&[Change::Add(new.clone()), removed.clone()]), (Some(Replacement::RemovedAndAdded), 0));
        assert_eq!(of(&[Change::Add(new.clone())]), (Some(Replacement::Beside), 0));
        assert_eq!(of(std::slice::from_ref(&removed)), (None, 0));
        assert_eq!(of(&[removed.clone(), removed]), (None, 1));
        assert_eq!(of(&[Change::Add(new), elsewhere]), (Some(Replacement::Beside), 1));
    }

    #[test]
    fn a_chair_that_moved_may_leave_its_old_place() {
        let moved =
            r#"{"op":"add","class":"chair","position":[11,10,0],"replaces":{"class":"chair","position":[10,10,0]}}"#;
        let away = Change::Remove { fid: 7, before: chair(10.0, 10.0) };
        let score = score(&truth(moved), &[away, Change::Add(chair(11.1, 10.0))]);
        assert!(score.false_updates.is_empty());
        assert_eq!(score.expected[0].found.unwrap().replacement, Some(Replacement::RemovedAndAdded));
    }

    #[test]
    fn what_cannot_be_measured_is_no_change_and_any_update_of_it_is_false() {
        let pose = r#"{"easting":0,"northing":0,"height":0,"yaw_deg":0,"pitch_deg":0,"roll_deg":0}"#;
        let text = format!(r#"{{"pose":{pose},"scene":"street","changes":[],"unmeasurable":[{ADDED}]}}"#);
        let truth: Truth = serde_json::from_str(&text).unwrap();
        let score = score(&truth, &[Change::Add(material(BANNER, 3.0, 0.0))]);
        assert!(score.expected.is_empty() && score.false_updates.len() == 1);
    }
}
