//! Change sets (`resurvey.changes/1`): deltas as JSON lines, out of one map and into another.

use super::base64;
use super::{
    BoxMm, Delta, Digest, FeatureState, Fid, InvalidDescriptor, UpdateTransaction, VersionId, VersionKind,
    descriptor_from_file, descriptor_to_file,
};
use jiff::Timestamp;
use resurvey_schema::changes::{ChangeLine, ChangeSetHeader, DescriptorFile, FORMAT, GeometryLine, ObjectFile, Op};
use resurvey_schema::{ClassId, ClassTable};
use std::collections::BTreeMap;

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
    /// The map it was made from.
    pub map_id: Option<String>,
    /// Hash of `base` there.
    pub base_hash: Option<Digest>,
    /// Names of the classes there, which the indices in `geometries` mean; empty when it does not say.
    pub classes: BTreeMap<ClassId, String>,
    /// Features without a number.
    pub additions: Vec<FeatureState>,
    /// Changes of numbered features.
    pub deltas: Vec<Delta>,
    /// Geometry of its objects, under the digest of its bytes.
    pub geometries: BTreeMap<Digest, Vec<u8>>,
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
    /// Not a hash.
    #[error("line 1: base_hash: expected a SHA-256 of 64 hexadecimal digits, found {0:?}")]
    BaseHash(String),
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
    /// A second delta of a feature.
    #[error("line {line}: feature {fid} has two deltas, the first in line {first}; expected one at most")]
    Twice {
        /// Counted from 1.
        line: usize,
        /// The feature.
        fid: Fid,
        /// Line of its first one.
        first: usize,
    },
    /// A delta whose sides are the same.
    #[error("line {line}: feature {fid} changes nothing; expected an \"after\" that differs from \"before\"")]
    NoChange {
        /// Counted from 1.
        line: usize,
        /// The feature.
        fid: Fid,
    },
    /// A feature number that no map gives.
    #[error("line {line}: fid {fid} is not between 1 and {}", Fid::MAX)]
    Fid {
        /// Counted from 1.
        line: usize,
        /// What was found.
        fid: u64,
    },
    /// An object that is none.
    #[error("line {line}: expected {expected}")]
    Object {
        /// Counted from 1.
        line: usize,
        /// What should have stood there.
        expected: &'static str,
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
        transaction.geometries = self.geometries;
        transaction
    }
}

/// Reads a change set for a map with `classes`. Empty lines are skipped.
pub fn read_change_set(text: &str, classes: &ClassTable) -> Result<ChangeSet, ChangeSetError> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let (number, first) = lines.next().ok_or(ChangeSetError::Empty)?;
    let syntax = |number: usize| move |error: serde_json::Error| syntax_error(number + 1, &error);
    let header: ChangeSetHeader = serde_json::from_str(first).map_err(syntax(number))?;
    if header.format != FORMAT {
        return Err(ChangeSetError::Format(header.format));
    }
    let observed_at = header.observed_at.map(|text| text.parse().map_err(|_| ChangeSetError::ObservedAt(text)));
    let base_hash = header.base_hash.map(|text| text.parse().map_err(|_| ChangeSetError::BaseHash(text)));
    let mut set = ChangeSet {
        base: header.base_version.map(VersionId),
        author: header.author,
        message: header.message,
        observed_at: observed_at.transpose()?,
        map_id: header.map_id,
        base_hash: base_hash.transpose()?,
        classes: header.classes.into_iter().flatten().map(|(name, index)| (index, name)).collect(),
        additions: Vec::new(),
        deltas: Vec::new(),
        geometries: BTreeMap::new(),
    };
    let mut first_lines = BTreeMap::new();
    for (number, line) in lines {
        if is_geometry(line) {
            let geometry: GeometryLine = serde_json::from_str(line).map_err(syntax(number))?;
            read_geometry(&geometry, number + 1, &mut set)?;
            continue;
        }
        let change: ChangeLine = serde_json::from_str(line).map_err(syntax(number))?;
        let deltas = set.deltas.len();
        read_line(&change, number + 1, classes, &mut set)?;
        if let Some(delta) = set.deltas.get(deltas) {
            check_delta(delta, number + 1, &mut first_lines)?;
        }
    }
    Ok(set)
}

/// What the parser says of a line; to it every line is the first.
fn syntax_error(line: usize, error: &serde_json::Error) -> ChangeSetError {
    let (text, column) = (error.to_string(), error.column());
    let what = text.strip_suffix(&format!(" at line {} column {column}", error.line()));
    let detail = what.map_or_else(|| text.clone(), |what| format!("{what} (column {column})"));
    ChangeSetError::Syntax { line, detail }
}

/// Refuses a delta that changes nothing, and a second one of a feature.
fn check_delta(delta: &Delta, line: usize, first_lines: &mut BTreeMap<Fid, usize>) -> Result<(), ChangeSetError> {
    let fid = delta.fid();
    if delta.before() == delta.after() {
        return Err(ChangeSetError::NoChange { line, fid });
    }
    first_lines.insert(fid, line).map_or(Ok(()), |first| Err(ChangeSetError::Twice { line, fid, first }))
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
    let state = |side, file: &Option<DescriptorFile>, object: &Option<ObjectFile>| {
        let read = |file| descriptor_from_file(file, classes).map(FeatureState::Descriptor);
        let invalid = |error| ChangeSetError::Descriptor { line, side, error };
        match (file, object) {
            (Some(_), Some(_)) => {
                Err(ChangeSetError::Object { line, expected: "a descriptor or an object on each side, found both" })
            }
            (None, Some(object)) => object_from_file(object, line).map(Some),
            (file, None) => file.as_ref().map(read).transpose().map_err(invalid),
        }
    };
    let before = state("before", &change.before, &change.before_object)?;
    let after = state("after", &change.after, &change.after_object)?;
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

/// Whether a line of JSON has the key that only geometry has.
fn is_geometry(line: &str) -> bool {
    line.contains("\"base64\":")
}

fn read_geometry(file: &GeometryLine, line: usize, set: &mut ChangeSet) -> Result<(), ChangeSetError> {
    let wrong = |expected| ChangeSetError::Object { line, expected };
    let bytes = base64::decode(&file.base64).ok_or_else(|| wrong("base 64 with padding (RFC 4648)"))?;
    let digest = Digest::of(&bytes);
    if file.geometry.parse() != Ok(digest) {
        return Err(wrong("the SHA-256 of its bytes as \"geometry\""));
    }
    set.geometries.insert(digest, bytes);
    Ok(())
}

fn object_from_file(file: &ObjectFile, line: usize) -> Result<FeatureState, ChangeSetError> {
    let wrong = |expected| ChangeSetError::Object { line, expected };
    let geometry = file.geometry.parse().map_err(|_| wrong("a SHA-256 of 64 hexadecimal digits as \"geometry\""))?;
    let bounds = BoxMm::from_mm(file.min_mm, file.max_mm);
    let bounds = bounds.ok_or_else(|| wrong("\"min_mm\" not above \"max_mm\", both within a map"))?;
    Ok(FeatureState::Object { name: file.name.clone(), geometry, bounds })
}

/// The change set of `deltas` as JSON lines. `classes` are the tables before and after, `geometries` what the objects
/// need that come or change.
pub fn write_change_set(
    header: &ChangeSetHeader,
    deltas: &[Delta],
    classes: (&ClassTable, &ClassTable),
    geometries: &BTreeMap<Digest, Vec<u8>>,
) -> Result<String, serde_json::Error> {
    let mut text = serde_json::to_string(header)? + "\n";
    for (digest, bytes) in geometries {
        let line = GeometryLine { geometry: digest.to_string(), base64: base64::encode(bytes) };
        text += &(serde_json::to_string(&line)? + "\n");
    }
    for delta in deltas {
        text += &(serde_json::to_string(&delta_to_line(delta, classes))? + "\n");
    }
    Ok(text)
}

fn delta_to_line(delta: &Delta, (before, after): (&ClassTable, &ClassTable)) -> ChangeLine {
    let op = match (delta.before(), delta.after()) {
        (None, _) => Op::Add,
        (Some(_), None) => Op::Remove,
        (Some(_), Some(_)) => Op::Modify,
    };
    let (before, before_object) = side_to_file(delta.before(), before);
    let (after, after_object) = side_to_file(delta.after(), after);
    ChangeLine { fid: Some(delta.fid().0), before, after, before_object, after_object, op }
}

fn side_to_file(state: Option<&FeatureState>, classes: &ClassTable) -> (Option<DescriptorFile>, Option<ObjectFile>) {
    match state {
        None => (None, None),
        Some(FeatureState::Descriptor(descriptor)) => (Some(descriptor_to_file(descriptor, classes)), None),
        Some(FeatureState::Object { name, geometry, bounds }) => {
            let (min_mm, max_mm) = (bounds.min(), bounds.max());
            (None, Some(ObjectFile { name: name.clone(), geometry: geometry.to_string(), min_mm, max_mm }))
        }
    }
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
            map_id: None,
            base_hash: None,
            classes: None,
        };
        let text = write_change_set(&header, &set.deltas, (&classes, &classes), &BTreeMap::new()).unwrap();
        assert_eq!(read_change_set(&text, &ClassTable::default()), Ok(set));
    }

    #[test]
    fn a_header_says_of_which_map_its_base_and_its_classes_are() {
        let hash = Digest::of(b"version 3");
        let more = format!(r#""map_id":"m","base_hash":"{hash}","classes":{{"glass":1,"stone":0}},"message""#);
        let text = HEADER.replace("\"message\"", &more);
        let set = read_change_set(&text, &ClassTable::default()).unwrap();
        assert_eq!((set.map_id.as_deref(), set.base_hash), (Some("m"), Some(hash)));
        let names: Vec<_> = set.classes.iter().map(|(index, name)| (index.0, name.as_str())).collect();
        assert_eq!(names, [(0, "stone"), (1, "glass")]);
        let header: ChangeSetHeader = serde_json::from_str(&text).unwrap();
        let classes = ClassTable::default();
        let written = write_change_set(&header, &[], (&classes, &classes), &BTreeMap::new()).unwrap();
        assert_eq!(read_change_set(&written, &classes), Ok(set));
        let wrong = text.replace(&hash.to_string(), "abc");
        assert_eq!(read_change_set(&wrong, &classes), Err(ChangeSetError::BaseHash("abc".to_owned())));
    }

    #[test]
    fn an_object_comes_back_with_its_geometry() {
        let bounds = BoxMm::from_mm([-5, 0, 7], [1, 1, 9]).unwrap();
        let geometry = Digest::of(b"a mesh");
        let tower = FeatureState::Object { name: "tower \"A\"".to_owned(), geometry, bounds };
        let header = serde_json::from_str(HEADER).unwrap();
        let deltas = [Delta::add(Fid(7), tower.clone()), Delta::remove(Fid(8), tower)];
        let classes = ClassTable::default();
        let geometries = BTreeMap::from([(geometry, b"a mesh".to_vec())]);
        let text = write_change_set(&header, &deltas, (&classes, &classes), &geometries).unwrap();
        let set = read_change_set(&text, &classes).unwrap();
        assert_eq!((set.deltas.as_slice(), set.geometries), (&deltas[..], geometries));
    }

    #[test]
    fn an_object_that_is_none_is_refused_by_its_line() {
        let digest = Digest::of(b"").to_string();
        let object = format!(r#"{{"name":"a","geometry":"{digest}","min_mm":[0,0,0],"max_mm":[1,1,1]}}"#);
        let add = |object: &str| format!(r#"{{"op":"add","after_object":{object}}}"#);
        for (line, expected) in [
            (add(&object.replace("[0,0,0]", "[2,0,0]")), "expected \"min_mm\" not above \"max_mm\""),
            (add(&object.replace(&digest, "abc")), "expected a SHA-256"),
            (add(&object.replace("name", "title")), "unknown field `title`"),
            (
                format!(r#"{{"op":"add","after":{CHAIR},"after_object":{object}}}"#),
                "expected a descriptor or an object",
            ),
            (r#"{"base64":""}"#.to_owned(), "missing field `geometry`"),
            (format!(r#"{{"geometry":"{digest}","base64":"Z"}}"#), "expected base 64"),
            (format!(r#"{{"geometry":"{digest}","base64":"Zg=="}}"#), "expected the SHA-256 of its bytes"),
        ] {
            let found = read(&line).unwrap_err().to_string();
            assert!(
                found.starts_with("line 2: ") && found.contains(expected),
                "{line}\nexpected {expected}\nfound {found}"
            );
        }
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
            ("{", "line 2: EOF while parsing an object (column 1)"),
            (
                &format!(
                    "{{\"op\":\"add\",\"fid\":7,\"after\":{CHAIR}}}\n\n{{\"op\":\"remove\",\"fid\":7,\"before\":{CHAIR}}}"
                ),
                "line 4: feature 7 has two deltas, the first in line 2",
            ),
            (
                &format!("{{\"op\":\"modify\",\"fid\":7,\"before\":{CHAIR},\"after\":{CHAIR}}}"),
                "line 2: feature 7 changes nothing",
            ),
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
