//! Why a true change was missed: the rejection that came nearest.

use super::changes::{ChangeScore, ExpectedChange};
use resurvey_schema::changes::Op;
use resurvey_schema::{ClassTable, Rejection};

impl ChangeScore {
    /// Says of every change that was missed which requirement stopped it: that of the largest region that was refused
    /// and is of its class (in the photo for what came, in the map for what went), each region once while there are
    /// others; `otherwise` where there is none.
    pub fn explain(&mut self, rejections: &[Rejection], otherwise: &str, classes: &ClassTable) {
        let mut left: Vec<&Rejection> = rejections.iter().collect();
        left.sort_by_key(|rejection| std::cmp::Reverse(rejection.pixels));
        for change in self.expected.iter_mut().filter(|change| change.found.is_none()) {
            let fits = |rejection: &&Rejection| is_of(rejection, change, classes);
            let requirement = match left.iter().position(fits) {
                Some(index) => Some(&left.remove(index).requirement),
                None => rejections.iter().filter(fits).max_by_key(|one| one.pixels).map(|one| &one.requirement),
            };
            change.why_missed = Some(requirement.map_or_else(|| otherwise.to_owned(), ToOwned::to_owned));
        }
    }
}

fn is_of(rejection: &Rejection, change: &ExpectedChange, classes: &ClassTable) -> bool {
    let class = if change.op == Op::Remove { rejection.class_before } else { rejection.class_after };
    classes.name(class) == change.class
}

#[cfg(test)]
mod tests {
    use super::super::changes::tests::{ADDED, BANNER, CHAIR, GONE, material, score, truth};
    use super::*;
    use crate::update::Change;
    use resurvey_schema::ClassId;

    fn refused(requirement: &str, before: ClassId, after: ClassId, pixels: u32) -> Rejection {
        Rejection {
            class_before: before,
            class_after: after,
            pixels,
            requirement: requirement.to_owned(),
            measured: 2.0,
            limit: 1.0,
            unit: "m".to_owned(),
        }
    }

    fn why(changes: &[&str], made: &[Change], rejections: &[Rejection]) -> Vec<Option<String>> {
        let mut score = score(&truth(&changes.join(",")), made);
        score.explain(rejections, "nothing-seen", &ClassTable::default());
        score.expected.into_iter().map(|change| change.why_missed).collect()
    }

    fn words(all: &[Option<&str>]) -> Vec<Option<String>> {
        all.iter().map(|one| one.map(ToOwned::to_owned)).collect()
    }

    #[test]
    fn the_largest_region_of_the_class_says_why_a_change_was_missed() {
        let stone = ClassId(0);
        let rejections = [
            refused("size", stone, BANNER, 40),
            refused("rectangle", stone, BANNER, 900),
            refused("uncertain", CHAIR, stone, 70),
            refused("within-range", stone, ClassId(1), 5000),
        ];
        assert_eq!(why(&[ADDED, GONE], &[], &rejections), words(&[Some("rectangle"), Some("uncertain")]));
        assert_eq!(
            why(&[ADDED, ADDED, ADDED], &[], &rejections[..2]),
            words(&[Some("rectangle"), Some("size"), Some("rectangle")])
        );
    }

    #[test]
    fn what_was_found_needs_no_reason_and_what_nothing_was_said_of_has_the_general_one() {
        let made = [Change::Add(material(BANNER, 3.0, 0.0))];
        let rejections = [refused("rectangle", ClassId(0), BANNER, 900)];
        assert_eq!(why(&[ADDED, GONE], &made, &rejections), words(&[None, Some("nothing-seen")]));
    }
}
