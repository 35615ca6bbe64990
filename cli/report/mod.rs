//! `update --report`: one HTML page per capture that says what was seen, what became of it, and by which numbers (Lee &
//! Hsu, Table IV). Pages are whole in themselves: no script, no file beside them, no network.

mod base64;
mod fate;
mod footprint;
mod index;
mod numbers;
mod overlay;
mod page;
mod pictures;
mod plan;
mod reports;
mod section;
mod sheet;
mod words;

pub use reports::Reports;
pub use sheet::{Seen, Sheet};
