//! What the captures of one run came to, together.

use crate::console::Console;
use crate::failure::{CONFLICT, Failure, NOTHING};
use serde_json::Value;
use std::path::Path;

/// Counted capture by capture.
#[derive(Default)]
pub(super) struct Tally {
    /// What machines are told, a document for each capture that came to a result.
    pub(super) documents: Vec<Value>,
    /// Of the captures so far, conflicts apart.
    code: Option<u8>,
    has_conflict: bool,
    /// Why the run ended early.
    ended: Option<Failure>,
}

impl Tally {
    /// Counts what the capture at `path` came to; whether the next one is worked on. A conflict is a result of one capture:
    /// the next one starts from the map as it is by then.
    pub(super) fn count(
        &mut self,
        path: &Path,
        result: Result<(Value, u8), Failure>,
        console: &mut Console<'_>,
    ) -> bool {
        let mut failure = match result {
            Ok((document, code)) => {
                self.documents.push(document);
                self.code = Some(self.code.map_or(code, |so_far| if so_far == 0 { 0 } else { code }));
                return true;
            }
            Err(failure) => failure.about(path).with("capture", path.display().to_string()),
        };
        let document = failure.take_document();
        let is_conflict = document.as_ref().is_some_and(|document| document["decision"] == "conflict");
        self.documents.extend(document);
        if is_conflict {
            self.has_conflict = true;
            console.message(&format!("resurvey: {failure}"));
        } else {
            self.ended = Some(failure);
        }
        is_conflict
    }

    /// Whether there is anything for machines: what the captures before a bad one came to is in the map, so it is said.
    pub(super) fn is_told(&self) -> bool {
        self.ended.is_none() || !self.documents.is_empty()
    }

    /// The exit code of the run. A conflict must not be lost behind what others committed: that capture has to be sent
    /// again.
    pub(super) fn code(self) -> Result<u8, Failure> {
        match (self.ended, self.has_conflict) {
            (Some(failure), _) => Err(failure),
            (None, true) => Ok(CONFLICT),
            (None, false) => Ok(self.code.unwrap_or(NOTHING)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_core::store::{CommitError, StoreError};
    use resurvey_core::version::VersionId;
    use serde_json::json;

    fn conflict() -> Failure {
        let (base, head) = (VersionId(1), VersionId(2));
        CommitError::Conflict { base, head, changed: Vec::new(), looked_at: vec![head] }.into()
    }

    /// What these captures came to: how many were counted, the documents, the code, and what was said.
    fn tell(results: Vec<Result<(Value, u8), Failure>>) -> (usize, Vec<Value>, Result<u8, String>, String) {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let mut console = Console::new(&mut out, &mut err, true, false);
        let (mut tally, mut counted) = (Tally::default(), 0);
        for (number, result) in results.into_iter().enumerate() {
            counted += 1;
            if !tally.count(Path::new(&format!("c{number}/capture.json")), result, &mut console) {
                break;
            }
        }
        let documents = tally.documents.clone();
        (counted, documents, tally.code().map_err(|failure| failure.to_string()), String::from_utf8(err).unwrap())
    }

    #[test]
    fn a_conflict_is_named_and_stops_no_other_capture() {
        let committed = || Ok((json!({"decision": "committed"}), 0));
        let (counted, documents, code, said) = tell(vec![committed(), Err(conflict()), committed()]);
        assert_eq!((counted, code), (3, Ok(CONFLICT)));
        assert_eq!(
            (&documents[1]["capture"], &documents[1]["decision"]),
            (&json!("c1/capture.json"), &json!("conflict"))
        );
        assert!(said.starts_with("resurvey: c1/capture.json: the map changed"), "{said}");
    }

    #[test]
    fn any_other_failure_is_named_and_ends_the_run() {
        let unreadable = || Err(Failure::input("the labels are no PNG"));
        let (counted, documents, code, _) = tell(vec![Ok((json!({}), 20)), unreadable(), Ok((json!({}), 0))]);
        assert_eq!((counted, documents.len()), (2, 1));
        assert_eq!(code, Err("c1/capture.json: the labels are no PNG".to_owned()));
        let busy = StoreError::Busy { path: "city.rsv".into() };
        let (counted, _, code, _) = tell(vec![Err(busy.into()), Ok((json!({}), 0))]);
        assert_eq!(counted, 1);
        assert!(code.unwrap_err().starts_with("city.rsv: another process"));
    }

    #[test]
    fn the_code_is_0_when_a_capture_changed_something_else_that_of_the_last() {
        let code = |codes: &[u8]| tell(codes.iter().map(|code| Ok((json!({}), *code))).collect()).2;
        assert_eq!((code(&[20, 0, 22]), code(&[20, 22]), code(&[22, 20])), (Ok(0), Ok(22), Ok(20)));
    }
}
