//! Accuracy over captures with truth: errors, recall, change scores and bootstrap intervals (Lee & Hsu, §4, Table II).

mod bootstrap;
mod change_difference;
mod change_summary;
mod changes;
mod chart;
mod difference;
mod missed;
mod nees;
mod pose_error;
mod second_photo;
mod share;
mod statistics;
mod summary;
mod truth;

pub use bootstrap::{Bootstrap, Estimate, Interval, wilson_95};
pub use change_difference::ChangeDifference;
pub use change_summary::{ChangeSummary, ChangeTally, SecondPhotos, Spread};
pub use changes::{ChangeScore, ExpectedChange, FalseUpdate, FoundChange, Replacement, score_changes};
pub use chart::{Chart, Mark, Series};
pub use difference::Difference;
pub use nees::{Consistency, nees};
pub use pose_error::{Level, PoseError};
pub use second_photo::{SecondPhoto, score_second_photo};
pub use share::Share;
pub use statistics::{mean, median, quantile};
pub use summary::{Answer, Summary, Trial};
pub use truth::{NoiseLevel, Replaced, TrueChange, Truth, TruthError};
