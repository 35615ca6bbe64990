//! What `plugins check` asks of a library file: every promise of the plugin line is a trial, and every trial runs in a
//! process of its own, because what it provokes may end that process.
//!
//! The child calls [`examine`], which writes what it does into a report as it goes; the parent makes a [`Finding`] of the
//! report and of how the child ended. The only `unsafe` is in `guard`, `fault`, `manners`, `raw` and `limits`.

mod answer;
mod ask;
mod exhibit;
mod exports;
mod finding;
mod lent;
mod limits;
mod manners;
mod placeless;
mod raw;
mod report;
mod sense;
mod stage;
mod trial;
mod tries;
mod watched;

#[cfg(unix)]
mod fault;
#[cfg(unix)]
mod guard;
#[cfg(not(unix))]
#[path = "guard_less.rs"]
mod guard;

pub use finding::Finding;
pub use report::{Ended, How, Report};
pub use stage::{Place, Side, Stage};
pub use trial::{Trial, examine};
