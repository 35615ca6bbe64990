//! `resurvey eval`: matchers on the same captures, against the truth.

mod attempt;
mod cases;
mod contender;
mod csv;
mod document;
mod groups;
mod maps;
mod run;
mod table_v;
mod tables;
mod text;

pub use run::run;
