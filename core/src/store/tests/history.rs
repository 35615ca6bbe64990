//! History: any version as it was, differences, logs, provenance, revisions.

use super::*;
use crate::store::{ProposalStatus, StoreError};
use crate::version::{
    BoxMm, Counts, Decision, Delta, Digest, Gate, LocalizationEvidence, ModelFile, Observation, PluginUse, SearchRange,
    Side, Step,
};
use resurvey_schema::service::Prior;
use resurvey_schema::{Alignment, CameraModel, Intrinsics, Pose, Rejection, RunnerUp};

#[test]
fn a_feature_that_leaves_the_region_is_a_modification_with_both_sides() {
    let scratch = Scratch::with_two_features();
    let mut update = transaction(1);
    update.deltas = vec![Delta::modify(Fid(2), chair(100.0), chair(0.0))];
    scratch.map.commit(&update, at(2)).unwrap();
    let old_place = BoxMm::of_plan(835_567.0, 817_915.0, 835_568.0, 817_917.0).unwrap();
    let deltas = scratch.map.changes(VersionId(1), VersionId(2), Some(&old_place)).unwrap();
    assert_eq!(deltas, update.deltas);
    let log: Vec<_> =
        scratch.map.log(Some(&old_place)).unwrap().iter().map(|record| (record.version.0, record.counts)).collect();
    let counts = |added, modified| Some(Counts { added, modified, removed: 0 });
    assert_eq!(log, [(2, counts(0, 1)), (1, counts(1, 0))]);
}

#[test]
fn a_point_on_the_edge_of_a_region_belongs_to_it_and_one_a_millimetre_away_does_not() {
    let scratch = Scratch::with_two_features();
    let snapshot = scratch.map.snapshot(VersionId(1)).unwrap();
    // The banner hangs at easting 835 567.7431: the box is 835 567.743 to 835 567.744.
    let count = |e0: f64, e1: f64| {
        let region = BoxMm::of_plan(e0, 817_810.0, e1, 817_830.0).unwrap();
        snapshot.features(Some(&region)).unwrap().len()
    };
    assert_eq!((count(835_567.744, 835_570.0), count(835_567.745_1, 835_570.0)), (1, 0));
    assert_eq!((count(835_000.0, 835_567.743), count(835_000.0, 835_567.741_9)), (1, 0));
    assert_eq!(snapshot.bounds().unwrap().unwrap().min()[0], 835_567_389); // 835 567.7431 − √(0.5²+0.5²)/2, floor
}

#[test]
fn the_log_of_a_feature_is_newest_first_and_says_what_happened_to_it_alone() {
    let scratch = Scratch::with_two_features();
    let mut update = transaction(1);
    update.deltas = vec![Delta::remove(Fid(2), chair(100.0)), Delta::modify(Fid(1), banner(0.0), banner(1.0))];
    scratch.map.commit(&update, at(2)).unwrap();
    let log: Vec<_> =
        scratch.map.log_of(Fid(2)).unwrap().into_iter().map(|record| (record.version.0, record.counts)).collect();
    assert_eq!(
        log,
        [(2, Some(Counts { removed: 1, ..Counts::default() })), (1, Some(Counts { added: 1, ..Counts::default() }))]
    );
    assert_eq!(scratch.map.log_of(Fid(9)), Err(StoreError::NeverAFeature { fid: Fid(9) }));
    let all: Vec<_> = scratch.map.log(None).unwrap().iter().map(|record| record.version.0).collect();
    assert_eq!(all, [2, 1, 0]);
}

pub(super) fn observation(decision: Decision) -> Observation {
    let pose = Pose {
        position: GridPoint::new(835_601.930_59, 817_797.110_28, 6.1),
        yaw_rad: 4.9,
        pitch_rad: 0.045,
        roll_rad: -0.024,
    };
    Observation {
        capture: Digest::of(b"capture"),
        photo: Some(Digest::of(b"photo")),
        taken_at: Some(at(-5)),
        labels: Some(b"png".to_vec()),
        prior: Some(Prior {
            pose,
            position_sigma_m: 15.0,
            height_sigma_m: 0.1,
            yaw_sigma_rad: 0.3,
            tilt_sigma_rad: 0.02,
        }),
        camera: Some(Intrinsics {
            model: CameraModel::Brown,
            width: 960,
            height: 720,
            fx: 700.1,
            fy: 700.3,
            cx: 480.0,
            cy: 360.0,
            distortion: [0.1, -0.01, 0.0, 1e-5, 0.0],
        }),
        search: Some(SearchRange { radius_m: 40.0, yaw_range_deg: 25.0 }),
        localization: Some(LocalizationEvidence {
            pose,
            score: Some(0.93),
            covariance: [[0.04, 0.0, 0.0], [0.0, 0.09, 0.0], [0.0, 0.0, 1e-5]],
            alignment: Some(Alignment { covariance: [[0.1; 6]; 6], map_sigma_m: 0.25, label_sigma_px: 2.3 }),
            runner_up: Some(RunnerUp { distance_m: 12.0, score_ratio: 0.4 }),
            candidates: 407_025,
        }),
        plugins: vec![PluginUse {
            kind: "matcher".to_owned(),
            name: "semantic".to_owned(),
            version: "0.1.0".to_owned(),
            sha256: Some(Digest::of(b"library")),
            settings: serde_json::json!({"radius_m": 40, "b": 1, "a": 0.1}),
            settings_sha256: Some(Digest::of(b"settings")),
            files: vec![ModelFile { setting: "weights".to_owned(), sha256: Digest::of(b"weights") }],
        }],
        gates: vec![Gate { name: "position-sigma".into(), measured: 0.3, limit: 1.0, unit: "m".into(), passed: true }],
        rejections: vec![Rejection {
            class_before: ClassId(0),
            class_after: ClassId(3),
            pixels: 900,
            requirement: "coplanar".to_owned(),
            measured: 0.31,
            limit: 0.1,
            unit: "m".to_owned(),
        }],
        decision,
        confirmations: Vec::new(),
    }
}

#[test]
fn why_shows_the_evidence_of_every_step_to_the_last_bit() {
    let scratch = Scratch::with_two_features();
    let mut update = transaction(1);
    update.deltas = vec![Delta::modify(Fid(1), banner(0.0), banner(1.0))];
    update.evidence = Some(observation(Decision::Committed));
    scratch.map.commit(&update, at(2)).unwrap();
    let [second, first] = &scratch.map.why(Fid(1)).unwrap()[..] else { panic!() };
    assert_eq!((first.record.version, &first.observation), (VersionId(1), &None));
    let recorded = second.observation.as_ref().unwrap();
    assert_eq!(recorded.observation, Observation { labels: None, ..observation(Decision::Committed) });
    assert_eq!((recorded.version, recorded.recorded_at), (Some(VersionId(2)), at(2)));
    assert_eq!(scratch.map.label_image(recorded.labels.unwrap()), Ok(Some(b"png".to_vec())));
    let (before, after) = (Side::State(banner(0.0)), Side::State(banner(1.0)));
    assert_eq!(second.step, Step { version: VersionId(2), before, after });
}

#[test]
fn an_attempt_that_was_refused_is_kept_with_numbers_that_are_none() {
    let scratch = Scratch::with_two_features();
    let mut attempt = observation(Decision::Unreliable);
    attempt.gates[0].measured = f64::INFINITY;
    assert_eq!(scratch.map.record_observation(VersionId(1), &attempt, at(3)), Ok(1));
    let kept = scratch.map.observations().unwrap().pop().unwrap();
    assert_eq!((kept.version, kept.base, kept.observation.decision), (None, VersionId(1), Decision::Unreliable));
    assert!(kept.observation.gates[0].measured.is_nan());
    assert_eq!(scratch.map.head(), Ok(VersionId(1)));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
    let unknown = StoreError::NoSuchVersion { version: VersionId(8), head: VersionId(1) };
    assert_eq!(scratch.map.record_observation(VersionId(8), &attempt, at(3)), Err(unknown));
}

#[test]
fn an_accepted_proposal_is_a_version_with_the_evidence_it_was_made_from() {
    let scratch = Scratch::with_two_features();
    let mut update = transaction(1);
    update.deltas = vec![Delta::modify(Fid(1), banner(0.0), banner(1.0))];
    update.additions = vec![chair(5.0)];
    update.viewed_region = Some(BoxMm::of_plan(835_000.0, 817_000.0, 836_000.0, 818_000.0).unwrap());
    update.evidence = Some(observation(Decision::Proposed));
    update.idempotency_key = Some("photo 4".to_owned());
    let id = scratch.map.propose(&update, at(2)).unwrap();
    assert_eq!(scratch.map.propose(&update, at(3)), Ok(id));
    assert_eq!(scratch.map.head(), Ok(VersionId(1)));
    let kept = scratch.map.proposal(id).unwrap();
    assert_eq!((kept.status, &kept.transaction.deltas), (ProposalStatus::Open, &update.deltas));
    assert_eq!(scratch.map.accept(id, "reviewer", "seen on site", at(4)), Ok(VersionId(2)));
    assert_eq!((scratch.live(1), scratch.live(3)), (banner(1.0), chair(5.0)));
    assert_eq!(scratch.map.observation_of(VersionId(2)).unwrap().unwrap().observation.decision, Decision::Proposed);
    assert_eq!(scratch.map.proposal(id).unwrap().status, ProposalStatus::Accepted(VersionId(2)));
    let again = scratch.map.reject(id, "reviewer", "", at(5));
    assert_eq!(again, Err(StoreError::ProposalDecided { id, status: "accepted".to_owned() }));
    assert_eq!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn a_proposal_whose_feature_changed_meanwhile_is_refused_and_stays_open() {
    let scratch = Scratch::with_two_features();
    let mut update = transaction(1);
    update.deltas = vec![Delta::remove(Fid(2), chair(100.0))];
    let id = scratch.map.propose(&update, at(2)).unwrap();
    let mut meanwhile = transaction(1);
    meanwhile.deltas = vec![Delta::modify(Fid(2), chair(100.0), chair(99.0))];
    scratch.map.commit(&meanwhile, at(3)).unwrap();
    let error = scratch.map.accept(id, "reviewer", "", at(4)).unwrap_err();
    assert!(matches!(error, CommitError::Conflict { base: VersionId(1), head: VersionId(2), .. }), "{error}");
    assert_eq!(scratch.map.proposal(id).unwrap().status, ProposalStatus::Open);
    scratch.map.reject(id, "reviewer", "it moved", at(5)).unwrap();
    assert_eq!(scratch.map.proposals().unwrap()[0].decision.as_ref().unwrap().note, "it moved");
    assert_eq!(scratch.map.proposal(9), Err(StoreError::NoSuchProposal { id: 9 }));
}

#[test]
fn a_tag_is_not_moved_and_not_confusable() {
    let scratch = Scratch::with_two_features();
    scratch.map.tag("surveyed", VersionId(1), at(2)).unwrap();
    let taken = StoreError::TagTaken { name: "surveyed".to_owned(), version: VersionId(1) };
    assert_eq!(scratch.map.tag("surveyed", VersionId(0), at(3)), Err(taken));
    for name in ["head", "12", "v3", "", "a..b", "@x", "with space"] {
        assert_eq!(scratch.map.tag(name, VersionId(0), at(3)), Err(StoreError::TagName { name: name.to_owned() }));
    }
}
