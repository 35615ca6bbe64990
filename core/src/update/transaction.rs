//! From changes to the transaction that makes them.

use super::resolve::Change;
use crate::version::{Delta, FeatureState, Fid, UpdateTransaction};

/// Puts `changes` into `transaction`: additions in order, the others by feature id.
pub fn add_changes(transaction: &mut UpdateTransaction, changes: &[Change]) {
    let state = |descriptor: &resurvey_schema::Descriptor| FeatureState::Descriptor(descriptor.clone());
    for change in changes {
        match change {
            Change::Add(after) => transaction.additions.push(state(after)),
            Change::Modify { fid, before, after } => {
                transaction.deltas.push(Delta::modify(Fid(*fid), state(before), state(after)));
            }
            Change::Remove { fid, before } => transaction.deltas.push(Delta::remove(Fid(*fid), state(before))),
        }
    }
}
