//! The map file: versions, features, observations in SQLite. All SQL of the project is here.

mod commit;
mod commit_error;
mod conflict;
mod error;
mod feature_rows;
mod fsck;
mod history;
mod index;
mod map_file;
mod observations;
mod proposals;
mod revisions;
mod rows;
mod snapshot;
#[cfg(test)]
mod tests;

pub use commit_error::{CommitError, ConflictingChange};
pub use error::StoreError;
pub use fsck::Problem;
pub use history::Provenance;
pub use map_file::{MapFile, MapInfo, NewMap};
pub use observations::RecordedObservation;
pub use proposals::{Proposal, ProposalDecision, ProposalStatus};
pub use snapshot::Snapshot;
