//! Conflicts as users are told them: of each feature what was expected and what is there.

use crate::commands::diff::words;
use crate::document;
use crate::failure::Failure;
use resurvey_core::store::{CommitError, ConflictingChange, History, MapFile};
use resurvey_core::version::{Delta, FeatureState};
use resurvey_schema::ClassTable;
use serde_json::{Value, json};

/// So many features are told in words; the document has all.
const TOLD: usize = 3;

/// Why `deltas` were not committed to `map`.
pub fn refused(error: CommitError, map: &MapFile, deltas: &[Delta]) -> Failure {
    match &error {
        CommitError::Conflict { head, changed, .. } => {
            let told =
                map.classes(*head).map(|classes| (states(changed, deltas, &classes), list(changed, deltas, &classes)));
            match told {
                Ok((Ok(states), words)) => Failure::conflict(&error, &words, states),
                // The conflict is what matters.
                _ => error.into(),
            }
        }
        _ => error.into(),
    }
}

/// The state that a delta expects; `None` of a feature that was only looked at.
fn expected<'d>(change: &ConflictingChange, deltas: &'d [Delta]) -> Option<&'d Delta> {
    deltas.iter().find(|delta| change.is_target && delta.fid() == change.fid)
}

/// `expected` and `found` of every change.
fn states(changed: &[ConflictingChange], deltas: &[Delta], classes: &ClassTable) -> Result<Vec<Value>, Failure> {
    let side = |state: Option<&FeatureState>| state.map(|state| document::state(state, classes)).transpose();
    let one = |change: &ConflictingChange| {
        let mut states = json!({ "found": side(change.found.as_ref())? });
        if let Some(delta) = expected(change, deltas) {
            states["expected"] = json!(side(delta.before())?);
        }
        Ok(states)
    };
    changed.iter().map(one).collect()
}

/// The first of them in words, each with what goes before it.
fn list(changed: &[ConflictingChange], deltas: &[Delta], classes: &ClassTable) -> String {
    let told = changed.iter().filter_map(|change| {
        let delta = expected(change, deltas)?;
        let [expected, found] = both(delta.before(), change.found.as_ref(), classes);
        Some(format!("; feature {}: expected {expected}, found {found}", change.fid))
    });
    told.take(TOLD).collect()
}

/// Two states in words that tell them apart.
fn both(expected: Option<&FeatureState>, found: Option<&FeatureState>, classes: &ClassTable) -> [String; 2] {
    let text = |state: Option<&FeatureState>| state.map_or_else(|| "none".to_owned(), |state| words(state, classes));
    let [plain, other] = [text(expected), text(found)];
    if plain != other {
        return [plain, other];
    }
    // They differ in what a few words do not say.
    let fields =
        |state: Option<&FeatureState>| state.and_then(|state| document::state(state, classes).ok()).unwrap_or_default();
    let (a, b) = (fields(expected), fields(found));
    let differing = a.keys().chain(b.keys()).find(|key| a.get(*key) != b.get(*key));
    let value = |fields: &serde_json::Map<String, Value>, key: &str| {
        format!("{key} = {}", fields.get(key).map_or_else(|| "none".to_owned(), Value::to_string))
    };
    differing.map_or([plain, other], |key| [value(&a, key), value(&b, key)])
}
