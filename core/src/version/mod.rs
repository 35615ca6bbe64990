//! The values of history: version ids, deltas, update transactions. No SQL, no file.

mod base64;
mod box_mm;
mod build;
mod canonical;
mod change_set;
mod delta;
mod descriptor_file;
mod digest;
mod evidence_file;
mod feature_state;
mod observation;
mod operations;
mod record;
mod revision;
mod transaction;
mod whole_state;

pub use box_mm::{BoxMm, InvalidBox};
pub use build::PluginBuild;
pub use canonical::CanonicalError;
pub use change_set::{ChangeSet, ChangeSetError, read_change_set, write_change_set};
pub use delta::{Counts, Delta};
pub use descriptor_file::{InvalidDescriptor, descriptor_from_file, descriptor_to_file};
pub use digest::{Digest, InvalidDigest};
pub(crate) use feature_state::UNIT_TOLERANCE;
pub use feature_state::{FeatureState, InvalidState};
pub use observation::{Decision, Gate, LocalizationEvidence, ModelFile, Observation, PluginUse, SearchRange};
pub use operations::{Frame, Operations, version_hash};
pub(crate) use operations::{proposal_bytes, read_proposal_bytes};
pub use record::{Feature, Side, Step, VersionRecord};
pub(crate) use revision::is_tag_name;
pub use revision::{InvalidRevision, Revision, parse_moment};
pub use transaction::{Fid, UpdateTransaction, VersionId, VersionKind};
pub use whole_state::WholeState;
