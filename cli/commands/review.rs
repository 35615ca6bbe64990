//! `update --propose` and `--confirm`: changes that wait for a reviewer or for other captures; and `--idempotency-key`,
//! which commits a capture that is sent twice once.

use super::diff::Sides;
use super::update::{Committed, Outcome, Run, message_of};
use crate::conflict::refused;
use crate::failure::Failure;
use jiff::Timestamp;
use resurvey_core::capture::Capture;
use resurvey_core::store::{History, MapFile, ProposalStatus, StoreError};
use resurvey_core::update::{Change, Confirmation, add_changes, confirm, testimonies};
use resurvey_core::version::{Decision, Digest, Observation, UpdateTransaction, VersionId, VersionKind};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;

/// What becomes of a change instead of a version at once.
#[derive(Clone, Copy, Debug)]
pub enum Review {
    /// A proposal, until someone decides.
    Propose,
    /// A proposal, until so many captures agree.
    Confirm(usize),
}

impl Run<'_> {
    /// Keeps each change as a proposal, and commits those that enough captures agree on.
    pub(super) fn put_forward(
        &self,
        review: Review,
        (base, capture): (VersionId, &Capture),
        evidence: &Observation,
        outcome: &Outcome,
    ) -> Result<Committed, Failure> {
        let now = Timestamp::now();
        let changes = &outcome.resolution.changes;
        let begin = |changes: &[Change], message: String| {
            let message = self.recording.message.map_or(message, ToOwned::to_owned);
            let mut transaction = UpdateTransaction::new(base, VersionKind::Update, self.recording.author, message);
            transaction.observed_at = capture.taken_at;
            transaction.viewed_region = outcome.viewed_region;
            add_changes(&mut transaction, changes);
            transaction
        };
        let proposed: Vec<UpdateTransaction> = (changes.iter())
            .map(|change| {
                let mut transaction = begin(std::slice::from_ref(change), message_of(std::slice::from_ref(change)));
                // The same capture again says the same, once.
                transaction.idempotency_key =
                    Some(format!("{}:{}", capture.digest, Digest::of(format!("{change:?}").as_bytes())));
                transaction
            })
            .collect();
        let evidence = Observation { decision: Decision::Proposed, ..evidence.clone() };
        let proposals = self.map.propose_each(&proposed, &evidence, now)?;
        let decided = self.decided(&proposals)?;
        let decision = if decided.len() == proposals.len() { Decision::Nothing } else { Decision::Proposed };
        let waiting = Committed { proposals, decided, ..Committed::nothing(decision) };
        let Review::Confirm(captures) = review else { return Ok(waiting) };

        let confirmed = self.confirmed(&waiting.proposals, captures)?;
        if confirmed.is_empty() {
            return Ok(waiting);
        }
        let changes: Vec<Change> = confirmed.iter().map(|one| one.change.clone()).collect();
        let closed: BTreeSet<u64> = confirmed.iter().flat_map(|one| one.proposals.iter().copied()).collect();
        let note = format!("confirmed by {captures} captures or more");
        let mut transaction = begin(&changes, format!("{}, {note}", message_of(&changes)));
        let mut confirmations: Vec<Digest> = Vec::new();
        for digest in confirmed.iter().flat_map(|one| &one.observations) {
            if !confirmations.contains(digest) {
                confirmations.push(*digest);
            }
        }
        transaction.evidence = Some(Observation { decision: Decision::Committed, confirmations, ..evidence });
        let closed: Vec<u64> = closed.into_iter().collect();
        let confirmed = self.map.confirm(&closed, &transaction, &note, now);
        let version = confirmed.map_err(|error| refused(error, self.map, &transaction.deltas))?;
        let did = self.map.changes_of(version)?;
        let added: Vec<u64> = did.iter().filter(|delta| delta.before().is_none()).map(|delta| delta.fid().0).collect();
        // Where only some were confirmed, numbers cannot be told apart.
        let fids = if changes.len() == outcome.resolution.changes.len() { added } else { Vec::new() };
        Ok(Committed { decision: Decision::Committed, version: Some(version), fids, did: Some(did), ..waiting })
    }

    /// Those of the proposals that somebody decided before: the same capture again says the same, once.
    fn decided(&self, proposals: &[u64]) -> Result<Vec<(u64, &'static str)>, Failure> {
        let mut decided = Vec::new();
        for id in proposals {
            match self.map.proposal(*id)?.status {
                ProposalStatus::Open => {}
                ProposalStatus::Accepted(_) => decided.push((*id, "accepted")),
                ProposalStatus::Rejected => decided.push((*id, "rejected")),
            }
        }
        Ok(decided)
    }

    /// The changes among the proposals `own` on which enough captures agree.
    fn confirmed(&self, own: &[u64], captures: usize) -> Result<Vec<Confirmation>, Failure> {
        let all = testimonies(self.map)?;
        let mut taken = BTreeSet::new();
        let mut confirmed = Vec::new();
        for testimony in all.iter().filter(|one| own.contains(&one.proposal)) {
            let Some(found) = confirm(testimony, &all, captures) else { continue };
            // Two changes of one capture never share what confirms them.
            if found.proposals.iter().all(|id| !taken.contains(id)) {
                taken.extend(found.proposals.iter().copied());
                confirmed.push(found);
            }
        }
        Ok(confirmed)
    }
}

/// What was printed when the same capture was sent with this key for the first time, as far as the map knows it; `None` for
/// a new key. `photo` is what a segmenter reads, if any.
pub(super) fn repeated(
    map: &MapFile,
    key: Option<&str>,
    path: &Path,
    photo: Option<&Path>,
) -> Result<Option<Value>, Failure> {
    if key.is_none() {
        return Ok(None);
    }
    let asked = (VersionKind::Update, Some(Capture::digest_of(path, photo)?));
    let Some(version) = map.repeated(key, asked)? else { return Ok(None) };
    let record = map.version(version)?;
    let snapshot = map.snapshot(map.head()?)?;
    let sides = Sides { before: snapshot.classes(), after: snapshot.classes() };
    let changes = match map.changes_of(version) {
        // It was committed, and that is the answer.
        Err(StoreError::Forgotten { .. }) => Vec::new(),
        known => known?,
    };
    let changes = changes.iter().map(|delta| sides.document(delta)).collect::<Result<Vec<_>, _>>()?;
    Ok(Some(json!({
        "capture": path.display().to_string(),
        "base_version": record.base.map(|base| base.0),
        "version": version.0,
        "decision": "committed",
        "repeated": true,
        "localization": null,
        "changes": changes,
        "rejections": [],
        "plugins": [],
        "timings_ms": {},
    })))
}
