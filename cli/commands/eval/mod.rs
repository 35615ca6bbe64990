//! `resurvey eval`: matchers, detectors and estimators on the same captures, against the truth.

mod attempt;
mod cases;
mod cells;
mod contender;
mod csv;
mod document;
mod groups;
mod judge;
mod maps;
mod parallel;
mod poses;
mod progress;
mod run;
mod table_ii;
mod table_v;
mod tables;
mod text;
mod update_tables;

pub use run::run;
