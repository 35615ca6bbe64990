//! A change of one feature: place, modify and remove are one type with a side missing; undo is a swap.

use super::{FeatureState, Fid};
use serde::{Deserialize, Serialize};

/// Before and after of one feature; at least one side is there.
#[derive(Clone, Debug, PartialEq)]
pub struct Delta {
    fid: Fid,
    before: Option<FeatureState>,
    after: Option<FeatureState>,
}

impl Delta {
    /// The feature `fid`, which is not in the map, comes (again).
    pub fn add(fid: Fid, after: FeatureState) -> Self {
        Self { fid, before: None, after: Some(after) }
    }

    /// The feature goes.
    pub fn remove(fid: Fid, before: FeatureState) -> Self {
        Self { fid, before: Some(before), after: None }
    }

    /// The feature changes.
    pub fn modify(fid: Fid, before: FeatureState, after: FeatureState) -> Self {
        Self { fid, before: Some(before), after: Some(after) }
    }

    /// The delta of two sides; `None` when both are missing.
    pub fn from_sides(fid: Fid, before: Option<FeatureState>, after: Option<FeatureState>) -> Option<Self> {
        (before.is_some() || after.is_some()).then_some(Self { fid, before, after })
    }

    /// The feature.
    pub fn fid(&self) -> Fid {
        self.fid
    }

    /// Its state before; `None` when it comes.
    pub fn before(&self) -> Option<&FeatureState> {
        self.before.as_ref()
    }

    /// Its state after; `None` when it goes.
    pub fn after(&self) -> Option<&FeatureState> {
        self.after.as_ref()
    }

    /// The delta that undoes this one.
    pub fn undone(self) -> Self {
        Self { fid: self.fid, before: self.after, after: self.before }
    }
}

/// How many features came, changed and went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Came.
    pub added: u64,
    /// Changed.
    pub modified: u64,
    /// Went.
    pub removed: u64,
}

impl Counts {
    /// The counts of `deltas`.
    pub fn of<'a>(deltas: impl IntoIterator<Item = &'a Delta>) -> Self {
        let mut counts = Self::default();
        for delta in deltas {
            counts.count(delta.before.is_some(), delta.after.is_some());
        }
        counts
    }

    /// Counts one feature by the sides it has.
    pub fn count(&mut self, has_before: bool, has_after: bool) {
        match (has_before, has_after) {
            (false, true) => self.added += 1,
            (true, true) => self.modified += 1,
            (true, false) => self.removed += 1,
            (false, false) => {}
        }
    }
}
