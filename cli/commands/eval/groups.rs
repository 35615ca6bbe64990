//! Summaries of all captures, of each noise level, scene and kind of change, and contender against contender.

use super::attempt::Record;
use super::contender::Contender;
use resurvey_core::evaluate::{Bootstrap, Difference, NoiseLevel, Summary, Trial};
use std::collections::BTreeSet;

/// Some captures.
pub struct Group {
    /// `all`, `noise`, `scene` or `kind`.
    pub by: &'static str,
    /// Which noise level, scene or kind; `all` for all.
    pub name: String,
    /// One a contender, in their order.
    pub summaries: Vec<Summary>,
    /// Each contender above the last one, in their order; the last is against itself and left out.
    pub differences: Vec<Difference>,
}

/// All captures first, then noise levels, then scenes, then kinds of change.
pub fn groups(records: &[Record], contenders: &[Contender], bootstrap: &Bootstrap) -> Vec<Group> {
    let group = |by, name: &str, holds: &dyn Fn(&Record) -> bool| {
        let captures: Vec<&Record> = records.iter().filter(|record| holds(record)).collect();
        let trials = |index: usize| -> Vec<&Trial> {
            captures.iter().filter_map(|record| Some(&record.attempts.get(index)?.trial)).collect()
        };
        let of_each: Vec<Vec<&Trial>> = (0..contenders.len()).map(trials).collect();
        let reference = of_each.last().map(Vec::as_slice).unwrap_or_default();
        let others = of_each.iter().take(contenders.len().saturating_sub(1));
        Group {
            by,
            name: name.to_owned(),
            summaries: of_each.iter().filter_map(|trials| Summary::of(trials, bootstrap)).collect(),
            differences: others.filter_map(|trials| Difference::of(trials, reference, bootstrap)).collect(),
        }
    };
    let mut groups = vec![group("all", "all", &|_| true)];
    let levels: BTreeSet<NoiseLevel> = records.iter().map(|record| record.case.truth.noise()).collect();
    groups
        .extend(levels.iter().map(|level| group("noise", level.name(), &|record| record.case.truth.noise() == *level)));
    let scenes: BTreeSet<&str> = records.iter().map(|record| record.case.truth.scene.as_str()).collect();
    groups.extend(scenes.iter().map(|scene| group("scene", scene, &|record| record.case.truth.scene == *scene)));
    let kinds: BTreeSet<&str> = records.iter().map(|record| record.case.truth.kind.as_str()).collect();
    groups.extend(kinds.iter().map(|kind| group("kind", kind, &|record| record.case.truth.kind == *kind)));
    groups
}
