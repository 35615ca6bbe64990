//! The declaration of a plugin and the macros that export it.

use crate::call;
use crate::kinds::{Detector, Estimator, Plugin, Scorer, Searcher, Segmenter};
use resurvey_schema::abi::{Declaration, EntryFn, KIND_DETECTOR, KIND_ESTIMATOR, KIND_MATCHER, KIND_SEGMENTER};

/// Exports a matcher in `score` form. See [`export_plugin`](crate::export_plugin).
#[macro_export]
macro_rules! export_scorer {
    ($plugin:ty) => {
        $crate::export_plugin!($crate::export::scorer::<$plugin>());
    };
}

/// Exports a matcher in `search` form. See [`export_plugin`](crate::export_plugin).
#[macro_export]
macro_rules! export_searcher {
    ($plugin:ty) => {
        $crate::export_plugin!($crate::export::searcher::<$plugin>());
    };
}

/// Exports a change detector. See [`export_plugin`](crate::export_plugin).
#[macro_export]
macro_rules! export_detector {
    ($plugin:ty) => {
        $crate::export_plugin!($crate::export::detector::<$plugin>());
    };
}

/// Exports a descriptor estimator. See [`export_plugin`](crate::export_plugin).
#[macro_export]
macro_rules! export_estimator {
    ($plugin:ty) => {
        $crate::export_plugin!($crate::export::estimator::<$plugin>());
    };
}

/// Exports a segmenter. See [`export_plugin`](crate::export_plugin).
#[macro_export]
macro_rules! export_segmenter {
    ($plugin:ty) => {
        $crate::export_plugin!($crate::export::segmenter::<$plugin>());
    };
}

/// Writes the exported symbol (`resurvey_plugin_v1__` and the crate's name) and `pub fn plugin()`, with which a program
/// that links the crate in gets the same declaration. Once per crate, at its root.
#[doc(hidden)]
#[macro_export]
macro_rules! export_plugin {
    ($declaration:expr) => {
        // Lints do not look into macros of other crates, so that a plugin may forbid unsafe code and still export.
        #[doc(hidden)]
        #[unsafe(export_name = concat!("resurvey_plugin_v1__", env!("CARGO_CRATE_NAME")))]
        pub static RESURVEY_PLUGIN: $crate::schema::abi::Declaration = $declaration;

        /// The plugin, for a program that links it in.
        pub fn plugin() -> &'static $crate::schema::abi::Declaration {
            &RESURVEY_PLUGIN
        }
    };
}

/// The declaration of a matcher in `score` form.
pub const fn scorer<T: Scorer>() -> Declaration {
    declare::<T>(KIND_MATCHER, call::enter_scorer::<T>)
}

/// The declaration of a matcher in `search` form.
pub const fn searcher<T: Searcher>() -> Declaration {
    declare::<T>(KIND_MATCHER, call::enter_searcher::<T>)
}

/// The declaration of a change detector.
pub const fn detector<T: Detector>() -> Declaration {
    declare::<T>(KIND_DETECTOR, call::enter_detector::<T>)
}

/// The declaration of a descriptor estimator.
pub const fn estimator<T: Estimator>() -> Declaration {
    declare::<T>(KIND_ESTIMATOR, call::enter_estimator::<T>)
}

/// The declaration of a segmenter.
pub const fn segmenter<T: Segmenter>() -> Declaration {
    declare::<T>(KIND_SEGMENTER, call::enter_segmenter::<T>)
}

const fn declare<T: Plugin>(kind: u16, entry: EntryFn) -> Declaration {
    let (name, mut index) = (T::NAME.as_bytes(), 0);
    assert!(!name.is_empty(), "NAME of the plugin is empty");
    while index < name.len() {
        let allowed = name[index].is_ascii_lowercase() || name[index].is_ascii_digit() || name[index] == b'-';
        assert!(allowed, "NAME of the plugin may have a–z, 0–9 and dashes");
        index += 1;
    }
    Declaration::new(kind, entry, T::NAME, T::VERSION, T::SUMMARY)
}
