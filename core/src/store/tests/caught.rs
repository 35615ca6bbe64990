//! A store that breaks a law is caught by that law.

use super::*;
use crate::store::conformance::{self, Make};
use crate::store::{Made, MemoryMap, StoreError};
use crate::version::{BoxMm, Delta, Digest, Feature, UpdateTransaction, VersionRecord};
use jiff::Timestamp;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What is wrong with the store.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wrong {
    /// The state of a version is that of the one before.
    StaleState,
    /// A region is taken for the whole map.
    NoRegion,
    /// A region is taken for one of all heights.
    NoHeight,
    /// A region is taken for one of all eastings.
    NoEasting,
    /// The way back is the way there.
    OneWay,
    /// Another writer's change since is overwritten.
    NoConflicts,
    /// A key is forgotten.
    NoKeys,
    /// The time of a photo is that of its commit.
    OneTimeAxis,
}

struct Faulty {
    map: MemoryMap,
    wrong: Wrong,
}

impl Faulty {
    fn region(&self, region: Option<&BoxMm>) -> Option<BoxMm> {
        let axis = match self.wrong {
            Wrong::NoRegion => return None,
            Wrong::NoEasting => 0,
            Wrong::NoHeight => 2,
            _ => return region.copied(),
        };
        let (mut low, mut high) = (region?.min(), region?.max());
        (low[axis], high[axis]) = (-1_000_000_000_000, 1_000_000_000_000);
        BoxMm::from_mm(low, high)
    }
}

impl History for Faulty {
    fn head(&self) -> Result<VersionId, StoreError> {
        self.map.head()
    }
    fn version(&self, version: VersionId) -> Result<VersionRecord, StoreError> {
        self.map.version(version)
    }
    fn log(&self, region: Option<&BoxMm>) -> Result<Vec<VersionRecord>, StoreError> {
        self.map.log(self.region(region).as_ref())
    }
    fn version_at(&self, time: Timestamp) -> Result<VersionId, StoreError> {
        self.map.version_at(time)
    }
    fn made_with(&self, key: &str) -> Result<Option<VersionId>, StoreError> {
        self.map.made_with(key)
    }
    fn request_of(&self, version: VersionId) -> Result<Option<Digest>, StoreError> {
        self.map.request_of(version)
    }
    fn classes(&self, version: VersionId) -> Result<ClassTable, StoreError> {
        self.map.classes(version)
    }
    fn features(&self, version: VersionId, region: Option<&BoxMm>) -> Result<Vec<Feature>, StoreError> {
        let is_stale = self.wrong == Wrong::StaleState && version.0 > 1;
        self.map.features(if is_stale { VersionId(version.0 - 1) } else { version }, self.region(region).as_ref())
    }
    fn features_observed(
        &self,
        version: VersionId,
        time: Timestamp,
        region: Option<&BoxMm>,
    ) -> Result<Vec<Feature>, StoreError> {
        if self.wrong == Wrong::OneTimeAxis {
            return self.map.features(self.map.version_at(time)?.min(version), region);
        }
        self.map.features_observed(version, time, region)
    }
    fn feature(&self, version: VersionId, fid: Fid) -> Result<Feature, StoreError> {
        self.map.feature(version, fid)
    }
    fn lives(&self, fid: Fid) -> Result<Vec<Feature>, StoreError> {
        self.map.lives(fid)
    }
    fn bounds(&self, version: VersionId) -> Result<Option<BoxMm>, StoreError> {
        self.map.bounds(version)
    }
    fn geometry(&self, digest: Digest) -> Result<Vec<u8>, StoreError> {
        self.map.geometry(digest)
    }
    fn changes(&self, from: VersionId, to: VersionId, region: Option<&BoxMm>) -> Result<Vec<Delta>, StoreError> {
        let (from, to) = if self.wrong == Wrong::OneWay { (from.min(to), from.max(to)) } else { (from, to) };
        self.map.changes(from, to, region)
    }
    fn commit_once(&self, transaction: &UpdateTransaction, now: Timestamp) -> Result<Made, CommitError> {
        let mut transaction = transaction.clone();
        match self.wrong {
            Wrong::NoKeys => transaction.idempotency_key = None,
            Wrong::NoConflicts => {
                transaction.viewed_region = None;
                let head = self.map.head()?;
                let live = |fid| self.map.feature(head, fid).ok().map(|feature| feature.state);
                let rebased = |delta: &Delta| Delta::from_sides(delta.fid(), live(delta.fid()), delta.after().cloned());
                transaction.deltas = transaction.deltas.iter().filter_map(rebased).collect();
            }
            _ => {}
        }
        self.map.commit_once(&transaction, now)
    }
    fn tag(&self, name: &str, version: VersionId, now: Timestamp) -> Result<(), StoreError> {
        self.map.tag(name, version, now)
    }
    fn untag(&self, name: &str) -> Result<VersionId, StoreError> {
        self.map.untag(name)
    }
    fn tags(&self) -> Result<Vec<(String, VersionId)>, StoreError> {
        self.map.tags()
    }
}

#[test]
fn a_store_that_breaks_a_law_is_caught_by_it() {
    type Law = fn(Make<'_>);
    let laws: [(Wrong, Law); 8] = [
        (Wrong::StaleState, conformance::every_version_stays_as_it_was_and_is_the_replay_of_its_changes),
        (Wrong::NoRegion, conformance::a_question_about_a_region_is_the_whole_answer_filtered),
        (Wrong::NoHeight, conformance::a_question_about_a_region_is_the_whole_answer_filtered),
        (Wrong::NoEasting, conformance::a_question_about_a_region_is_the_whole_answer_filtered),
        (Wrong::OneWay, conformance::a_difference_leads_from_one_version_to_the_other_and_back),
        (Wrong::NoConflicts, conformance::of_two_writers_at_one_place_the_second_is_refused),
        (Wrong::NoKeys, conformance::a_retry_is_committed_once),
        (Wrong::OneTimeAxis, conformance::a_late_photo_speaks_of_its_own_time),
    ];
    for (wrong, law) in laws {
        let make = |new: &NewMap, now| -> Box<dyn Subject> {
            Box::new(Faulty { map: MemoryMap::new(new, now).unwrap(), wrong })
        };
        assert!(catch_unwind(AssertUnwindSafe(|| law(&make))).is_err(), "{wrong:?} passed");
        let compared =
            catch_unwind(AssertUnwindSafe(|| conformance::answers_and_refusals_are_those_of_the_plain_map(&make)));
        // The comparison has no keys, and asks about no region and no way back.
        let is_compared = matches!(wrong, Wrong::StaleState | Wrong::NoConflicts | Wrong::OneTimeAxis);
        assert!(compared.is_err() || !is_compared, "{wrong:?} has the answers of the plain map");
    }
}
