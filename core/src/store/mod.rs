//! The versioned map: [`History`] is what the program asks of it, [`MapFile`] keeps it in one SQLite file. All SQL of the
//! project is here.

mod backend;
mod beside;
mod blobs;
mod commit;
mod commit_error;
mod conflict;
#[cfg(any(test, feature = "conformance"))]
#[allow(clippy::panic, reason = "a law that is broken ends its test")]
pub mod conformance;
mod differences;
mod error;
mod feature_rows;
mod forgotten;
mod fsck;
mod gc;
mod index;
mod interface;
mod kept_states;
mod logs;
mod looked_at;
mod map_file;
mod memory;
mod migrate;
mod observations;
mod observed;
mod on_disk;
mod operations;
mod plan;
mod proposals;
mod repair;
mod revert;
mod revisions;
mod rows;
mod seal;
mod snapshot;
mod states;
#[cfg(test)]
mod tests;
mod turn;

pub use commit_error::{CommitError, ConflictingChange};
pub use error::StoreError;
pub use fsck::Problem;
pub use gc::Forgetting;
pub use interface::{History, Made};
pub use logs::Provenance;
pub use map_file::{MapFile, MapInfo, NewMap};
pub use memory::MemoryMap;
pub use observations::RecordedObservation;
pub use proposals::{Proposal, ProposalDecision, ProposalStatus};
pub use revert::{Revert, Reverted};
pub use snapshot::Snapshot;
