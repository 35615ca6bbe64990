//! Mending what can be worked out, and nothing else.

use super::fsck::{BANNER_IS_LIVE, BANNER_IS_ROW_99, damage, eventful};
use super::*;
use crate::version::{BoxMm, Digest};

/// What `repair` did after `sql`, and what `fsck` finds then.
fn repaired(sql: &str) -> (Vec<String>, Vec<String>) {
    let scratch = eventful();
    damage(&scratch, sql);
    assert_ne!(scratch.map.fsck(), Ok(Vec::new()), "{sql} did no harm");
    let texts = |problems: Vec<crate::store::Problem>| problems.iter().map(ToString::to_string).collect::<Vec<_>>();
    let done = texts(scratch.map.repair().unwrap());
    (done, texts(scratch.map.fsck().unwrap()))
}

/// Both are what their digest says.
const MESH_NOBODY_USES: &str =
    "INSERT INTO geometry VALUES (x'6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d', x'00')";
const IMAGE_NOBODY_NAMES: &str =
    "INSERT INTO label_image VALUES (x'6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d', x'00')";

/// One bit of the key is another: both begin with another digit.
const MESH_UNDER_ANOTHER_KEY: &str = "UPDATE geometry SET digest = CAST(x'eb' || substr(digest, 2) AS BLOB)";
const IMAGE_UNDER_ANOTHER_KEY: &str = "UPDATE label_image SET digest = CAST(x'8e' || substr(digest, 2) AS BLOB)";

/// Rows of features, meshes, label images and observations.
fn rows(scratch: &Scratch) -> [i64; 4] {
    let count = |table: &str| {
        let sql = format!("SELECT count(*) FROM {table} ORDER BY 1");
        scratch.map.read(|connection| Ok(connection.query_row(&sql, [], |row| row.get(0))?)).unwrap()
    };
    ["feature_version", "geometry", "label_image", "observation"].map(count)
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
        (MESH_NOBODY_USES, "geometry: meshes: removed 1"),
        (IMAGE_NOBODY_NAMES, "observations: label images: removed 1"),
        (MESH_UNDER_ANOTHER_KEY, "geometry: geometry eb6d019c"),
        (IMAGE_UNDER_ANOTHER_KEY, "observations: label image 8e"),
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
        "UPDATE label_image SET bytes = x'00'",
        "UPDATE observation SET labels = CAST(x'8e' || substr(labels, 2) AS BLOB)",
        "UPDATE observation SET labels = NULL",
        "UPDATE feature_version SET geometry = CAST(x'eb' || substr(geometry, 2) AS BLOB) WHERE geometry IS NOT NULL",
        "UPDATE tag SET name = 'head'",
        "DELETE FROM observation",
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
    let everywhere = BoxMm::of_plan(0.0, 0.0, 1e6, 1e6).unwrap();
    let ask = |version| scratch.map.snapshot(VersionId(version)).unwrap().features(Some(&everywhere)).unwrap();
    let before = [1, 2, 3, 4].map(ask);
    damage(&scratch, "DELETE FROM feature_index");
    assert!(ask(4).is_empty());
    scratch.map.repair().unwrap();
    assert_eq!([1, 2, 3, 4].map(ask), before);
    assert_eq!(scratch.map.geometry(Digest::of(b"a mesh")), Ok(b"a mesh".to_vec()));
}

#[test]
fn bytes_under_another_key_than_theirs_are_found_again_where_they_are_asked_for() {
    for sql in [MESH_UNDER_ANOTHER_KEY, IMAGE_UNDER_ANOTHER_KEY] {
        let (_, left) = repaired(sql);
        assert_eq!(left, Vec::<String>::new(), "{sql}");
        let scratch = eventful();
        damage(&scratch, sql);
        scratch.map.repair().unwrap();
        assert_eq!(scratch.map.geometry(Digest::of(b"a mesh")), Ok(b"a mesh".to_vec()));
        assert_eq!(scratch.map.label_image(Digest::of(b"png")), Ok(Some(b"png".to_vec())));
    }
}

#[test]
fn nothing_that_a_damaged_part_may_ask_for_is_removed() {
    for sql in [
        "UPDATE observation SET labels = NULL",
        "UPDATE observation SET body = replace(body, '2026', '2025')",
        "UPDATE feature_version SET geometry = CAST(x'eb' || substr(geometry, 2) AS BLOB) WHERE geometry IS NOT NULL",
        "UPDATE feature_version SET state = x'0903' WHERE fid = 3",
        "UPDATE version SET hash = zeroblob(32) WHERE version = 2",
        "UPDATE geometry SET bytes = x'01'",
        "DELETE FROM feature_version WHERE geometry IS NOT NULL",
        "DELETE FROM observation",
    ] {
        let scratch = eventful();
        damage(&scratch, &format!("{sql}; {MESH_NOBODY_USES}; {IMAGE_NOBODY_NAMES}"));
        let before = rows(&scratch);
        scratch.map.repair().unwrap();
        assert_eq!(rows(&scratch), before, "{sql}");
        let error = scratch.map.gc(None, at(9)).unwrap_err();
        assert!(error.to_string().contains("nothing was forgotten or removed"), "{sql}: {error}");
        assert_eq!(rows(&scratch), before, "{sql}");
    }
}

#[test]
fn states_stay_when_a_kept_version_passes_for_forgotten() {
    let scratch = forget::moving();
    scratch.map.tag("surveyed", VersionId(2), at(8)).unwrap();
    scratch.map.gc(Some(VersionId(5)), at(9)).unwrap();
    damage(&scratch, "UPDATE forgotten SET has_state = 0 WHERE version = 2");
    let before = rows(&scratch);
    scratch.map.repair().unwrap();
    assert_eq!(rows(&scratch), before);
    assert_ne!(scratch.map.fsck(), Ok(Vec::new()));
}

#[test]
fn the_index_keeps_the_place_of_a_state_that_its_version_does_not_vouch_for() {
    let scratch = eventful();
    let around_banner = BoxMm::of_plan(835_567.0, 817_816.0, 835_568.0, 817_827.0).unwrap();
    let found = || {
        let lives = scratch.map.read(|connection| {
            let versions = 3..=3;
            let lives = crate::store::index::lives_in(connection, &around_banner, versions)?;
            Ok(lives.iter().map(|life| life.ends).collect::<Vec<_>>())
        });
        lives.unwrap()
    };
    let before = found();
    // The first corner moves by 32 km, and the index loses what it has of the objects.
    damage(
        &scratch,
        "UPDATE feature_version SET state = CAST(substr(state, 1, 9) || x'28' || substr(state, 11) AS BLOB)
            WHERE fid = 1 AND from_version = 3;
        DELETE FROM feature_index WHERE from_version = 2",
    );
    let done = scratch.map.repair().unwrap();
    assert!(done.iter().any(|one| one.place == "feature 3 from version 2"), "{done:?}");
    assert!(done.iter().all(|one| !one.place.starts_with("feature 1 ")), "{done:?}");
    assert_eq!(found(), before);
    let left: Vec<String> = scratch.map.fsck().unwrap().iter().map(ToString::to_string).collect();
    assert!(left.iter().any(|one| one.starts_with("versions: version 3: has hash")), "{left:?}");
}

#[test]
fn two_rows_with_one_key_are_damage_and_no_bug() {
    let scratch = eventful();
    let mut attempt = history::observation(crate::version::Decision::Unreliable);
    attempt.labels = Some(b"attempt".to_vec());
    scratch.map.record_observation(VersionId(4), &attempt, at(8)).unwrap();
    let path = scratch.map.path().to_owned();
    drop(scratch.map);
    let mut bytes = std::fs::read(&path).unwrap();
    // The key and the bytes of a label image stand together in the table, and not in its index.
    let row = [&Digest::of(b"attempt").0[..], b"attempt"].concat();
    let at = bytes.windows(row.len()).position(|window| window == row).unwrap();
    bytes[at..at + 32].copy_from_slice(&Digest::of(b"png").0);
    std::fs::write(&path, bytes).unwrap();
    let map = MapFile::open(&path).unwrap();
    let error = map.repair().unwrap_err();
    assert!(matches!(error, crate::store::StoreError::Damaged { .. }), "{error}");
    assert!(error.to_string().contains("two rows have one key"), "{error}");
    drop(scratch.directory);
}

#[test]
fn an_origin_beyond_every_map_is_found_and_chosen_anew() {
    for sql in [
        "UPDATE meta SET index_e0 = -9223372036854775808",
        "UPDATE meta SET index_n0 = 9223372036854775807",
        "UPDATE meta SET index_e0 = 4",
    ] {
        let scratch = eventful();
        damage(&scratch, sql);
        let everywhere = BoxMm::of_plan(-1e9, -1e9, 1e9, 1e9).unwrap();
        let asked = scratch.map.snapshot(VersionId(3)).and_then(|snapshot| snapshot.features(Some(&everywhere)));
        assert!(asked.is_ok(), "{sql}: {asked:?}");
        let (done, left) = repaired(sql);
        assert!(done[0].starts_with("meta: meta: chose the origin"), "{sql}: {done:?}");
        assert_eq!(left, Vec::<String>::new(), "{sql}");
    }
}

#[test]
fn a_version_with_a_number_beyond_all_is_named_and_not_counted_up_to() {
    let scratch = eventful();
    damage(&scratch, "UPDATE version SET version = 2000000000 WHERE version = 4");
    let problems: Vec<String> = scratch.map.fsck().unwrap().iter().map(ToString::to_string).collect();
    assert!(problems.iter().any(|one| one.starts_with("versions: version 4: is missing")), "{problems:?}");
    assert_eq!(scratch.map.repair(), Ok(Vec::new()));
}

#[test]
fn a_row_whose_number_no_index_can_hold_is_named_and_its_neighbours_stay_in_the_index() {
    let scratch = eventful();
    damage(&scratch, "UPDATE feature_version SET id = -1 WHERE id = 3");
    let before = scratch.map.fsck().unwrap().len();
    scratch.map.repair().unwrap();
    let after = scratch.map.fsck().unwrap();
    assert!(after.len() <= before, "{after:#?}");
    assert!(after.iter().any(|one| one.to_string().contains("expected numbers from 1")), "{after:#?}");
    assert!(!after.iter().any(|one| one.check == "index"), "{after:#?}");
}
