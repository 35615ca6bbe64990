//! The digest of a whole state, which stands in for the hash chain where the way to the state is forgotten.

use super::canonical::class_table_bytes;
use super::{Digest, Fid, VersionId};
use resurvey_schema::ClassTable;
use sha2::{Digest as _, Sha256};

const TAG: &[u8] = b"resurvey.state/1\n";

/// Everything in a map at one version, fed in one by one and digested; docs/file-format.md is the definition.
pub struct WholeState(Sha256);

impl WholeState {
    /// Starts with the class table; the features come by rising number.
    pub fn start(classes: &ClassTable) -> Self {
        Self(Sha256::new_with_prefix(TAG).chain_update(class_table_bytes(classes)))
    }

    /// Takes in the next feature: the version that made its state, and the canonical bytes of that.
    pub fn feature(&mut self, fid: Fid, from: VersionId, state: &[u8]) {
        self.numbers(&[fid.0, from.0]);
        self.0.update(state);
    }

    /// Ends the features; what went or changed on the way comes next, by rising number and version.
    pub fn end_features(&mut self) {
        self.numbers(&[0]);
    }

    /// Takes in a life that ended since the version before that is whole.
    pub fn ended(&mut self, fid: Fid, from: VersionId, to: VersionId) {
        self.numbers(&[fid.0, from.0, to.0]);
    }

    /// The digest.
    pub fn finish(mut self) -> Digest {
        self.numbers(&[0]);
        Digest(self.0.finalize().into())
    }

    fn numbers(&mut self, numbers: &[u64]) {
        numbers.iter().for_each(|number| self.0.update(number.to_le_bytes()));
    }
}
