//! Mending what can be worked out, and nothing else.

use super::fsck::{BANNER_IS_LIVE, BANNER_IS_ROW_99, damage, eventful};
use super::*;
use crate::version::Digest;

/// What `repair` did after `sql`, and what `fsck` finds then.
fn repaired(sql: &str) -> (Vec<String>, Vec<String>) {
    let scratch = eventful();
    damage(&scratch, sql);
    assert_ne!(scratch.map.fsck(), Ok(Vec::new()), "{sql} did no harm");
    let texts = |problems: Vec<crate::store::Problem>| problems.iter().map(ToString::to_string).collect::<Vec<_>>();
    let done = texts(scratch.map.repair().unwrap());
    (done, texts(scratch.map.fsck().unwrap()))
}

#[test]
fn a_sound_map_is_left_alone() {
    let scratch = eventful();
    let before = scratch.map.log(None).unwrap();
    assert_eq!(scratch.map.repair(), Ok(Vec::new()));
    assert_eq!((scratch.map.log(None).unwrap(), scratch.map.fsck()), (before, Ok(Vec::new())));
}

#[test]
fn what_the_states_say_is_mended_and_named() {
    for (sql, expected) in [
        ("DELETE FROM feature_index WHERE from_version = 2", "index: feature 3 from version 2: put into the index"),
        ("DELETE FROM feature_index", "index: feature 1 from version 3: put into the index"),
        ("UPDATE feature_index SET cell = cell - 1", "index: feature 2 from version 1: put into the index"),
        (BANNER_IS_LIVE, "index: feature 1 from version 1: put into the index"),
        (BANNER_IS_ROW_99, "index: index row 99: removed: belongs to no feature"),
        ("UPDATE feature_index SET lives = x'80'", "index: cell 80580489677: removed: block of cell"),
        ("UPDATE meta SET index_e0 = NULL, index_n0 = NULL", "meta: meta: chose the origin of the index anew"),
        ("INSERT INTO geometry VALUES (zeroblob(32), x'00')", "geometry: meshes: removed 1"),
        ("INSERT INTO label_image VALUES (zeroblob(32), x'00')", "observations: label images: removed 1"),
    ] {
        let (done, left) = repaired(sql);
        assert!(done.iter().any(|one| one.starts_with(expected)), "{sql}\nexpected {expected}\nfound {done:#?}");
        assert_eq!(left, Vec::<String>::new(), "{sql}");
    }
}

#[test]
fn what_is_not_derivable_is_named_and_left() {
    for sql in [
        "UPDATE version SET added = 7 WHERE version = 1",
        "UPDATE version SET hash = zeroblob(32) WHERE version = 1",
        "UPDATE feature_version SET state = x'0903' WHERE fid = 2",
        "UPDATE observation SET body = replace(body, '2026', '2025')",
        "UPDATE geometry SET bytes = x'00'",
        "UPDATE tag SET name = 'head'",
    ] {
        let scratch = eventful();
        damage(&scratch, sql);
        let before = scratch.map.fsck().unwrap();
        assert_eq!(scratch.map.repair(), Ok(Vec::new()), "{sql}");
        assert_eq!(scratch.map.fsck(), Ok(before), "{sql}");
    }
}

#[test]
fn questions_are_answered_again_after_the_index_was_lost() {
    let scratch = eventful();
    let everywhere = crate::version::BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap();
    let ask = |version| scratch.map.snapshot(VersionId(version)).unwrap().features(Some(&everywhere)).unwrap();
    let before = [1, 2, 3, 4].map(ask);
    damage(&scratch, "DELETE FROM feature_index");
    assert!(ask(4).is_empty());
    scratch.map.repair().unwrap();
    assert_eq!([1, 2, 3, 4].map(ask), before);
    assert_eq!(scratch.map.geometry(Digest::of(b"a mesh")), Ok(b"a mesh".to_vec()));
}
