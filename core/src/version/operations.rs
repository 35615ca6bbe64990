//! The canonical operations of a version and the hash chain over them.

use super::canonical::{CanonicalError, Reader, class_table_bytes, push_text};
use super::{Delta, Digest, FeatureState, Fid};
use resurvey_schema::ClassTable;
use sha2::{Digest as _, Sha256};

const OPERATIONS_TAG: &[u8] = b"resurvey.operations/1\n";
const VERSION_TAG: &[u8] = b"resurvey.version/1\n";

const BEFORE: u8 = 1;
const AFTER: u8 = 2;

/// What the coordinates of a map mean; an operation of version 0 only.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Horizontal system, for example `EPSG:2326`.
    pub crs: String,
    /// Vertical datum, for example `hkpd`.
    pub vertical_datum: String,
}

/// The operations of one version, fed in one by one and digested.
pub struct Operations {
    sha: Sha256,
    buffer: Vec<u8>,
}

impl Operations {
    /// Starts the digest of `count` deltas, which then come by rising feature number.
    pub fn start(frame: Option<&Frame>, classes: Option<&ClassTable>, count: u64) -> Self {
        let mut buffer = OPERATIONS_TAG.to_vec();
        buffer.push(u8::from(frame.is_some()));
        if let Some(frame) = frame {
            push_text(&mut buffer, &frame.crs);
            push_text(&mut buffer, &frame.vertical_datum);
        }
        buffer.push(u8::from(classes.is_some()));
        if let Some(classes) = classes {
            buffer.extend(class_table_bytes(classes));
        }
        buffer.extend(count.to_le_bytes());
        let sha = Sha256::new_with_prefix(&buffer);
        Self { sha, buffer }
    }

    /// Takes in the next delta.
    pub fn add(&mut self, delta: &Delta) {
        self.buffer.clear();
        push_delta(&mut self.buffer, delta);
        self.sha.update(&self.buffer);
    }

    /// The digest of the canonical operations.
    pub fn finish(self) -> Digest {
        Digest(self.sha.finalize().into())
    }
}

/// The hash of a version: over its parent's hash (32 zero bytes for version 0), the digest of its canonical operations,
/// and the digest of its evidence (32 zero bytes where there is none).
pub fn version_hash(parent: Option<Digest>, operations: Digest, evidence: Option<Digest>) -> Digest {
    let zero = Digest([0; 32]);
    let mut sha = Sha256::new_with_prefix(VERSION_TAG);
    for part in [parent.unwrap_or(zero), operations, evidence.unwrap_or(zero)] {
        sha.update(part.0);
    }
    Digest(sha.finalize().into())
}

fn push_delta(bytes: &mut Vec<u8>, delta: &Delta) {
    let side = |state: Option<&FeatureState>, flag| if state.is_some() { flag } else { 0 };
    bytes.extend(delta.fid().0.to_le_bytes());
    bytes.push(side(delta.before(), BEFORE) | side(delta.after(), AFTER));
    delta.before().into_iter().chain(delta.after()).for_each(|state| state.push_bytes(bytes));
}

/// The bytes in which a proposal keeps its deltas and the features it adds.
pub(crate) fn proposal_bytes(deltas: &[Delta], additions: &[FeatureState]) -> Vec<u8> {
    let mut bytes = (deltas.len() as u64).to_le_bytes().to_vec();
    deltas.iter().for_each(|delta| push_delta(&mut bytes, delta));
    bytes.extend((additions.len() as u64).to_le_bytes());
    additions.iter().for_each(|state| state.push_bytes(&mut bytes));
    bytes
}

/// What [`proposal_bytes`] wrote.
pub(crate) fn read_proposal_bytes(bytes: &[u8]) -> Result<(Vec<Delta>, Vec<FeatureState>), CanonicalError> {
    let mut reader = Reader::new(bytes);
    let mut deltas = Vec::new();
    for _ in 0..reader.count("the number of deltas")? {
        deltas.push(read_delta(&mut reader)?);
    }
    let mut additions = Vec::new();
    for _ in 0..reader.count("the number of additions")? {
        additions.push(reader.state()?);
    }
    reader.end()?;
    Ok((deltas, additions))
}

fn read_delta(reader: &mut Reader) -> Result<Delta, CanonicalError> {
    let fid = Fid(reader.count("a feature number")?);
    let sides = reader.byte("sides")?;
    if sides & !(BEFORE | AFTER) != 0 {
        return reader.wrong("known sides before this");
    }
    let before = if sides & BEFORE != 0 { Some(reader.state()?) } else { None };
    let after = if sides & AFTER != 0 { Some(reader.state()?) } else { None };
    match Delta::from_sides(fid, before, after) {
        Some(delta) => Ok(delta),
        None => reader.wrong("a side before this"),
    }
}
