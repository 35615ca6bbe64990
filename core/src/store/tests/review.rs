//! Proposals that share evidence, confirmations, and conflicts with what others looked at.

use super::history::observation;
use super::*;
use crate::store::{ProposalStatus, StoreError};
use crate::version::{BoxMm, Decision, Delta, UpdateTransaction};

/// 20 m around the chair at `offset` m.
fn view(offset: f64) -> Option<BoxMm> {
    let n = 817_816.210_8 + offset;
    Some(BoxMm::of_plan(835_550.0, n - 20.0, 835_590.0, n + 20.0).unwrap())
}

fn looking(base: u64, at_offset: f64, additions: Vec<FeatureState>) -> UpdateTransaction {
    UpdateTransaction { viewed_region: view(at_offset), additions, ..transaction(base) }
}

#[test]
fn a_change_where_another_looked_since_the_base_is_a_conflict_that_names_it() {
    let scratch = Scratch::with_two_features();
    // Looks at 200 ± 20 m and finds a chair at 215 m.
    assert_eq!(scratch.map.commit(&looking(1, 200.0, vec![chair(215.0)]), at(2)), Ok(VersionId(2)));
    // Sees nothing of that chair, but puts its own where the other saw none.
    let mut second = looking(1, 175.0, vec![chair(190.0)]);
    let CommitError::Conflict { base, head, changed, looked_at } = scratch.map.commit(&second, at(3)).unwrap_err()
    else {
        panic!()
    };
    assert_eq!((base, head, changed, looked_at), (VersionId(1), VersionId(2), vec![], vec![VersionId(2)]));
    assert_eq!(scratch.map.head(), Ok(VersionId(2)));
    // From the new head it is no contradiction: it knows what the other saw.
    second.base = VersionId(2);
    assert_eq!(scratch.map.commit(&second, at(4)), Ok(VersionId(3)));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn two_from_one_base_that_look_at_different_places_both_pass() {
    let scratch = Scratch::with_two_features();
    assert_eq!(scratch.map.commit(&looking(1, 200.0, vec![chair(200.0)]), at(2)), Ok(VersionId(2)));
    assert_eq!(scratch.map.commit(&looking(1, 300.0, vec![chair(300.0)]), at(3)), Ok(VersionId(3)));
}

#[test]
fn several_proposals_of_one_capture_share_its_evidence() {
    let scratch = Scratch::with_two_features();
    let mut removal = transaction(1);
    removal.deltas = vec![Delta::remove(Fid(2), chair(100.0))];
    let proposals = [looking(1, 0.0, vec![chair(5.0)]), removal];
    let ids = scratch.map.propose_each(&proposals, &observation(Decision::Proposed), at(2)).unwrap();
    assert_eq!((ids.as_slice(), scratch.map.observations().unwrap().len()), (&[1, 2][..], 1));
    assert_eq!(scratch.map.accept(1, "ada", "", at(3)), Ok(VersionId(2)));
    assert_eq!(scratch.map.accept(2, "ada", "", at(4)), Ok(VersionId(3)));
    let capture = |version| scratch.map.observation_of(VersionId(version)).unwrap().unwrap().observation.capture;
    assert_eq!(capture(2), capture(3));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn what_a_proposal_looked_at_counts_once_it_is_accepted() {
    let scratch = Scratch::with_two_features();
    let id = scratch.map.propose(&looking(1, 200.0, vec![chair(215.0)]), at(2)).unwrap();
    assert_eq!(scratch.map.accept(id, "ada", "", at(3)), Ok(VersionId(2)));
    // Where the photo behind it saw no chair, a writer who does not know of it puts one.
    let refused = scratch.map.commit(&looking(1, 175.0, vec![chair(190.0)]), at(4));
    assert!(matches!(refused, Err(CommitError::Conflict { looked_at, .. }) if looked_at == [VersionId(2)]));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn what_is_done_together_is_done_whole_or_not_at_all() {
    let scratch = Scratch::with_two_features();
    let both = |second: f64| {
        scratch.map.together(|map| -> Result<_, CommitError> {
            map.commit(&UpdateTransaction { additions: vec![chair(1.0)], ..transaction(1) }, at(2))?;
            // A part that is refused leaves the rest of the work alone; what becomes of that is for the work to say.
            let alone = map.commit(&UpdateTransaction { additions: vec![chair(f64::NAN)], ..transaction(2) }, at(2));
            assert!(matches!(alone, Err(CommitError::State { .. })));
            map.commit(&UpdateTransaction { additions: vec![chair(second)], ..transaction(2) }, at(3))
        })
    };
    assert!(matches!(both(f64::NAN), Err(CommitError::State { .. })));
    assert_eq!(scratch.map.head(), Ok(VersionId(1)));
    assert_eq!(both(2.0), Ok(VersionId(3)));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn what_is_confirmed_closes_its_proposals_or_nothing_happens() {
    let scratch = Scratch::with_two_features();
    let propose = |offset: f64| {
        let update = UpdateTransaction {
            evidence: Some(observation(Decision::Proposed)),
            ..looking(1, 0.0, vec![chair(offset)])
        };
        scratch.map.propose(&update, at(2)).unwrap()
    };
    let [first, second, third] = [5.0, 5.1, 60.0].map(propose);
    let digest = scratch.map.observation(1).unwrap().unwrap().digest;
    let mut fused = looking(1, 0.0, vec![chair(5.05)]);
    fused.evidence =
        Some(crate::version::Observation { confirmations: vec![digest], ..observation(Decision::Committed) });
    assert_eq!(scratch.map.confirm(&[first, second], &fused, "2 captures", at(3)), Ok(VersionId(2)));
    let status = |id| scratch.map.proposal(id).unwrap().status;
    let accepted = ProposalStatus::Accepted(VersionId(2));
    assert_eq!((status(first), status(second), status(third)), (accepted, accepted, ProposalStatus::Open));
    let seen = scratch.map.observation_of(VersionId(2)).unwrap().unwrap().observation;
    let behind = scratch.map.observation_named(seen.confirmations[0]).unwrap().unwrap();
    assert_eq!(behind.observation.decision, Decision::Proposed);
    // A second process that found the same two is too late, and leaves the third open.
    let late = scratch.map.confirm(&[first, third], &fused, "", at(4));
    let decided = StoreError::ProposalDecided { id: first, status: "accepted".to_owned() };
    assert_eq!(late, Err(CommitError::Store(decided)));
    assert_eq!((scratch.map.head(), status(third)), (Ok(VersionId(2)), ProposalStatus::Open));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
    // What confirmed the version is evidence that must be there.
    fsck::damage(&scratch, "DELETE FROM observation WHERE id <= 3");
    let problems: Vec<String> = scratch.map.fsck().unwrap().iter().map(ToString::to_string).collect();
    let expected = format!("observations: observation 4: is confirmed by observation {digest}, which is not there");
    assert!(problems.contains(&expected), "{problems:#?}");
}

#[test]
fn a_tag_is_deleted_only_when_asked_and_its_version_stays() {
    let scratch = Scratch::with_two_features();
    scratch.map.tag("surveyed", VersionId(1), at(2)).unwrap();
    assert_eq!(scratch.map.untag("surveyed"), Ok(VersionId(1)));
    assert_eq!(scratch.map.untag("surveyed"), Err(StoreError::NoSuchTag { name: "surveyed".to_owned() }));
    assert_eq!((scratch.map.tags(), scratch.map.head()), (Ok(vec![]), Ok(VersionId(1))));
}

#[test]
fn a_proposal_whose_key_made_a_version_is_refused_by_name_and_stays_open() {
    let scratch = Scratch::with_two_features();
    let keyed = |offset: f64| {
        let mut update = transaction(1);
        update.additions = vec![chair(offset)];
        update.idempotency_key = Some("photo 12".to_owned());
        update
    };
    let id = scratch.map.propose(&keyed(3.0), at(2)).unwrap();
    scratch.map.commit(&keyed(4.0), at(3)).unwrap();
    let error = scratch.map.accept(id, "ada", "", at(4)).unwrap_err();
    assert!(matches!(error, CommitError::OtherRequest { version: VersionId(2), .. }), "{error}");
    assert_eq!(scratch.map.proposal(id).unwrap().status, ProposalStatus::Open);
    // The same key with another proposal is no repetition either.
    let other = scratch.map.propose(&keyed(5.0), at(5)).unwrap_err();
    assert_eq!(other, CommitError::OtherProposal { key: "photo 12".to_owned(), id });
    assert_eq!(scratch.map.propose(&keyed(3.0), at(5)), Ok(id));
}
