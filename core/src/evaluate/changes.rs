//! Changes against the true ones: found, missed, false, and how far off.

use super::bootstrap::{Bootstrap, Estimate};
use super::statistics::median;
use super::truth::{TrueChange, Truth};
use crate::update::Change;
use nalgebra::Vector3;
use resurvey_schema::changes::Op;
use resurvey_schema::{ClassTable, Descriptor, GridPoint};
use serde::Serialize;

/// A change further than this from the true one is another, and false, metres in plan.
const SAME_CHANGE_M: f64 = 2.0;
/// From this share on that nothing hides a change is expected to be found.
const VISIBLE_SHARE: f64 = 0.8;

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
    /// The change that was made of it.
    pub found: Option<FoundChange>,
}

/// How far a change that was found is from the true one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FoundChange {
    /// Centre or ground contact in plan, metres; `None` for a removal, whose place the map knew.
    pub position_off_m: Option<f64>,
    /// Area over the true one, per cent above 0; `None` for removals and objects.
    pub area_error_pct: Option<f64>,
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
/// of its kind and class within 2 m that is left.
pub fn score_changes(truth: &Truth, changes: &[Change], classes: &ClassTable) -> ChangeScore {
    let wanted: Vec<&TrueChange> = truth.changes.iter().filter(|change| change.op != Op::Modify).collect();
    let mut found: Vec<Option<FoundChange>> = vec![None; wanted.len()];
    let mut false_updates = Vec::new();
    for change in changes {
        let (op, descriptor) = made(change);
        let (class, at) = (classes.name(descriptor.class()), descriptor.anchor());
        let candidates = wanted.iter().enumerate().filter(|(index, true_change)| {
            let is_same_class = true_change.class.as_deref() == Some(class);
            found[*index].is_none() && is_same_class && (op == Op::Remove) == (true_change.op == Op::Remove)
        });
        let with_distance =
            candidates.filter_map(|(index, change)| Some((index, change.position?.plan_distance_m(&at))));
        let nearest = with_distance.min_by(|a, b| a.1.total_cmp(&b.1));
        match nearest.filter(|(_, distance_m)| *distance_m <= SAME_CHANGE_M) {
            Some((index, distance_m)) => found[index] = Some(measured(op, descriptor, wanted[index], distance_m)),
            None if is_piece_of_walls(truth, class) => {}
            None => false_updates.push(FalseUpdate { op, class: class.to_owned(), position: at }),
        }
    }
    let expected = wanted.iter().zip(found).map(|(change, found)| ExpectedChange {
        op: change.op,
        class: change.class.clone().unwrap_or_default(),
        is_material: change.corners.is_some(),
        found,
    });
    ChangeScore { expected: expected.collect(), false_updates, visible_share: truth.visible_share(), second_run: None }
}

/// What `change` did, and the descriptor that says where.
fn made(change: &Change) -> (Op, &Descriptor) {
    match change {
        Change::Add(after) => (Op::Add, after),
        Change::Modify { after, .. } => (Op::Modify, after),
        Change::Remove { before, .. } => (Op::Remove, before),
    }
}

fn measured(op: Op, descriptor: &Descriptor, truth: &TrueChange, distance_m: f64) -> FoundChange {
    if op == Op::Remove {
        return FoundChange { position_off_m: None, area_error_pct: None };
    }
    let area_error_pct = match (descriptor, &truth.corners) {
        (Descriptor::Material(material), Some(corners)) => {
            Some(100.0 * (quad_area_m2(&material.corners) / quad_area_m2(corners) - 1.0))
                .filter(|error| error.is_finite())
        }
        _ => None,
    };
    FoundChange { position_off_m: Some(distance_m), area_error_pct }
}

/// Whether walls that changed to `class` make a descriptor of that class a piece of what really changed.
fn is_piece_of_walls(truth: &Truth, class: &str) -> bool {
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

/// Found of expected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ChangeTally {
    /// Changes that were found.
    pub found: usize,
    /// Changes that should have been.
    pub expected: usize,
}

/// Changes over many captures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChangeSummary {
    /// Material changes of captures in which at least 80 % of what changed can be seen.
    pub material: ChangeTally,
    /// Dynamic ones.
    pub dynamic: ChangeTally,
    /// Share of both that was found; `None` when none was expected.
    pub found: Option<Estimate>,
    /// Changes that were made, true and false.
    pub committed: usize,
    /// Changes that never happened.
    pub false_updates: usize,
    /// Captures without a true addition or removal.
    pub captures_without_change: usize,
    /// False updates per 100 of those.
    pub false_per_100_without_change: Option<Estimate>,
    /// Median distance in plan of what was placed from where it is, metres.
    pub position_off_median_m: Option<f64>,
    /// Median of the absolute area errors of what was placed, per cent.
    pub area_error_median_pct: Option<f64>,
    /// Captures that changed the map a second time, or failed to.
    pub not_idempotent: usize,
}

impl ChangeSummary {
    /// Of `scores`, one a capture.
    pub fn of(scores: &[&ChangeScore], bootstrap: &Bootstrap) -> Self {
        let seen = |score: &&&ChangeScore| score.visible_share >= VISIBLE_SHARE;
        let tally = |score: &ChangeScore, picks: fn(&ExpectedChange) -> bool| {
            let expected = score.expected.iter().filter(|change| picks(change));
            let found = expected.clone().filter(|change| change.found.is_some()).count();
            ChangeTally { found, expected: expected.count() }
        };
        let total = |picks: fn(&ExpectedChange) -> bool| {
            scores.iter().filter(seen).map(|score| tally(score, picks)).fold(ChangeTally::default(), |sum, one| {
                ChangeTally { found: sum.found + one.found, expected: sum.expected + one.expected }
            })
        };
        let of_all = |score: &ChangeScore| tally(score, |_| true);
        let found = || scores.iter().flat_map(|score| &score.expected).filter_map(|change| change.found);
        let tallies: Vec<ChangeTally> = scores.iter().filter(seen).map(|score| of_all(score)).collect();
        let unchanged: Vec<f64> = scores
            .iter()
            .filter(|score| score.expected.is_empty())
            .map(|score| score.false_updates.len() as f64)
            .collect();
        let false_updates = scores.iter().map(|score| score.false_updates.len()).sum();
        let area_errors: Vec<f64> = found().filter_map(|found| found.area_error_pct).map(f64::abs).collect();
        Self {
            material: total(|change| change.is_material),
            dynamic: total(|change| !change.is_material),
            found: bootstrap.estimate(tallies.len(), |sample| {
                let sum = |pick: fn(&ChangeTally) -> usize| sample.iter().map(|&i| pick(&tallies[i])).sum::<usize>();
                sum(|tally| tally.found) as f64 / sum(|tally| tally.expected) as f64
            }),
            committed: found().count() + false_updates,
            false_updates,
            captures_without_change: unchanged.len(),
            false_per_100_without_change: bootstrap.estimate(unchanged.len(), |sample| {
                100.0 * sample.iter().map(|&i| unchanged[i]).sum::<f64>() / sample.len() as f64
            }),
            position_off_median_m: median(&found().filter_map(|found| found.position_off_m).collect::<Vec<_>>()),
            area_error_median_pct: median(&area_errors),
            not_idempotent: scores.iter().filter(|score| score.second_run != Some(0)).count(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_schema::{ClassId, DynamicDescriptor, MaterialDescriptor};

    const BANNER: ClassId = ClassId(3);
    const CHAIR: ClassId = ClassId(5);

    /// A banner 3 m wide and 2 m high whose centre is at 1.5, 0, 1.
    fn truth(changes: &str) -> Truth {
        let pose = r#"{"easting":0,"northing":0,"height":0,"yaw_deg":0,"pitch_deg":0,"roll_deg":0}"#;
        serde_json::from_str(&format!(r#"{{"pose":{pose},"scene":"street","changes":[{changes}]}}"#)).unwrap()
    }

    const ADDED: &str = r#"{"op":"add","class":"banner","position":[1.5,0,1],
        "corners":[[0,0,0],[3,0,0],[3,0,2],[0,0,2]]}"#;
    const GONE: &str = r#"{"op":"remove","class":"chair","position":[10,10,0]}"#;
    const WALLS: &str = r#"{"op":"modify","object":"b7","from":"stone","to":"glass"}"#;

    fn material(class: ClassId, width_m: f64, east_m: f64) -> Descriptor {
        let corner = |e, h| GridPoint::new(east_m + e, 0.0, h);
        let corners = [corner(0.0, 0.0), corner(width_m, 0.0), corner(width_m, 2.0), corner(0.0, 2.0)];
        Descriptor::Material(MaterialDescriptor { class, corners, normal: [0.0, -1.0, 0.0], sigma: None })
    }

    fn chair(east_m: f64, north_m: f64) -> Descriptor {
        let position = GridPoint::new(east_m, north_m, 0.0);
        Descriptor::Dynamic(DynamicDescriptor {
            class: CHAIR,
            position,
            size_m: [0.5, 0.5, 0.9],
            yaw_rad: None,
            sigma: None,
        })
    }

    fn score(truth: &Truth, changes: &[Change]) -> ChangeScore {
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
    fn a_summary_counts_what_can_be_seen_and_what_never_happened() {
        let truth_of_both = truth(&[ADDED, GONE].join(","));
        let mut good = score(&truth_of_both, &[Change::Add(material(BANNER, 3.0, 0.2))]);
        good.second_run = Some(0);
        let hidden = ChangeScore { visible_share: 0.71, ..score(&truth(ADDED), &[]) };
        let wrong = ChangeScore { second_run: Some(0), ..score(&truth(""), &[Change::Add(chair(3.0, 3.0))]) };
        let summary = ChangeSummary::of(&[&good, &hidden, &wrong], &Bootstrap::default());
        assert_eq!(summary.material, ChangeTally { found: 1, expected: 1 });
        assert_eq!(summary.dynamic, ChangeTally { found: 0, expected: 1 });
        assert!((summary.found.unwrap().value - 0.5).abs() < 1e-12);
        assert_eq!((summary.committed, summary.false_updates, summary.captures_without_change), (2, 1, 1));
        assert!((summary.false_per_100_without_change.unwrap().value - 100.0).abs() < 1e-9);
        assert!((summary.position_off_median_m.unwrap() - 0.2).abs() < 1e-9);
        assert!(summary.area_error_median_pct.unwrap().abs() < 1e-9);
        assert_eq!(summary.not_idempotent, 1);
    }
}
