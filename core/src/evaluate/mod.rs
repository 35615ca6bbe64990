//! Accuracy over captures with truth: errors, recall, change scores and bootstrap intervals (Lee & Hsu, §4, Table II).

mod bootstrap;
mod changes;
mod chart;
mod difference;
mod nees;
mod pose_error;
mod statistics;
mod summary;
mod truth;

pub use bootstrap::{Bootstrap, Estimate, Interval, wilson_95};
pub use changes::{ChangeScore, ChangeSummary, ChangeTally, ExpectedChange, FalseUpdate, FoundChange, score_changes};
pub use chart::{Chart, Mark, Series};
pub use difference::Difference;
pub use nees::{Consistency, nees};
pub use pose_error::{Level, PoseError};
pub use statistics::{mean, median, quantile};
pub use summary::{Answer, Summary, Trial};
pub use truth::{NoiseLevel, TrueChange, Truth, TruthError};
