//! Plugin host: finds, loads and calls matchers, detectors, estimators and segmenters through the C ABI.
//! `docs/plugin-guide.md` has the rules of the line, `schema/include/resurvey_plugin.h` its words.
//!
//! The only `unsafe` of core is here, in `open`, `instance`, `kinds`, `segmenter`, `line`, `lend`, `results`,
//! `service_table`, `process`, and in `examine`, which tries what a plugin does with the memory it is lent.

mod check;
mod crashes;
mod declaration;
mod error;
pub mod examine;
mod executable;
mod info;
mod input;
mod instance;
mod isolation;
mod kinds;
mod lend;
mod line;
mod open;
mod photo_services;
#[cfg(target_os = "linux")]
mod process;
#[cfg(not(target_os = "linux"))]
#[path = "no_process.rs"]
mod process;
mod registry;
mod results;
mod segmenter;
mod service_table;
mod services;
mod settings;
mod trust;
mod user_file;

pub(crate) use check::LARGEST_RAD;
pub use crashes::CrashLog;
pub use error::{PluginError, Refusal, Stage};
pub use info::{Digest, InvalidDigest, Kind, PluginInfo};
pub use input::{ComparisonInput, PhotoInput, ViewImages};
pub use isolation::Isolation;
pub use kinds::{Detector, Estimator, MakeView, Matcher, MatcherForm};
pub use open::Plugin;
pub use photo_services::PhotoServices;
pub use process::{SERVE, serve};
pub use registry::{Registry, SkippedFile};
pub use segmenter::Segmenter;
pub use services::{Listener, ServiceError, Services, class_slots};
pub use settings::{Assignment, Setting, Settings, SettingsError, SettingsSchema, ValueType};
pub use user_file::{edit_lines, read_lines};
