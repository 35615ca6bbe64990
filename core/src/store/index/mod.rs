//! Where and when features are. The plan is cut into cells, the history of a cell into blocks: a block holds every life
//! that some version of its stretch has, so that the state of a cell at any version is in one block. A full block is
//! closed and what lives on is copied into the next (Lomet & Salzberg, Access Methods for Multiversion Data, SIGMOD
//! 1989), once for every life that ended at most.

mod block;
mod build;
mod cell;
mod check;
mod origin;
mod search;
mod write;

pub(super) use block::LIVE;
pub(super) use build::{Source, rebuild};
pub(super) use check::{Flaw, flaws};
pub(super) use origin::{IndexBox, IndexOrigin, hilbert_key};
pub(super) use search::{Ids, bounds_of, changed_since, difference, lives_in, state};
pub(super) use write::{IndexChanges, remove};
