//! The command line through its public door: what it refuses, with which words and exit code, and what it answers.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test's helpers may fail loudly")]

#[path = "../../examples/synthetic/mod.rs"]
mod synthetic;

mod answers;
mod bench;
mod captures;
mod change_sets;
mod conflicts;
mod differences;
mod evaluate;
mod evaluate_updates;
mod exports;
mod forgetting;
mod generated;
mod history;
mod map_files;
mod matchers;
mod models;
mod page;
mod plugin_builds;
mod plugin_check;
mod plugin_faults;
mod plugin_files;
mod plugin_install;
mod priors;
mod provenance;
mod reports;
mod retries;
mod reviews;
mod segmenters;
mod streams;
mod table_v;
mod time_axes;
mod undoing;
mod updates;
mod usage;
