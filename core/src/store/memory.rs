//! A map in memory: what [`History`] means, in the plainest form.

use super::commit_error::{CommitError, ConflictingChange};
use super::error::StoreError;
use super::interface::{History, Made};
use super::map_file::{NewMap, first_version};
use super::observations::evidence_digest;
use super::plan::{
    check_digests, check_new_classes, check_numbers, check_request, check_states, needed_geometry, plan, starts_from,
    touched, whole_microseconds,
};
use super::revisions::check_tag_name;
use super::rows::check_classes;
use crate::version::{
    BoxMm, Counts, Delta, Digest, Feature, FeatureState, Fid, UpdateTransaction, VersionId, VersionKind, VersionRecord,
};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use std::cell::RefCell;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

/// A map that is gone when it is dropped, for tests and for measures of other stores.
///
/// It keeps what every version did and works every answer out from that: right by inspection, slow by design. It
/// forgets nothing and keeps no evidence but its digest.
#[derive(Debug)]
pub struct MemoryMap(RefCell<Contents>);

#[derive(Debug)]
struct Contents {
    versions: Vec<Kept>,
    geometries: BTreeMap<Digest, Vec<u8>>,
    tags: BTreeMap<String, VersionId>,
}

/// One version and what it did.
#[derive(Debug)]
struct Kept {
    record: VersionRecord,
    deltas: Vec<Delta>,
    classes: ClassTable,
    looked_at: Option<BoxMm>,
    request: Option<Digest>,
}

type State = BTreeMap<Fid, FeatureState>;

impl MemoryMap {
    /// A map with version 0, which holds nothing.
    pub fn new(new: &NewMap, now: Timestamp) -> Result<Self, StoreError> {
        check_classes(&new.classes)?;
        let record = first_version(new, whole_microseconds(now));
        let first = Kept { record, deltas: Vec::new(), classes: new.classes.clone(), looked_at: None, request: None };
        let contents = Contents { versions: vec![first], geometries: BTreeMap::new(), tags: BTreeMap::new() };
        Ok(Self(RefCell::new(contents)))
    }
}

impl Contents {
    fn head(&self) -> &Kept {
        self.versions.last().expect("invariant: version 0 is made with the map")
    }

    fn made(&self, version: VersionId) -> Result<&Kept, StoreError> {
        let made = usize::try_from(version.0).ok().and_then(|version| self.versions.get(version));
        made.ok_or(StoreError::NoSuchVersion { version, head: self.head().record.version })
    }

    /// Every delta of the versions up to `version`, with its version, oldest first.
    fn deltas_until(&self, version: VersionId) -> impl Iterator<Item = (&VersionRecord, &Delta)> {
        let until = self.versions.iter().take_while(move |made| made.record.version <= version);
        until.flat_map(|made| made.deltas.iter().map(|delta| (&made.record, delta)))
    }

    /// The replay of everything up to `version`.
    fn state(&self, version: VersionId) -> State {
        let mut state = State::new();
        for (_, delta) in self.deltas_until(version) {
            match delta.after() {
                Some(after) => state.insert(delta.fid(), after.clone()),
                None => state.remove(&delta.fid()),
            };
        }
        state
    }

    /// Every life span of every feature, by feature and version.
    fn lives(&self) -> Vec<Feature> {
        let mut lives: BTreeMap<(Fid, VersionId), Feature> = BTreeMap::new();
        let mut open: BTreeMap<Fid, VersionId> = BTreeMap::new();
        for (record, delta) in self.deltas_until(self.head().record.version) {
            let (fid, from) = (delta.fid(), record.version);
            if let Some(life) = open.remove(&fid).and_then(|began| lives.get_mut(&(fid, began))) {
                life.to = Some(from);
            }
            if let Some(state) = delta.after() {
                open.insert(fid, from);
                lives.insert((fid, from), Feature { fid, from, to: None, state: state.clone() });
            }
        }
        lives.into_values().collect()
    }

    fn last_change(&self, fid: Fid) -> Option<VersionId> {
        let changes = self.deltas_until(self.head().record.version).filter(|(_, delta)| delta.fid() == fid);
        changes.last().map(|(record, _)| record.version)
    }

    fn check_conflicts(&self, transaction: &UpdateTransaction, live: &State) -> Result<(), CommitError> {
        let mut changed: BTreeMap<Fid, bool> = BTreeMap::new();
        let since = self.versions.iter().filter(|made| made.record.version > transaction.base);
        if let Some(region) = &transaction.viewed_region {
            let there = since.clone().flat_map(|made| &made.deltas).filter(|delta| touches(delta, Some(region)));
            changed.extend(there.map(|delta| (delta.fid(), false)));
        }
        let stale = transaction.deltas.iter().filter(|delta| !starts_from(delta, live.get(&delta.fid())));
        changed.extend(stale.map(|delta| (delta.fid(), true)));
        let touched = if transaction.kind == VersionKind::Revert { Vec::new() } else { touched(transaction) };
        let looked_at: Vec<VersionId> = since
            .filter(|made| made.looked_at.is_some_and(|seen| touched.iter().any(|bounds| bounds.intersects(&seen))))
            .map(|made| made.record.version)
            .collect();
        if changed.is_empty() && looked_at.is_empty() {
            return Ok(());
        }
        let describe = |(fid, is_target)| {
            let (changed_in, found) = (self.last_change(fid), live.get(&fid).cloned());
            ConflictingChange { fid, changed_in, found, is_target }
        };
        let (base, head) = (transaction.base, self.head().record.version);
        Err(CommitError::Conflict { base, head, changed: changed.into_iter().map(describe).collect(), looked_at })
    }

    fn commit(&mut self, transaction: &UpdateTransaction, now: Timestamp) -> Result<VersionId, CommitError> {
        let head = self.head();
        check_request(transaction, head.record.version)?;
        let classes = check_new_classes(transaction, head.classes.clone())?;
        check_states(transaction, &classes)?;
        let live = self.state(head.record.version);
        self.check_conflicts(transaction, &live)?;
        let has = |digest| transaction.geometries.contains_key(&digest) || self.geometries.contains_key(&digest);
        if let Some((name, digest)) = needed_geometry(transaction).find(|(_, digest)| !has(*digest)) {
            return Err(CommitError::NoGeometry { name: name.to_owned(), digest });
        }
        check_digests(transaction)?;
        let last_fid = self.deltas_until(head.record.version).map(|(_, delta)| delta.fid()).max().unwrap_or(Fid(0));
        let past =
            |fid| Ok::<_, CommitError>(self.lives().into_iter().rfind(|life| life.fid == fid).map(|life| life.state));
        check_numbers(transaction, last_fid, past)?;
        let evidence = transaction.evidence.as_ref().map(evidence_digest).transpose()?;
        let plan = plan(transaction, |fid| live.get(&fid).cloned(), last_fid, &head.record, (evidence, now))?;
        let version = plan.record.version;
        let (record, deltas, looked_at) = (plan.record, plan.deltas, transaction.viewed_region);
        let request = transaction.request.filter(|_| transaction.idempotency_key.is_some());
        let needed: Vec<Digest> = needed_geometry(transaction).map(|(_, digest)| digest).collect();
        let given = needed.iter().filter_map(|digest| Some((*digest, transaction.geometries.get(digest)?.clone())));
        self.geometries.extend(given);
        self.versions.push(Kept { record, deltas, classes, looked_at, request });
        Ok(version)
    }
}

fn is_in(state: &FeatureState, region: Option<&BoxMm>) -> bool {
    region.is_none_or(|region| state.bounds().is_ok_and(|bounds| bounds.intersects(region)))
}

fn touches(delta: &Delta, region: Option<&BoxMm>) -> bool {
    delta.before().into_iter().chain(delta.after()).any(|state| is_in(state, region))
}

impl History for MemoryMap {
    fn head(&self) -> Result<VersionId, StoreError> {
        Ok(self.0.borrow().head().record.version)
    }

    fn version(&self, version: VersionId) -> Result<VersionRecord, StoreError> {
        Ok(self.0.borrow().made(version)?.record.clone())
    }

    fn log(&self, region: Option<&BoxMm>) -> Result<Vec<VersionRecord>, StoreError> {
        let contents = self.0.borrow();
        let newest_first = contents.versions.iter().rev();
        let Some(region) = region else { return Ok(newest_first.map(|made| made.record.clone()).collect()) };
        let there = newest_first.filter_map(|made| {
            let counts = Counts::of(made.deltas.iter().filter(|delta| touches(delta, Some(region))));
            (counts != Counts::default()).then(|| VersionRecord { counts: Some(counts), ..made.record.clone() })
        });
        Ok(there.collect())
    }

    fn version_at(&self, time: Timestamp) -> Result<VersionId, StoreError> {
        let contents = self.0.borrow();
        let made = contents.versions.iter().rev().find(|made| made.record.committed_at <= time);
        let first = contents.made(VersionId(0))?.record.committed_at;
        made.map(|made| made.record.version).ok_or(StoreError::BeforeFirst { asked: time, first })
    }

    fn made_with(&self, key: &str) -> Result<Option<VersionId>, StoreError> {
        let contents = self.0.borrow();
        let made = contents.versions.iter().find(|made| made.record.idempotency_key.as_deref() == Some(key));
        Ok(made.map(|made| made.record.version))
    }

    fn request_of(&self, version: VersionId) -> Result<Option<Digest>, StoreError> {
        Ok(self.0.borrow().made(version)?.request)
    }

    fn classes(&self, version: VersionId) -> Result<ClassTable, StoreError> {
        Ok(self.0.borrow().made(version)?.classes.clone())
    }

    fn features(&self, version: VersionId, region: Option<&BoxMm>) -> Result<Vec<Feature>, StoreError> {
        let contents = self.0.borrow();
        contents.made(version)?;
        let mut lives = contents.lives();
        lives
            .retain(|life| life.from <= version && life.to.is_none_or(|to| to > version) && is_in(&life.state, region));
        Ok(lives)
    }

    fn features_observed(
        &self,
        version: VersionId,
        time: Timestamp,
        region: Option<&BoxMm>,
    ) -> Result<Vec<Feature>, StoreError> {
        let contents = self.0.borrow();
        contents.made(version)?;
        let mut last: BTreeMap<Fid, (Timestamp, VersionId)> = BTreeMap::new();
        for (record, delta) in contents.deltas_until(version) {
            let seen = (record.observed_at.unwrap_or(record.committed_at), record.version);
            let decisive = last.entry(delta.fid()).or_insert((Timestamp::MIN, VersionId(0)));
            if seen.0 <= time && seen > *decisive {
                *decisive = seen;
            }
        }
        let decides = |life: &Feature| last.get(&life.fid).is_some_and(|(_, version)| *version == life.from);
        Ok(contents.lives().into_iter().filter(|life| decides(life) && is_in(&life.state, region)).collect())
    }

    fn feature(&self, version: VersionId, fid: Fid) -> Result<Feature, StoreError> {
        let found = self.features(version, None)?.into_iter().find(|feature| feature.fid == fid);
        found.ok_or(StoreError::NoSuchFeature { fid, version })
    }

    fn lives(&self, fid: Fid) -> Result<Vec<Feature>, StoreError> {
        let lives: Vec<Feature> = self.0.borrow().lives().into_iter().filter(|life| life.fid == fid).collect();
        if lives.is_empty() { Err(StoreError::NeverAFeature { fid }) } else { Ok(lives) }
    }

    fn bounds(&self, version: VersionId) -> Result<Option<BoxMm>, StoreError> {
        let features = self.features(version, None)?;
        Ok(features.iter().filter_map(|feature| feature.state.bounds().ok()).reduce(|all, next| all.union(&next)))
    }

    fn geometry(&self, digest: Digest) -> Result<Vec<u8>, StoreError> {
        self.0.borrow().geometries.get(&digest).cloned().ok_or(StoreError::NoSuchGeometry { digest })
    }

    fn changes(&self, from: VersionId, to: VersionId, region: Option<&BoxMm>) -> Result<Vec<Delta>, StoreError> {
        let contents = self.0.borrow();
        contents.made(from.max(to))?;
        let (mut before, mut after) = (contents.state(from), contents.state(to));
        let fids: BTreeSet<Fid> = before.keys().chain(after.keys()).copied().collect();
        let sides = fids.into_iter().map(|fid| (fid, before.remove(&fid), after.remove(&fid)));
        let differing = sides.filter(|(_, before, after)| before != after);
        let deltas = differing.filter_map(|(fid, before, after)| Delta::from_sides(fid, before, after));
        Ok(deltas.filter(|delta| touches(delta, region)).collect())
    }

    fn commit_once(&self, transaction: &UpdateTransaction, now: Timestamp) -> Result<Made, CommitError> {
        let asked = (transaction.kind, transaction.request);
        if let Some(version) = self.repeated(transaction.idempotency_key.as_deref(), asked)? {
            return Ok(Made { version, repeated: true });
        }
        let version = self.0.borrow_mut().commit(transaction, now)?;
        Ok(Made { version, repeated: false })
    }

    fn tag(&self, name: &str, version: VersionId, _now: Timestamp) -> Result<(), StoreError> {
        check_tag_name(name)?;
        self.version(version)?;
        match self.0.borrow_mut().tags.entry(name.to_owned()) {
            Entry::Vacant(place) => {
                place.insert(version);
                Ok(())
            }
            Entry::Occupied(taken) => Err(StoreError::TagTaken { name: name.to_owned(), version: *taken.get() }),
        }
    }

    fn untag(&self, name: &str) -> Result<VersionId, StoreError> {
        let removed = self.0.borrow_mut().tags.remove(name);
        removed.ok_or_else(|| StoreError::NoSuchTag { name: name.to_owned() })
    }

    fn tags(&self) -> Result<Vec<(String, VersionId)>, StoreError> {
        Ok(self.0.borrow().tags.iter().map(|(name, version)| (name.clone(), *version)).collect())
    }
}
