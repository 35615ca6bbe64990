//! Another photo of a place that was updated from the first: it should have nothing left to say.

use super::changes::{ChangeScore, SAME_CHANGE_M, expected_changes, is_piece_of_walls, made, nearest_true_change};
use super::truth::{TrueChange, Truth};
use crate::update::Change;
use resurvey_schema::ClassTable;
use resurvey_schema::changes::Op;
use serde::Serialize;

/// What a second photo of a changed place did to the map that the first photo had updated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SecondPhoto {
    /// Whether its pose was reliable; nothing changes where it was not.
    pub reliable: bool,
    /// Changes that it made.
    pub changes: usize,
    /// Those of what the first photo, or this one, had found already.
    pub duplicates: usize,
    /// Those of what never happened.
    pub false_updates: usize,
    /// Those of what really happened and the first photo missed.
    pub newly_found: usize,
    /// Those that take back what the first photo made up.
    pub corrected: usize,
}

/// Scores `changes`, which a second photo with the truth `second` made after `first` was scored by `first_truth`.
pub fn score_second_photo(
    (first_truth, first): (&Truth, &ChangeScore),
    second: &Truth,
    changes: &[Change],
    classes: &ClassTable,
) -> SecondPhoto {
    let wanted = expected_changes(second);
    let mut taken: Vec<bool> = wanted.iter().map(|change| was_found(change, first_truth, first)).collect();
    let mut score = SecondPhoto { reliable: true, changes: changes.len(), ..SecondPhoto::default() };
    for change in changes {
        let (op, descriptor) = made(change);
        let (class, at) = (classes.name(descriptor.class()), descriptor.anchor());
        let is_false_one = |wrong: &super::changes::FalseUpdate| {
            wrong.op != Op::Remove && wrong.class == class && wrong.position.plan_distance_m(&at) < SAME_PLACE_M
        };
        let missed = nearest_true_change(&wanted, change, classes, |index| !taken[index]);
        if let Some((index, _)) = missed {
            taken[index] = true;
            score.newly_found += 1;
        } else if nearest_true_change(&wanted, change, classes, |_| true).is_some() {
            score.duplicates += 1;
        } else if op == Op::Remove && first.false_updates.iter().any(is_false_one) {
            score.corrected += 1;
        } else if op == Op::Remove && is_replaced(&wanted, class, change) || is_piece_of_walls(second, class) {
            score.newly_found += 1;
        } else {
            score.false_updates += 1;
        }
    }
    score
}

/// Two states of one descriptor are this near, metres: it was put there by the first photo and is on the map so.
const SAME_PLACE_M: f64 = 1e-3;

/// Whether the first photo found `change`, which both truths have.
fn was_found(change: &TrueChange, first_truth: &Truth, first: &ChangeScore) -> bool {
    let same = |other: &TrueChange| {
        let distance_m = change.position.zip(other.position).map(|(a, b)| a.plan_distance_m(&b));
        other.op == change.op && other.class == change.class && distance_m.is_some_and(|m| m < SAME_PLACE_M)
    };
    let firsts = expected_changes(first_truth);
    firsts.iter().zip(&first.expected).any(|(other, score)| same(other) && score.found.is_some())
}

/// Whether a removal takes what a true change replaced and the first photo left beside it.
fn is_replaced(wanted: &[&TrueChange], class: &str, removal: &Change) -> bool {
    let at = made(removal).1.anchor();
    wanted.iter().filter_map(|change| change.replaces.as_ref()).any(|replaced| {
        replaced.class == class && replaced.place().is_some_and(|place| place.plan_distance_m(&at) <= SAME_CHANGE_M)
    })
}

#[cfg(test)]
mod tests {
    use super::super::changes::tests::{ADDED, BANNER, GONE, chair, material, score, truth};
    use super::*;

    fn second(first_made: &[Change], then: &[Change]) -> SecondPhoto {
        let truth = truth(&[ADDED, GONE].join(","));
        let first = score(&truth, first_made);
        score_second_photo((&truth, &first), &truth, then, &ClassTable::default())
    }

    fn banner(east_m: f64) -> Change {
        Change::Add(material(BANNER, 3.0, east_m))
    }

    #[test]
    fn what_the_first_photo_found_is_a_duplicate_and_what_it_missed_is_news() {
        let removed = Change::Remove { fid: 7, before: chair(10.0, 10.5) };
        let both = second(&[banner(0.1)], &[banner(0.3), removed]);
        assert_eq!(
            both,
            SecondPhoto { reliable: true, changes: 2, duplicates: 1, newly_found: 1, ..Default::default() }
        );
        let moved = Change::Modify { fid: 9, before: material(BANNER, 3.0, 0.1), after: material(BANNER, 3.4, 0.1) };
        assert_eq!(second(&[banner(0.1)], &[moved]).duplicates, 1);
        let twice = second(&[], &[banner(0.1), banner(0.2)]);
        assert_eq!((twice.newly_found, twice.duplicates), (1, 1));
    }

    #[test]
    fn what_never_happened_is_false_and_what_takes_it_back_is_a_correction() {
        let made_up = Change::Add(chair(3.0, 3.0));
        assert_eq!(second(&[], std::slice::from_ref(&made_up)).false_updates, 1);
        let taken_back = Change::Remove { fid: 4, before: chair(3.0, 3.0) };
        let after = second(&[made_up], std::slice::from_ref(&taken_back));
        assert_eq!((after.corrected, after.false_updates), (1, 0));
        // Taking the true banner away again is as false as anything.
        let undone = Change::Remove { fid: 5, before: material(BANNER, 3.0, 0.1) };
        assert_eq!(second(&[banner(0.1)], &[undone]).false_updates, 1);
        assert_eq!(second(&[banner(0.1)], &[]), SecondPhoto { reliable: true, ..Default::default() });
    }
}
