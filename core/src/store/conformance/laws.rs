//! Laws of random histories.

use super::play::{apply, part, update};
use super::{Content, Make, Moves, Subject, at, content, moves, new_map, play, sound, transaction};
use crate::store::{CommitError, ConflictingChange, History, MemoryMap, Revert, StoreError};
use crate::version::{
    BoxMm, Counts, Delta, FeatureState, Operations, UpdateTransaction, VersionId, VersionRecord, version_hash,
};
use jiff::SignedDuration;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

fn cases() -> ProptestConfig {
    ProptestConfig { cases: 32, failure_persistence: None, ..ProptestConfig::default() }
}

/// Holds `law` for random histories in stores that `make` makes.
fn for_all<S: Strategy>(
    make: Make<'_>,
    strategy: S,
    law: impl Fn(&dyn Subject, &[Moves], S::Value) -> Result<(), TestCaseError>,
) {
    let outcome = TestRunner::new(cases()).run(&(moves(), strategy), |(transactions, extra)| {
        let subject = make(&new_map(), at(0));
        law(subject.as_ref(), &transactions, extra)?;
        subject.inspect().map_err(TestCaseError::fail)
    });
    if let Err(error) = outcome {
        panic!("{error}");
    }
}

pub(super) fn wish(version: u64, region: Option<BoxMm>) -> Revert {
    Revert {
        version: VersionId(version),
        region,
        author: "ada".to_owned(),
        message: None,
        idempotency_key: None,
        request: None,
    }
}

fn undo(history: &dyn History, version: usize) -> Result<VersionId, CommitError> {
    history.revert(&wish(version as u64, None), at(100))
}

fn is_in(state: &FeatureState, region: &BoxMm) -> bool {
    state.bounds().is_ok_and(|bounds| bounds.intersects(region))
}

fn touches(delta: &Delta, region: &BoxMm) -> bool {
    delta.before().into_iter().chain(delta.after()).any(|state| is_in(state, region))
}

/// state(v) is the replay of the changes 1…v, and what v held when it was made.
pub fn every_version_stays_as_it_was_and_is_the_replay_of_its_changes(make: Make<'_>) {
    for_all(make, Just(()), |subject, transactions, ()| {
        let history = subject.history();
        let contents = play(history, transactions);
        let mut replayed = Content::new();
        for (version, expected) in contents.iter().enumerate() {
            apply(&mut replayed, &history.changes_of(VersionId(version as u64)).expect("changes"));
            prop_assert_eq!(&replayed, expected);
            prop_assert_eq!(&content(history, version), expected);
            for (fid, state) in expected {
                let alone = history.feature(VersionId(version as u64), *fid).expect("a feature");
                prop_assert_eq!(&alone.state, state);
            }
            let boxes = expected.values().filter_map(|state| state.bounds().ok());
            let around = boxes.reduce(|all, next| all.union(&next));
            prop_assert_eq!(history.bounds(VersionId(version as u64)), Ok(around));
        }
        Ok(())
    });
}

/// diff(a, b) leads from a to b, and is the inverse of diff(b, a).
pub fn a_difference_leads_from_one_version_to_the_other_and_back(make: Make<'_>) {
    for_all(make, (any::<usize>(), any::<usize>()), |subject, transactions, (a, b)| {
        let history = subject.history();
        let contents = play(history, transactions);
        let (a, b) = (a % contents.len(), b % contents.len());
        let difference = |from: usize, to: usize| {
            history.changes(VersionId(from as u64), VersionId(to as u64), None).expect("changes")
        };
        let mut here = contents[a].clone();
        apply(&mut here, &difference(a, b));
        prop_assert_eq!(&here, &contents[b]);
        let undone: Vec<Delta> = difference(a, b).into_iter().map(Delta::undone).collect();
        prop_assert_eq!(undone, difference(b, a));
        Ok(())
    });
}

/// Features, changes, the log and the second time axis of a region are those of the whole map that lie there.
pub fn a_question_about_a_region_is_the_whole_answer_filtered(make: Make<'_>) {
    for_all(make, (part(), any::<usize>(), 0_i64..9), |subject, transactions, (region, other, minute)| {
        let history = subject.history();
        let contents = play(history, transactions);
        let other = VersionId((other % contents.len()) as u64);
        for version in (0..contents.len() as u64).map(VersionId) {
            let mut features = history.features(version, None).expect("features");
            features.retain(|feature| is_in(&feature.state, &region));
            prop_assert_eq!(history.features(version, Some(&region)), Ok(features));
            let mut observed = history.features_observed(version, at(minute), None).expect("features");
            observed.retain(|feature| is_in(&feature.state, &region));
            prop_assert_eq!(history.features_observed(version, at(minute), Some(&region)), Ok(observed));
            let mut changes = history.changes(other, version, None).expect("changes");
            changes.retain(|delta| touches(delta, &region));
            prop_assert_eq!(history.changes(other, version, Some(&region)), Ok(changes));
        }
        let mut log = Vec::new();
        for record in history.log(None).expect("a log") {
            let deltas = history.changes_of(record.version).expect("changes");
            let counts = Counts::of(deltas.iter().filter(|delta| touches(delta, &region)));
            log.extend((counts != Counts::default()).then_some(VersionRecord { counts: Some(counts), ..record }));
        }
        prop_assert_eq!(history.log(Some(&region)), Ok(log));
        Ok(())
    });
}

/// The newest version undone is the one before; that undone is the original.
pub fn an_undo_undone_is_the_original(make: Make<'_>) {
    for_all(make, Just(()), |subject, transactions, ()| {
        let history = subject.history();
        let contents = play(history, transactions);
        let head = contents.len() - 1;
        prop_assume!(head > 0);
        for (undone, expected) in [(head, &contents[head - 1]), (head + 1, &contents[head])] {
            prop_assert_eq!(undo(history, undone), Ok(VersionId(undone as u64 + 1)));
            prop_assert_eq!(&content(history, undone + 1), expected);
        }
        Ok(())
    });
}

/// Undone from the newest on, every version gives the one before it.
pub fn all_versions_undone_leave_the_empty_map(make: Make<'_>) {
    for_all(make, Just(()), |subject, transactions, ()| {
        let history = subject.history();
        let contents = play(history, transactions);
        for version in (1..contents.len()).rev() {
            let made = undo(history, version).expect("an undo");
            prop_assert_eq!(&content(history, made.0 as usize), &contents[version - 1]);
        }
        Ok(())
    });
}

/// An undo of any version restores all that it changed, or is refused with each feature that changed since, and by whom.
pub fn an_undo_restores_every_feature_or_names_who_changed_it(make: Make<'_>) {
    for_all(make, any::<usize>(), |subject, transactions, which| {
        let history = subject.history();
        let head = play(history, transactions).len() - 1;
        prop_assume!(head > 0);
        let version = VersionId(1 + (which % head) as u64);
        let did = history.changes_of(version).expect("changes");
        match undo(history, version.0 as usize) {
            Ok(made) => {
                let now = content(history, made.0 as usize);
                for delta in &did {
                    prop_assert_eq!(now.get(&delta.fid()), delta.before());
                }
            }
            Err(CommitError::Conflict { changed, .. }) => {
                prop_assert!(!changed.is_empty());
                for ConflictingChange { fid, changed_in, .. } in changed {
                    prop_assert!(did.iter().any(|delta| delta.fid() == fid) && changed_in > Some(version));
                }
                prop_assert_eq!(history.head(), Ok(VersionId(head as u64)));
            }
            other => prop_assert!(false, "{:?}", other),
        }
        Ok(())
    });
}

/// Where every photo is committed when it is taken, what was seen by then is what the map was then.
pub fn both_time_axes_agree_where_photos_come_in_order(make: Make<'_>) {
    for_all(make, Just(()), |subject, transactions, ()| {
        let history = subject.history();
        let contents = play(history, transactions);
        let head = VersionId(contents.len() as u64 - 1);
        for (version, expected) in contents.iter().enumerate() {
            let observed = history.features_observed(head, at(version as i64), None).expect("features");
            let observed: Content = observed.into_iter().map(|one| (one.fid, one.state)).collect();
            prop_assert_eq!(&observed, expected);
            prop_assert_eq!(history.version_at(at(version as i64)), Ok(VersionId(version as u64)));
        }
        Ok(())
    });
}

/// The chain of hashes can be worked out again from the answers.
pub fn the_hash_of_a_version_is_that_of_its_changes_and_the_version_before(make: Make<'_>) {
    for_all(make, Just(()), |subject, transactions, ()| {
        let history = subject.history();
        let versions = play(history, transactions).len() as u64;
        let frame = new_map().frame;
        let mut parent = None;
        for version in (0..versions).map(VersionId) {
            let deltas = history.changes_of(version).expect("changes");
            let classes = history.classes(version).expect("classes");
            let first = (version.0 == 0).then_some((&frame, &classes));
            let (frame, classes) = first.unzip();
            let mut operations = Operations::start(frame, classes, deltas.len() as u64);
            deltas.iter().for_each(|delta| operations.add(delta));
            let record = history.version(version).expect("a version");
            let hash = version_hash(parent, operations.finish(), record.evidence);
            prop_assert_eq!(record.hash, hash);
            prop_assert_eq!(record.counts, Some(Counts::of(&deltas)));
            parent = Some(hash);
        }
        Ok(())
    });
}

/// The lives of a feature follow one another, and each holds from its first version to before its last.
pub fn lives_have_no_gaps_but_where_a_feature_was_gone(make: Make<'_>) {
    for_all(make, Just(()), |subject, transactions, ()| {
        let history = subject.history();
        let contents = play(history, transactions);
        let fids = contents.iter().flat_map(Content::keys).copied().collect::<std::collections::BTreeSet<_>>();
        for fid in fids {
            let lives = history.lives(fid).expect("lives");
            for (version, content) in contents.iter().enumerate().map(|(version, one)| (VersionId(version as u64), one))
            {
                let holds =
                    |life: &&crate::version::Feature| life.from <= version && life.to.is_none_or(|to| to > version);
                let then: Vec<_> = lives.iter().filter(holds).map(|life| &life.state).collect();
                prop_assert_eq!(then, content.get(&fid).into_iter().collect::<Vec<_>>());
            }
            let steps = history.log_of(fid).expect("a log");
            let changed = |version: &VersionId| {
                let [before, after] = [version.0 - 1, version.0].map(|version| contents[version as usize].get(&fid));
                before != after
            };
            let expected: Vec<_> = (1..contents.len() as u64).rev().map(VersionId).filter(changed).collect();
            prop_assert_eq!(steps.iter().map(|record| record.version).collect::<Vec<_>>(), expected);
        }
        Ok(())
    });
}

/// A writer who saw an older version, looked somewhere, or took the photo at another time.
#[derive(Clone, Debug)]
struct Writer {
    behind: u64,
    looked: Option<BoxMm>,
    seen: Option<i64>,
    undoes: Option<(usize, Option<BoxMm>)>,
}

fn writers() -> impl Strategy<Value = Vec<Writer>> {
    let undoes = proptest::option::weighted(0.3, (any::<usize>(), proptest::option::of(part())));
    let one = (0_u64..3, proptest::option::of(part()), proptest::option::of(0_i64..50), undoes);
    let one = one.prop_map(|(behind, looked, seen, undoes)| Writer { behind, looked, seen, undoes });
    proptest::collection::vec(one, 8)
}

/// Several writers at once: the same calls as to [`MemoryMap`] give the same versions, answers and refusals.
pub fn answers_and_refusals_are_those_of_the_plain_map(make: Make<'_>) {
    for_all(make, writers(), |subject, transactions, writers| {
        let history = subject.history();
        let plain = MemoryMap::new(&new_map(), at(0)).expect("a map");
        for (step, (moves, writer)) in transactions.iter().zip(&writers).enumerate() {
            // Between two microseconds, which is what a map keeps.
            let now = at(10 * step as i64) + SignedDuration::from_nanos(1_234_567);
            let head = plain.head().expect("a head").0;
            if let Some((undone, region)) = writer.undoes {
                let wish = wish(undone as u64 % (head + 2), region);
                prop_assert_eq!(history.revert(&wish, now), plain.revert(&wish, now));
                continue;
            }
            let base = head.saturating_sub(writer.behind);
            let mut update: UpdateTransaction = update(base, &content(&plain, base as usize), moves);
            update.viewed_region = writer.looked;
            update.observed_at = writer.seen.map(|minute| at(minute) + SignedDuration::from_nanos(1_500));
            prop_assert_eq!(history.commit(&update, now), plain.commit(&update, now));
        }
        same_answers(history, &plain)
    });
}

fn same_answers(history: &dyn History, plain: &dyn History) -> Result<(), TestCaseError> {
    prop_assert_eq!(history.log(None), plain.log(None));
    for version in (0..=plain.head().expect("a head").0).map(VersionId) {
        prop_assert_eq!(history.features(version, None), plain.features(version, None));
        prop_assert_eq!(history.changes_of(version), plain.changes_of(version));
        for minute in [0, 7, 20, 45, 70] {
            let [found, expected] =
                [history, plain].map(|history| history.features_observed(version, at(minute), None));
            prop_assert_eq!(found, expected);
        }
    }
    Ok(())
}

/// What is refused changes no answer.
pub fn a_refusal_leaves_no_trace(make: Make<'_>) {
    for_all(make, Just(()), |subject, transactions, ()| {
        let history = subject.history();
        let contents = play(history, transactions);
        let head = contents.len() as u64 - 1;
        let before = (history.log(None), content(history, head as usize));
        let never = Delta::remove(crate::version::Fid(10_000), super::chair(0.0));
        let mut stale = transaction(head);
        stale.deltas = vec![never];
        stale.additions = vec![super::banner(0.0)];
        let is_conflict = matches!(history.commit(&stale, at(99)), Err(CommitError::Conflict { .. }));
        prop_assert!(is_conflict, "a feature that was never there is removed");
        let mut broken = transaction(head);
        broken.additions = vec![super::chair(1.0), super::chair(f64::NAN)];
        let is_refused = matches!(history.commit(&broken, at(99)), Err(CommitError::State { .. }));
        prop_assert!(is_refused, "a chair stands nowhere");
        let ahead = history.commit(&transaction(head + 1), at(99));
        let missing = StoreError::NoSuchVersion { version: VersionId(head + 1), head: VersionId(head) };
        prop_assert_eq!(ahead, Err(CommitError::Store(missing)));
        prop_assert_eq!((history.log(None), content(history, head as usize)), before);
        Ok(())
    });
    sound(make(&new_map(), at(0)).as_ref());
}
