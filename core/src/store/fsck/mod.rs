//! What must hold in a map file, checked from outside the code that writes it.

mod evidence;
mod features;
mod file;
mod history;
mod problem;

pub(super) use file::complaints as complaints_of_sqlite;
pub use problem::Problem;
