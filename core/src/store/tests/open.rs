//! Opening what is, is not, or is no longer a map.

use super::*;
use crate::store::StoreError;
use crate::version::BoxMm;
use rusqlite::Connection;
use std::fs;
use std::time::Duration;

fn open_error(path: &std::path::Path) -> StoreError {
    let Err(error) = MapFile::open_read_only(path) else { panic!("it opened") };
    let writing = MapFile::open(path).err();
    assert_eq!(writing, Some(error.clone()));
    error
}

#[test]
fn a_file_that_is_not_a_map_is_refused() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("x.rsv");
    assert!(matches!(open_error(&path), StoreError::NotFound { .. }));
    assert!(matches!(open_error(directory.path()), StoreError::NotAMap { .. }));
    for contents in [&b""[..], b"{}", &[0; 5000]] {
        fs::write(&path, contents).unwrap();
        assert!(matches!(open_error(&path), StoreError::NotAMap { .. }));
    }
    fs::remove_file(&path).unwrap();
    Connection::open(&path).unwrap().execute_batch("CREATE TABLE other (x)").unwrap();
    let message = open_error(&path).to_string();
    assert!(message.contains("application id 0"), "{message}");
}

#[test]
fn a_newer_format_is_refused_by_both_numbers() {
    let scratch = Scratch::new();
    scratch.map.connection.pragma_update(None, "user_version", 7).unwrap();
    let error = open_error(scratch.map.path());
    assert!(matches!(error, StoreError::NewerFormat { found: 7, supported: 4, .. }), "{error}");
}

#[test]
fn a_map_that_a_newer_program_migrated_meanwhile_is_not_written_to() {
    let scratch = Scratch::with_two_features();
    let raw = Connection::open(scratch.map.path()).unwrap();
    raw.pragma_update(None, "user_version", 7).unwrap();
    let refused = scratch.add(1, &[chair(1.0)]).unwrap_err();
    assert!(matches!(refused, CommitError::Store(StoreError::NewerFormat { found: 7, .. })), "{refused}");
    assert_eq!(scratch.map.head(), Ok(VersionId(1)));
}

#[test]
fn a_copy_with_another_journal_keeps_its_bytes_until_something_is_written() {
    let scratch = Scratch::with_two_features();
    let path = scratch.directory.path().join("copy.rsv");
    scratch.map.connection.execute("VACUUM INTO ?1", [path.to_str().unwrap()]).unwrap();
    let before = fs::read(&path).unwrap();
    let map = MapFile::open(&path).unwrap();
    assert!(matches!(map.untag("none"), Err(StoreError::NoSuchTag { .. })));
    assert_eq!(map.head(), Ok(VersionId(1)));
    assert!(fs::read(&path).unwrap() == before);
    map.tag("surveyed", VersionId(1), at(2)).unwrap();
    let mode: String = map.connection.pragma_query_value(None, "journal_mode", |row| row.get(0)).unwrap();
    assert_eq!((mode.as_str(), map.fsck()), ("wal", Ok(Vec::new())));
}

#[test]
fn a_truncated_map_is_damaged() {
    let Scratch { directory, map } = Scratch::with_two_features();
    let path = map.path().to_owned();
    drop(map);
    let bytes = fs::read(&path).unwrap();
    for length in [20, 99, 100, 3000, 4096, 8192, bytes.len() - 4096, bytes.len() - 1] {
        fs::write(&path, &bytes[..length]).unwrap();
        let error = MapFile::open(&path).and_then(|map| {
            map.read(|connection| Ok(connection.query_row("PRAGMA quick_check", [], |row| row.get::<_, String>(0))?))
        });
        assert!(matches!(error, Err(StoreError::Damaged { .. })), "{length} of {}: {error:?}", bytes.len());
    }
    drop(directory);
}

#[test]
fn an_existing_file_is_never_overwritten() {
    let scratch = Scratch::with_two_features();
    let path = scratch.map.path();
    let error = MapFile::create(path, &new_map(), at(5)).err();
    assert_eq!(error, Some(StoreError::Exists { path: path.to_owned() }));
    assert_eq!(MapFile::open(path).unwrap().head(), Ok(VersionId(1)));
}

#[test]
fn what_is_read_without_locks_while_somebody_writes_is_no_answer() {
    let scratch = Scratch::new();
    scratch.add(0, &[chair(0.0)]).unwrap();
    let (path, later) = (scratch.map.path().to_owned(), std::time::SystemTime::now() + Duration::from_secs(9));
    drop(scratch.map);
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    let reader = MapFile::open_read_only(&path).unwrap();
    assert_eq!(reader.head(), Ok(VersionId(1)));
    assert!(!path.with_extension("rsv-shm").exists(), "a reader who may not write leaves nothing");
    fs::File::open(&path).unwrap().set_modified(later).unwrap();
    assert_eq!(reader.head(), Err(StoreError::WrittenMeanwhile { path: path.clone() }));
    assert_eq!(MapFile::open_read_only(&path).unwrap().head(), Ok(VersionId(1)));
    fs::write(path.with_extension("rsv-wal"), b"of a writer").unwrap();
    assert_eq!(reader.fsck(), Err(StoreError::WrittenMeanwhile { path }));
}

#[test]
fn a_reader_leaves_no_file_beside_the_map() {
    let scratch = Scratch::new();
    scratch.add(0, &[chair(0.0)]).unwrap();
    let path = scratch.map.path().to_owned();
    drop(scratch.map);
    assert_eq!(MapFile::open_read_only(&path).unwrap().head(), Ok(VersionId(1)));
    let left = ["rsv-wal", "rsv-shm"].map(|extension| path.with_extension(extension).exists());
    assert_eq!(left, [false, false]);
}

#[test]
fn a_read_only_file_can_be_read_and_not_written() {
    let scratch = Scratch::with_two_features();
    let path = scratch.map.path().to_owned();
    let mut permissions = fs::metadata(&path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&path, permissions).unwrap();
    assert_eq!(MapFile::open(&path).err(), Some(StoreError::ReadOnly { path: path.clone() }));
    let reader = MapFile::open_read_only(&path).unwrap();
    assert_eq!(reader.head(), Ok(VersionId(1)));
    assert_eq!(reader.tag("x", VersionId(1), at(3)), Err(StoreError::ReadOnly { path }));
}

#[cfg(unix)]
#[test]
fn a_map_in_a_directory_that_cannot_be_written_can_be_read() {
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::PermissionsExt;
    let Scratch { directory, map } = Scratch::with_two_features();
    let mut path = map.path().to_owned();
    drop(map);
    // The last one is no text in any encoding.
    for name in [&b"what%20a?name#.rsv"[..], "街.rsv".as_bytes(), b"\xff.rsv"] {
        let renamed = directory.path().join(std::ffi::OsStr::from_bytes(name));
        fs::rename(path, &renamed).unwrap();
        path = renamed;
        fs::set_permissions(directory.path(), fs::Permissions::from_mode(0o555)).unwrap();
        assert_eq!(MapFile::open_read_only(&path).unwrap().head(), Ok(VersionId(1)));
        fs::set_permissions(directory.path(), fs::Permissions::from_mode(0o755)).unwrap();
    }
    fs::set_permissions(directory.path(), fs::Permissions::from_mode(0o555)).unwrap();
    let reader = MapFile::open_read_only(&path).unwrap();
    let region = BoxMm::of_plan(835_567.0, 817_800.0, 835_568.0, 817_830.0).unwrap();
    let found = reader.snapshot(VersionId(1)).unwrap().features(Some(&region)).unwrap();
    assert_eq!(found.len(), 1);
    fs::set_permissions(directory.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let beside: Vec<_> = fs::read_dir(directory.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(beside, [path.file_name().unwrap()]);
}

#[test]
fn another_writer_is_waited_for_and_then_named() {
    let scratch = Scratch::with_two_features();
    let other = Connection::open(scratch.map.path()).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    scratch.map.set_busy_timeout(Duration::from_millis(50)).unwrap();
    let path = scratch.map.path().to_owned();
    assert_eq!(scratch.add(1, &[chair(1.0)]), Err(CommitError::Store(StoreError::Busy { path })));
    // A reader does not wait.
    assert_eq!(scratch.map.head(), Ok(VersionId(1)));
    other.execute_batch("ROLLBACK").unwrap();
    assert_eq!(scratch.add(1, &[chair(1.0)]), Ok(VersionId(2)));
}

#[test]
fn a_writer_waits_for_the_turn_of_another_until_it_ends() {
    let scratch = Scratch::with_two_features();
    let other = MapFile::open(scratch.map.path()).unwrap();
    scratch.map.set_busy_timeout(Duration::from_millis(20)).unwrap();
    let turn = other.take_turn().unwrap();
    let path = scratch.map.path().to_owned();
    assert_eq!(scratch.add(1, &[chair(1.0)]), Err(CommitError::Store(StoreError::Busy { path: path.clone() })));
    // Writing the file anew moves the log too.
    assert_eq!(scratch.map.compact(), Err(StoreError::Busy { path }));
    assert_eq!(scratch.map.head(), Ok(VersionId(1)));
    drop(turn);
    assert_eq!(scratch.add(1, &[chair(1.0)]), Ok(VersionId(2)));
    assert_eq!(scratch.map.compact(), Ok(()));
}

#[test]
fn a_map_says_what_its_coordinates_mean() {
    let scratch = Scratch::new();
    let info = MapFile::open(scratch.map.path()).unwrap().info().unwrap();
    assert_eq!((info.map_id, info.frame, info.created_at, info.format), ("test".into(), new_map().frame, at(0), 4));
}

#[test]
fn a_map_that_cannot_be_made_leaves_no_file() {
    let directory = TempDir::new().unwrap();
    let path = directory.path().join("map.rsv");
    let classes = ClassTable::new(Vec::new()).unwrap();
    let error = MapFile::create(&path, &NewMap { classes, ..new_map() }, at(0)).err();
    assert!(matches!(error, Some(StoreError::ClassTable { .. })), "{error:?}");
    assert!(!path.exists());
    let missing = directory.path().join("no/such/directory.rsv");
    assert!(matches!(MapFile::create(&missing, &new_map(), at(0)), Err(StoreError::Io { .. })));
}
