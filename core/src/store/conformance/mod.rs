//! The laws of [`History`], as tests that any backend runs:
//!
//! ```ignore
//! mod my_store {
//!     resurvey_core::conformance_tests!(|new, now| Box::new(MyStore::create(new, now).unwrap()));
//! }
//! ```
//!
//! Histories are random and shrink to the shortest one that breaks a law. [`MemoryMap`](super::MemoryMap) is the
//! yardstick of the last law: the same calls give the same answers, numbers, hashes and refusals.

mod examples;
mod laws;
mod play;

pub use examples::*;
pub use laws::*;
pub(crate) use play::{Content, Moves, content, moves, play};

use super::{CommitError, History, NewMap};
use crate::version::{FeatureState, Fid, Frame, UpdateTransaction, VersionId, VersionKind};
use jiff::Timestamp;
use resurvey_schema::{ClassId, ClassTable, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Uncertainty};

/// A store under test.
pub trait Subject {
    /// The store.
    fn history(&self) -> &dyn History;

    /// Looks for damage by the store's own means, after each law; says what is wrong.
    fn inspect(&self) -> Result<(), String> {
        Ok(())
    }
}

impl<H: History> Subject for H {
    fn history(&self) -> &dyn History {
        self
    }
}

/// Makes an empty map, which has version 0 from the given time.
pub type Make<'m> = &'m dyn Fn(&NewMap, Timestamp) -> Box<dyn Subject>;

/// Tests, one for each law, of the stores that a [`Make`] makes.
#[macro_export]
macro_rules! conformance_tests {
    ($make:expr) => {
        $crate::conformance_tests!(@each $make;
            every_version_stays_as_it_was_and_is_the_replay_of_its_changes,
            a_difference_leads_from_one_version_to_the_other_and_back,
            a_question_about_a_region_is_the_whole_answer_filtered,
            an_undo_undone_is_the_original,
            all_versions_undone_leave_the_empty_map,
            an_undo_restores_every_feature_or_names_who_changed_it,
            both_time_axes_agree_where_photos_come_in_order,
            the_hash_of_a_version_is_that_of_its_changes_and_the_version_before,
            lives_have_no_gaps_but_where_a_feature_was_gone,
            answers_and_refusals_are_those_of_the_plain_map,
            a_refusal_leaves_no_trace,
            of_two_writers_at_one_place_the_second_is_refused,
            writers_at_different_places_both_pass,
            a_retry_is_committed_once,
            a_key_goes_with_one_request,
            a_late_photo_speaks_of_its_own_time,
            a_number_is_never_given_twice,
            a_number_stays_with_its_thing_and_near_the_others,
            geometry_is_kept_once_under_its_digest,
            a_version_has_names,
            what_is_not_there_is_refused_by_name,
        );
    };
    (@each $make:expr; $($law:ident),* $(,)?) => {
        $(
            #[test]
            fn $law() {
                $crate::store::conformance::$law(&$make);
            }
        )*
    };
}

pub(crate) fn new_map() -> NewMap {
    NewMap {
        map_id: "test".to_owned(),
        frame: Frame { crs: "EPSG:2326".to_owned(), vertical_datum: "hkpd".to_owned() },
        classes: ClassTable::default(),
        author: "survey".to_owned(),
        message: "an empty map".to_owned(),
    }
}

/// `minutes` after 2026-03-01T00:00:00Z.
pub(crate) fn at(minutes: i64) -> Timestamp {
    const START_S: i64 = 1_772_323_200;
    Timestamp::from_second(START_S + 60 * minutes).unwrap_or(Timestamp::MAX)
}

pub(crate) fn transaction(base: u64) -> UpdateTransaction {
    UpdateTransaction::new(VersionId(base), VersionKind::Update, "phone 7", "a test")
}

/// A banner of 9.6 × 6.9 m, `offset` m north of the one of the case street-banner-removed.
pub(crate) fn banner(offset: f64) -> FeatureState {
    let corner = |n: f64, h| GridPoint::new(835_567.743_1, n + offset, h);
    FeatureState::Descriptor(Descriptor::Material(MaterialDescriptor {
        class: ClassId(3),
        corners: [
            corner(817_816.210_8, 8.129_6),
            corner(817_825.842, 8.129_6),
            corner(817_825.842, 15.014_8),
            corner(817_816.210_8, 15.014_8),
        ],
        normal: [1.0, 0.0, 0.0],
        sigma: Some(Uncertainty { position_m: 0.1, size_m: Some(0.05), area_m2: None }),
    }))
}

/// A chair, `offset` m north of the banner's bottom-left corner.
pub(crate) fn chair(offset: f64) -> FeatureState {
    FeatureState::Descriptor(Descriptor::Dynamic(DynamicDescriptor {
        class: ClassId(5),
        position: GridPoint::new(835_567.743_1, 817_816.210_8 + offset, 7.2),
        size_m: [0.5, 0.5, 0.9],
        yaw_rad: None,
        sigma: None,
    }))
}

/// Commits new features to the newest version, a minute after the version before.
fn add(history: &dyn History, states: &[FeatureState]) -> Result<VersionId, CommitError> {
    let head = history.head()?;
    let mut transaction = transaction(head.0);
    transaction.additions = states.to_vec();
    history.commit(&transaction, at(head.0 as i64 + 1))
}

/// Version 1: a banner (feature 1) and a chair (feature 2), 100 m apart.
fn with_two_features(make: Make<'_>) -> Box<dyn Subject> {
    let subject = make(&new_map(), at(0));
    assert_eq!(add(subject.history(), &[banner(0.0), chair(100.0)]), Ok(VersionId(1)));
    subject
}

fn sound(subject: &dyn Subject) {
    assert_eq!(subject.inspect(), Ok(()), "the store's own inspection");
}

fn state(history: &dyn History, fid: u64) -> FeatureState {
    let head = history.head().expect("a head");
    history.feature(head, Fid(fid)).expect("a feature").state
}
