//! Change sets (`resurvey.changes/1`): deltas of descriptors as JSON lines, out of one map and into another.

use super::{
    Delta, FeatureState, Fid, InvalidDescriptor, UpdateTransaction, VersionId, VersionKind, descriptor_from_file,
    descriptor_to_file,
};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use resurvey_schema::changes::{ChangeLine, ChangeSetHeader, DescriptorFile, FORMAT, Op};

/// A change set that was read and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangeSet {
    /// Version the deltas were made against; `None` applies to any.
    pub base: Option<VersionId>,
    /// Who made it.
    pub author: Option<String>,
    /// Why.
    pub message: Option<String>,
    /// When the world was so.
    pub observed_at: Option<Timestamp>,
    /// Features without a number.
    pub additions: Vec<FeatureState>,
    /// Changes of numbered features.
    pub deltas: Vec<Delta>,
}

/// Why a text is not a change set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChangeSetError {
    /// Not one line.
    #[error("line 1: expected a header {{\"format\":\"{FORMAT}\",…}}, found nothing")]
    Empty,
    /// Another format.
    #[error("line 1: expected format {FORMAT:?}, found {0:?}")]
    Format(String),
    /// Not a time.
    #[error("line 1: observed_at: expected a time with its zone such as 2026-03-01T10:00:00+08:00, found {0:?}")]
    ObservedAt(String),
    /// Not JSON, or not of the right shape.
    #[error("line {line}: {detail}")]
    Syntax {
        /// Counted from 1.
        line: usize,
        /// What the parser says.
        detail: String,
    },
    /// Sides that do not fit the operation.
    #[error("line {line}: {op:?} needs {needs}")]
    Sides {
        /// Counted from 1.
        line: usize,
        /// The operation.
        op: Op,
        /// The keys it needs.
        needs: &'static str,
    },
    /// A feature number that no map gives.
    #[error("line {line}: fid {fid} is not between 1 and {}", Fid::MAX)]
    Fid {
        /// Counted from 1.
        line: usize,
        /// What was found.
        fid: u64,
    },
    /// A descriptor that is none.
    #[error("line {line}, {side}: {error}")]
    Descriptor {
        /// Counted from 1.
        line: usize,
        /// `before` or `after`.
        side: &'static str,
        /// Why.
        error: InvalidDescriptor,
    },
}

impl ChangeSet {
    /// The transaction that applies it, against `head` where it names no base.
    pub fn into_transaction(self, head: VersionId) -> UpdateTransaction {
        let author = self.author.unwrap_or_default();
        let message = self.message.unwrap_or_default();
        let mut transaction = UpdateTransaction::new(self.base.unwrap_or(head), VersionKind::Apply, author, message);
        transaction.observed_at = self.observed_at;
        transaction.additions = self.additions;
        transaction.deltas = self.deltas;
        transaction
    }
}

/// Reads a change set for a map with `classes`. Empty lines are skipped.
pub fn read_change_set(text: &str, classes: &ClassTable) -> Result<ChangeSet, ChangeSetError> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let (number, first) = lines.next().ok_or(ChangeSetError::Empty)?;
    let syntax = |number: usize| {
        move |error: serde_json::Error| ChangeSetError::Syntax { line: number + 1, detail: error.to_string() }
    };
    let header: ChangeSetHeader = serde_json::from_str(first).map_err(syntax(number))?;
    if header.format != FORMAT {
        return Err(ChangeSetError::Format(header.format));
    }
    let observed_at = header.observed_at.map(|text| text.parse().map_err(|_| ChangeSetError::ObservedAt(text)));
    let mut set = ChangeSet {
        base: header.base_version.map(VersionId),
        author: header.author,
        message: header.message,
        observed_at: observed_at.transpose()?,
        additions: Vec::new(),
        deltas: Vec::new(),
    };
    for (number, line) in lines {
        let change: ChangeLine = serde_json::from_str(line).map_err(syntax(number))?;
        read_line(&change, number + 1, classes, &mut set)?;
    }
    Ok(set)
}

fn read_line(
    change: &ChangeLine,
    line: usize,
    classes: &ClassTable,
    set: &mut ChangeSet,
) -> Result<(), ChangeSetError> {
    if let Some(fid) = change.fid.filter(|fid| !(1..=Fid::MAX.0).contains(fid)) {
        return Err(ChangeSetError::Fid { line, fid });
    }
    let state = |side, file: &Option<DescriptorFile>| {
        let read = |file| descriptor_from_file(file, classes).map(FeatureState::Descriptor);
        file.as_ref().map(read).transpose().map_err(|error| ChangeSetError::Descriptor { line, side, error })
    };
    let (before, after) = (state("before", &change.before)?, state("after", &change.after)?);
    match (change.op, change.fid.map(Fid), before, after) {
        (Op::Add, None, None, Some(after)) => set.additions.push(after),
        (Op::Add, Some(fid), None, Some(after)) => set.deltas.push(Delta::add(fid, after)),
        (Op::Remove, Some(fid), Some(before), None) => set.deltas.push(Delta::remove(fid, before)),
        (Op::Modify, Some(fid), Some(before), Some(after)) => set.deltas.push(Delta::modify(fid, before, after)),
        (op, ..) => {
            let needs = match op {
                Op::Add => "\"after\" and no \"before\"",
                Op::Remove => "\"fid\", \"before\" and no \"after\"",
                Op::Modify => "\"fid\", \"before\" and \"after\"",
            };
            return Err(ChangeSetError::Sides { line, op, needs });
        }
    }
    Ok(())
}

/// The change set of `deltas` as JSON lines, and the objects among them: change sets carry descriptors only. `classes`
/// are the tables before and after.
pub fn write_change_set(
    header: &ChangeSetHeader,
    deltas: &[Delta],
    classes: (&ClassTable, &ClassTable),
) -> Result<(String, Vec<Fid>), serde_json::Error> {
    let mut text = serde_json::to_string(header)? + "\n";
    let mut left_out = Vec::new();
    for delta in deltas {
        match delta_to_line(delta, classes) {
            Some(line) => text += &(serde_json::to_string(&line)? + "\n"),
            None => left_out.push(delta.fid()),
        }
    }
    Ok((text, left_out))
}

/// The line of `delta`; `None` when a side is an object.
fn delta_to_line(delta: &Delta, (before, after): (&ClassTable, &ClassTable)) -> Option<ChangeLine> {
    let side = |state: Option<&FeatureState>, classes| match state {
        None => Some(None),
        Some(FeatureState::Descriptor(descriptor)) => Some(Some(descriptor_to_file(descriptor, classes))),
        Some(FeatureState::Object { .. }) => None,
    };
    let (before, after) = (side(delta.before(), before)?, side(delta.after(), after)?);
    let op = match (&before, &after) {
        (None, _) => Op::Add,
        (Some(_), None) => Op::Remove,
        (Some(_), Some(_)) => Op::Modify,
    };
    Some(ChangeLine { op, fid: Some(delta.fid().0), before, after })
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_schema::{Descriptor, GridPoint};

    const HEADER: &str = r#"{"format":"resurvey.changes/1","base_version":3,"author":"survey","message":"m"}"#;
    const CHAIR: &str = r#"{"class":"chair","position":[836716.9865,818429.4205,7.2]}"#;

    fn read(lines: &str) -> Result<ChangeSet, ChangeSetError> {
        read_change_set(&format!("{HEADER}\n{lines}\n"), &ClassTable::default())
    }

    #[test]
    fn a_change_set_comes_back_as_it_was_written() {
        let set = read(&format!(
            "{{\"op\":\"add\",\"fid\":4,\"after\":{CHAIR}}}\n\n{{\"op\":\"remove\",\"fid\":5,\"before\":{CHAIR}}}"
        ))
        .unwrap();
        assert_eq!((set.base, set.deltas.len()), (Some(VersionId(3)), 2));
        let classes = ClassTable::default();
        let header = ChangeSetHeader {
            format: FORMAT.to_owned(),
            base_version: Some(3),
            author: set.author.clone(),
            message: set.message.clone(),
            observed_at: None,
        };
        let (text, left_out) = write_change_set(&header, &set.deltas, (&classes, &classes)).unwrap();
        assert_eq!((read_change_set(&text, &ClassTable::default()), left_out), (Ok(set), vec![]));
    }

    #[test]
    fn an_object_is_left_out_and_named() {
        let bounds = crate::version::BoxMm::from_mm([0; 3], [1; 3]).unwrap();
        let geometry = crate::version::Digest::of(b"");
        let tower = FeatureState::Object { name: "tower".to_owned(), geometry, bounds };
        let header = serde_json::from_str(HEADER).unwrap();
        let deltas = [Delta::add(Fid(7), tower)];
        let classes = ClassTable::default();
        let (text, left_out) = write_change_set(&header, &deltas, (&classes, &classes)).unwrap();
        assert_eq!((text.lines().count(), left_out), (1, vec![Fid(7)]));
    }

    #[test]
    fn a_bad_line_is_refused_by_its_number() {
        for (lines, expected) in [
            (r#"{"op":"add"}"#, "line 2: Add needs \"after\" and no \"before\""),
            (r#"{"op":"shift"}"#, "line 2: unknown variant `shift`"),
            (r#"{"op":"add","aftr":1}"#, "line 2: unknown field `aftr`"),
            (r#"{"op":"add","fid":0}"#, "line 2: fid 0 is not between 1 and 9007199254740991"),
            (&format!(r#"{{"op":"remove","before":{CHAIR}}}"#), "line 2: Remove needs \"fid\""),
            (&format!(r#"{{"op":"modify","fid":1,"after":{CHAIR}}}"#), "line 2: Modify needs"),
            (
                &format!("\n{{\"op\":\"add\",\"after\":{}}}", CHAIR.replace("chair", "sofa")),
                "line 3, after: class \"sofa\"",
            ),
            ("{", "line 2: EOF"),
        ] {
            let found = read(lines).unwrap_err().to_string();
            assert!(found.starts_with(expected), "{lines}\nexpected {expected}\nfound {found}");
        }
        let classes = ClassTable::default();
        assert_eq!(read_change_set(" \n", &classes), Err(ChangeSetError::Empty));
        let other = HEADER.replace("changes/1", "changes/2");
        assert_eq!(read_change_set(&other, &classes), Err(ChangeSetError::Format("resurvey.changes/2".to_owned())));
    }

    #[test]
    fn the_change_sets_of_the_cases_are_read() {
        let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared");
        let shared = std::env::var("RESURVEY_SHARED").unwrap_or_else(|_| beside.to_owned());
        for (case, first) in [
            ("street-banner-removed", GridPoint::new(835_567.743_1, 817_816.210_8, 8.129_6)),
            ("library-chair-removed", GridPoint::new(836_716.986_5, 818_429.420_5, 7.2)),
        ] {
            let path = format!("{shared}/cases/{case}/base.changes.jsonl");
            let Ok(text) = std::fs::read_to_string(&path) else {
                eprintln!("SKIPPED {case}: {path} is not there");
                continue;
            };
            let set = read_change_set(&text, &ClassTable::default()).unwrap();
            assert_eq!((set.base, set.author.as_deref()), (None, Some("survey")));
            let found = match &set.additions[0] {
                FeatureState::Descriptor(Descriptor::Material(material)) => material.corners[0],
                FeatureState::Descriptor(Descriptor::Dynamic(dynamic)) => dynamic.position,
                FeatureState::Object { .. } => panic!(),
            };
            assert_eq!(found, first);
            assert_eq!(set.into_transaction(VersionId(9)).base, VersionId(9));
        }
    }
}
