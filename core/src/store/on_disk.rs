//! The file of a map as the system shows it, without SQLite.

use super::error::StoreError;
use std::fs;
use std::path::{Path, PathBuf};

/// Refuses what is plainly not a map before SQLite sees it.
pub(super) fn inspect(path: &Path) -> Result<(), StoreError> {
    const MAGIC: &[u8] = b"SQLite format 3\0";
    const HEADER_BYTES: u64 = 100;
    let not_a_map = |found: &str| StoreError::NotAMap { path: path.to_owned(), found: found.to_owned() };
    let metadata = fs::metadata(path).map_err(|error| io_error(path, &error))?;
    if !metadata.is_file() {
        return Err(not_a_map("a directory or device"));
    }
    if metadata.len() == 0 {
        return Err(not_a_map("an empty file"));
    }
    if metadata.len() >= HEADER_BYTES {
        // Closing a file takes away the locks that SQLite has on it anywhere in this process, so it is not opened here.
        return Ok(());
    }
    let start = fs::read(path).map_err(|error| io_error(path, &error))?;
    if !start.starts_with(MAGIC) {
        return Err(not_a_map("another kind of file"));
    }
    Err(ends_after(path, metadata.len()))
}

/// What SQLite said of the file at `path`, unless it ends within a page: then that.
pub(super) fn unless_cut<T>(path: &Path, opened: Result<T, StoreError>) -> Result<T, StoreError> {
    // Every page size of SQLite is a multiple of it.
    const LEAST_PAGE_BYTES: u64 = 512;
    if matches!(opened, Ok(_) | Err(StoreError::Damaged { .. })) {
        let bytes = fs::metadata(path).map_err(|error| io_error(path, &error))?.len();
        // A crash while the log is written back may leave part of a page, which the log then mends.
        if bytes % LEAST_PAGE_BYTES != 0 && !has_write_ahead_log(path) {
            return Err(ends_after(path, bytes));
        }
    }
    opened
}

fn ends_after(path: &Path, bytes: u64) -> StoreError {
    StoreError::Damaged { path: path.to_owned(), detail: format!("it ends after {bytes} bytes") }
}

fn io_error(path: &Path, error: &std::io::Error) -> StoreError {
    match error.kind() {
        std::io::ErrorKind::NotFound => StoreError::NotFound { path: path.to_owned() },
        _ => StoreError::Io { path: path.to_owned(), detail: error.to_string() },
    }
}

/// Whether the marks on the file forbid writing, also to a user who could write all the same.
pub(super) fn is_marked_read_only(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| metadata.permissions().readonly())
}

/// The file beside the map that SQLite names so.
pub(super) fn beside(path: &Path, suffix: &str) -> PathBuf {
    let mut file = path.as_os_str().to_owned();
    file.push(suffix);
    file.into()
}

/// Whether something is in the log beside the map.
pub(super) fn has_write_ahead_log(path: &Path) -> bool {
    fs::metadata(beside(path, "-wal")).is_ok_and(|metadata| metadata.len() > 0)
}

/// Whether this user may write a map at `path`, by its marks and by the rights to it and its directory.
pub(super) fn may_write(path: &Path) -> bool {
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    [path, directory].into_iter().all(|place| !is_marked_read_only(place) && has_right_to_write(place))
}

#[cfg(unix)]
pub(super) fn has_right_to_write(path: &Path) -> bool {
    rustix::fs::access(path, rustix::fs::Access::WRITE_OK).is_ok()
}

#[cfg(not(unix))]
pub(super) fn has_right_to_write(_path: &Path) -> bool {
    true
}

/// What a file was when it was opened as one that nobody writes.
#[derive(Debug)]
pub(super) struct Stamp(Option<Marks>);

/// Length, number in the file system, and seconds and nanoseconds of the last write.
type Marks = (u64, u64, i64, i64);

impl Stamp {
    pub(super) fn of(path: &Path) -> Self {
        Self(fs::metadata(path).ok().map(|metadata| marks(&metadata)))
    }

    /// Whether nobody has written since: every writer leaves something in the log before it touches the file.
    pub(super) fn is_still(&self, path: &Path) -> bool {
        !has_write_ahead_log(path) && self.0.is_some() && Self::of(path).0 == self.0
    }
}

#[cfg(unix)]
fn marks(metadata: &fs::Metadata) -> Marks {
    use std::os::unix::fs::MetadataExt;
    (metadata.len(), metadata.ino(), metadata.mtime(), metadata.mtime_nsec())
}

/// Elsewhere every user who reads may lock.
#[cfg(not(unix))]
fn marks(metadata: &fs::Metadata) -> Marks {
    (metadata.len(), 0, 0, 0)
}

/// A URI that tells SQLite that nobody writes to the file.
pub(super) fn immutable_uri(path: &Path) -> String {
    let mut uri = "file:".to_owned();
    for &byte in path.as_os_str().as_encoded_bytes() {
        // A name need not be UTF-8, a URI is ASCII.
        if byte.is_ascii() && !b"%?#".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            uri += &format!("%{byte:02X}");
        }
    }
    uri + "?immutable=1"
}
