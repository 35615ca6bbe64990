//! What must hold in a map file, checked from outside the code that writes it.

mod blobs;
mod evidence;
mod features;
mod file;
mod history;
mod problem;
mod seals;

pub(super) use file::complaints as complaints_of_sqlite;
pub(super) use history::doubtful;
pub use problem::Problem;
pub(super) use problem::damage;
