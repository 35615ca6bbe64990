//! Damage, made with raw SQL behind the store's back, and what `fsck` says of it.

use super::*;
use crate::version::{BoxMm, Decision, Delta, Digest, Observation};
use rusqlite::Connection;

/// Two objects that share geometry, a banner that moved, a chair that left, evidence with a label image, a tag, a
/// proposal, a new class.
pub(super) fn eventful() -> Scratch {
    let scratch = Scratch::with_two_features();
    let bounds = BoxMm::from_mm([835_567_000, 817_816_000, 0], [835_600_000, 817_830_000, 30_000]).unwrap();
    let mut import = transaction(1);
    let geometry = import.add_geometry(b"a mesh".to_vec());
    let tower = |name: &str| FeatureState::Object { name: name.to_owned(), geometry, bounds };
    import.additions = vec![tower("tower"), tower("annexe")];
    scratch.map.commit(&import, at(2)).unwrap();
    let mut update = transaction(2);
    update.deltas = vec![Delta::modify(Fid(1), banner(0.0), banner(0.5)), Delta::remove(Fid(2), chair(100.0))];
    update.evidence = Some(seen(b"photo", Some(b"png")));
    scratch.map.commit(&update, at(3)).unwrap();
    let mut classes: Vec<_> = ClassTable::default().iter().cloned().collect();
    classes[8].name = "ground".to_owned();
    let mut rename = transaction(3);
    rename.classes = Some(ClassTable::new(classes).unwrap());
    scratch.map.commit(&rename, at(4)).unwrap();
    scratch.map.tag("surveyed", VersionId(1), at(5)).unwrap();
    let mut proposal = transaction(4);
    proposal.additions = vec![chair(3.0)];
    scratch.map.propose(&proposal, at(6)).unwrap();
    scratch
}

fn seen(capture: &[u8], labels: Option<&[u8]>) -> Observation {
    Observation {
        capture: Digest::of(capture),
        photo: None,
        taken_at: Some(at(2)),
        labels: labels.map(<[u8]>::to_vec),
        prior: None,
        camera: None,
        search: None,
        localization: None,
        plugins: Vec::new(),
        gates: Vec::new(),
        rejections: Vec::new(),
        decision: Decision::Committed,
        confirmations: Vec::new(),
    }
}

/// What `fsck` finds after damage by `sql`.
fn after_damage(sql: &str) -> Vec<String> {
    let scratch = eventful();
    damage(&scratch, sql);
    scratch.map.fsck().unwrap().iter().map(ToString::to_string).collect()
}

/// Runs `sql` without triggers, references and constraints.
pub(super) fn damage(scratch: &Scratch, sql: &str) {
    let raw = Connection::open(scratch.map.path()).unwrap();
    raw.execute_batch("PRAGMA foreign_keys = OFF; PRAGMA ignore_check_constraints = ON").unwrap();
    let triggers: Vec<(String, String)> = raw
        .prepare("SELECT name, sql FROM sqlite_schema WHERE type = 'trigger' ORDER BY name")
        .unwrap()
        .query_map([], |row| Ok((row.get(0)?, row.get(1)?)))
        .unwrap()
        .collect::<Result<_, _>>()
        .unwrap();
    triggers.iter().for_each(|(name, _)| raw.execute_batch(&format!("DROP TRIGGER {name}")).unwrap());
    raw.execute_batch(sql).unwrap();
    triggers.iter().for_each(|(_, definition)| raw.execute_batch(definition).unwrap());
}

fn assert_found(sql: &str, expected: &str) {
    let problems = after_damage(sql);
    let is_found = problems.iter().any(|problem| problem.starts_with(expected));
    assert!(is_found, "{sql}\nexpected {expected}\nfound {problems:#?}");
}

#[test]
fn a_sound_map_has_no_problems() {
    assert_eq!(eventful().map.fsck(), Ok(Vec::new()));
    assert_eq!(after_damage("SELECT 1"), Vec::<String>::new());
}

#[test]
fn a_changed_state_breaks_the_hash_of_its_version_alone() {
    // The object "tower" becomes "Tower".
    let sql = "UPDATE feature_version SET state = CAST(substr(state, 1, 9) || x'54' || substr(state, 11) AS BLOB)
        WHERE fid = 3";
    let problems = after_damage(sql);
    let chain: Vec<_> = problems.iter().filter(|problem| problem.contains("has hash")).collect();
    assert!(chain.len() == 1 && chain[0].starts_with("versions: version 2: has hash"), "{problems:#?}");
}

/// As the index has it, the row 2 lived for the two versions from 1 on.
pub(super) const BANNER_IS_ROW_99: &str = "UPDATE feature_index SET lives = CAST(x'63' || substr(lives, 2) AS BLOB)
    WHERE substr(lives, 1, 3) = x'020102'";
pub(super) const BANNER_IS_LIVE: &str = "UPDATE feature_index
    SET lives = CAST(substr(lives, 1, 2) || x'00' || substr(lives, 4) AS BLOB) WHERE substr(lives, 1, 3) = x'020102'";

/// What is done to the file, and how the problem that names it starts.
const DAMAGE: &[(&str, &str)] = &[
    // The index.
    ("DELETE FROM feature_index", "index: feature 3 from version 2: is not in the index"),
    ("DELETE FROM feature_index WHERE from_version = 2", "index: feature 4 from version 2: is not in the index"),
    ("UPDATE feature_index SET cell = cell + 1", "index: feature 2 from version 1: the index has it in cell"),
    ("UPDATE feature_index SET from_version = 2", "index: feature 2 from version 1: the index of its cell begins with"),
    (
        "UPDATE feature_index SET lives = CAST(substr(lives, 1, length(lives) - 1) AS BLOB)",
        "index: cell 80580489677: block of cell 80580489677 from version 1: byte",
    ),
    // The banner of version 1, the first of its block: its number, its end, its box.
    (BANNER_IS_ROW_99, "index: index row 99: belongs to no feature"),
    (BANNER_IS_LIVE, "index: feature 1 from version 1: the index has"),
    (
        "UPDATE feature_index SET lives = CAST(substr(lives, 1, 3) || x'80' || substr(lives, 5) AS BLOB)
        WHERE substr(lives, 1, 3) = x'020102'",
        "index: feature 1 from version 1: the index has",
    ),
    // Life spans.
    (
        "UPDATE feature_version SET to_version = 4 WHERE fid = 1 AND to_version = 3",
        "life-spans: feature 1 from version 3: overlaps",
    ),
    ("UPDATE feature_version SET to_version = 2 WHERE fid = 1 AND to_version = 3", "versions: version 2: says Counts"),
    (
        "UPDATE feature_version SET to_version = 1 WHERE fid = 2",
        "sqlite: file: CHECK constraint failed in feature_version",
    ),
    ("DELETE FROM feature_version WHERE fid = 4", "versions: version 2: says Counts"),
    // States.
    (
        "UPDATE feature_version SET state = x'0903' WHERE fid = 2",
        "states: feature 2 from version 1: the state cannot be read",
    ),
    ("UPDATE feature_version SET class = 4 WHERE fid = 2", "states: feature 2 from version 1: kind, class or geometry"),
    (
        "UPDATE feature_version SET state = CAST(x'02FE' || substr(state, 3) AS BLOB), class = 254 WHERE fid = 2",
        "states: feature 2 from version 1: class 254",
    ),
    // Geometry.
    ("UPDATE geometry SET bytes = x'00'", "geometry: geometry ea6d019c"),
    ("INSERT INTO geometry VALUES (zeroblob(32), x'00')", "geometry: geometry 0000"),
    ("DELETE FROM geometry", "references: feature_version 3: refers to a row of geometry"),
    // Versions.
    ("DELETE FROM version WHERE version = 2", "versions: version 2: is missing"),
    (
        "UPDATE version SET committed_at = committed_at - 600000000 WHERE version = 3",
        "versions: version 3: was made at",
    ),
    ("UPDATE version SET added = 7 WHERE version = 1", "versions: version 1: says Counts { added: 7"),
    ("UPDATE version SET e1 = e1 + 1 WHERE version = 1", "versions: version 1: has envelope"),
    ("UPDATE version SET hash = zeroblob(32) WHERE version = 1", "versions: version 2: has hash"),
    ("UPDATE meta SET crs = 'EPSG:2056'", "versions: version 0: has hash"),
    ("UPDATE version SET reverts = 1 WHERE version = 3", "versions: version 3: a version of kind revert, and no other"),
    (
        "UPDATE version SET kind = 'revert' WHERE version = 3",
        "versions: version 3: a version of kind revert, and no other",
    ),
    ("UPDATE version SET kind = 'import' WHERE version = 0", "versions: version 0: version 0, and no other"),
    // Classes.
    ("DELETE FROM class WHERE from_version = 4 AND class = 3", "classes: version 4: class \"banner\" is lost"),
    ("UPDATE class SET name = 'Stone' WHERE class = 0", "classes: version 0: class table at version 0"),
    ("DELETE FROM class WHERE from_version = 4", "versions: version 4: has hash"),
    // Evidence.
    ("UPDATE observation SET body = replace(body, '2026', '2025')", "observations: observation 1: has digest"),
    ("DELETE FROM observation", "observations: version 3: its observation is missing"),
    ("UPDATE observation SET capture = zeroblob(32)", "observations: observation 1: capture, labels or decision"),
    ("UPDATE observation SET labels = zeroblob(32)", "observations: observation 1: capture, labels or decision"),
    ("UPDATE label_image SET bytes = x'01'", "observations: label image"),
    ("UPDATE proposal SET operations = x'01'", "proposals: proposal 1: operations: at byte 0"),
    (
        "UPDATE proposal SET status = 'accepted', decided_at = 1, version = 99",
        "references: proposal 1: refers to a row",
    ),
    // Forgotten versions.
    (
        "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at) VALUES (2, 0, zeroblob(32), 9, 0)",
        "forgotten: version 3: follows a forgotten version and does not say so",
    ),
    (
        "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at) VALUES (2, 1, zeroblob(32), 9, 0)",
        "forgotten: version 2: is cut off from version 1, which is",
    ),
    (
        "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at) VALUES (2, 1, zeroblob(32), 9, 0)",
        "versions: version 2: has hash",
    ),
    (
        "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at) VALUES (4, 0, zeroblob(32), 9, 0)",
        "forgotten: version 4: is the newest and forgotten",
    ),
    (
        "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at) VALUES (1, 0, zeroblob(32), 9, 0)",
        "forgotten: tag \"surveyed\": names version 1, which is",
    ),
    (
        "INSERT INTO forgotten (version, has_state, operations, last_fid, forgotten_at) VALUES (1, 0, zeroblob(32), 9, 0), (2, 0, zeroblob(32), 9, 0)",
        "forgotten: feature 2 from version 1: is in no version that is kept",
    ),
    ("INSERT INTO looked_at VALUES (9, 0, 0, 0, 0, 0, 0)", "references: looked_at 9: refers to a row of version"),
    ("DROP INDEX observation_digest", "schema: index observation_digest: is missing"),
    // Names and the file itself.
    ("UPDATE tag SET name = 'head'", "tags: tag \"head\""),
    ("UPDATE tag SET version = 77", "references: tag: refers to a row of version"),
    ("DELETE FROM meta", "meta: meta: expected one row, found 0"),
    ("UPDATE meta SET format = 'x'", "meta: meta: expected format"),
    ("DROP INDEX feature_version_live", "schema: index feature_version_live: is missing"),
    ("CREATE TABLE extra (x)", "schema: table extra: does not belong"),
];

#[test]
fn every_seeded_kind_of_damage_is_found_and_named() {
    for (sql, expected) in DAMAGE {
        assert_found(sql, expected);
    }
}

#[test]
fn a_missing_trigger_is_found() {
    let scratch = eventful();
    let raw = Connection::open(scratch.map.path()).unwrap();
    raw.execute_batch("DROP TRIGGER version_is_final").unwrap();
    let problems = scratch.map.fsck().unwrap();
    assert_eq!(problems[0].to_string(), "schema: trigger version_is_final: is missing");
}

#[test]
fn history_cannot_be_rewritten_through_plain_sql() {
    let scratch = eventful();
    let raw = Connection::open(scratch.map.path()).unwrap();
    for sql in [
        "UPDATE version SET message = 'x'",
        "DELETE FROM version",
        "UPDATE feature_version SET state = x'00'",
        "UPDATE feature_version SET to_version = NULL WHERE fid = 2",
        "DELETE FROM feature_version",
        "UPDATE geometry SET bytes = x'00'",
        "DELETE FROM class",
    ] {
        assert!(raw.execute_batch(sql).is_err(), "{sql}");
    }
}

#[test]
fn a_bit_flipped_anywhere_in_the_file_never_panics() {
    let scratch = eventful();
    let path = scratch.map.path().to_owned();
    let copy = scratch.directory.path().join("flipped.rsv");
    drop(scratch.map);
    let bytes = std::fs::read(path).unwrap();
    let everywhere = BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap();
    let mut found = 0;
    for position in (0..bytes.len()).step_by(331) {
        let mut flipped = bytes.clone();
        flipped[position] ^= 0x10;
        std::fs::write(&copy, &flipped).unwrap();
        let sound = MapFile::open_read_only(&copy).and_then(|map| {
            map.snapshot(VersionId(2))?.features(Some(&everywhere))?;
            map.log(Some(&everywhere))?;
            map.changes(VersionId(0), VersionId(4), None)?;
            map.fsck()
        });
        found += usize::from(sound != Ok(Vec::new()));
    }
    // Most bytes of so small a file are unused; what is used is noticed.
    assert!(found > 20, "{found}");
}
