//! Plugin host: finds, loads and calls matchers, detectors and estimators through the C ABI. `docs/plugin-guide.md` has
//! the rules of the line, `schema/include/resurvey_plugin.h` its words.
//!
//! The only `unsafe` of core is here, in `open`, `instance`, `kinds`, `lend`, `results` and `service_table`, and in
//! `examine`, which tries what a plugin does with the memory it is lent.

mod check;
mod declaration;
mod error;
pub mod examine;
mod info;
mod input;
mod instance;
mod kinds;
mod lend;
mod open;
mod registry;
mod results;
mod service_table;
mod services;
mod settings;
mod trust;

pub use error::{PluginError, Refusal, Stage};
pub use info::{Digest, InvalidDigest, Kind, PluginInfo};
pub use input::{ComparisonInput, PhotoInput, ViewImages};
pub use kinds::{Detector, Estimator, Matcher, MatcherForm};
pub use open::Plugin;
pub use registry::{Registry, SkippedFile};
pub use services::{ServiceError, Services, class_slots};
pub use settings::{Assignment, Setting, Settings, SettingsError, SettingsSchema, ValueType};
