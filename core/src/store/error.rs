//! What can be wrong with a map file or a question to it.

use crate::version::{Digest, Fid, InvalidRevision, VersionId, parse_moment};
use jiff::Timestamp;
use rusqlite::{ErrorCode, ffi};
use std::path::{Path, PathBuf};

/// Why the map could not answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// No file there.
    #[error("{}: no such map; \"resurvey init\" makes one", .path.display())]
    NotFound {
        /// The file.
        path: PathBuf,
    },
    /// A file is there already.
    #[error("{}: exists already; expected a path without a file", .path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Some other file.
    #[error("{}: not a map; expected a resurvey map file, found {found}", .path.display())]
    NotAMap {
        /// The file.
        path: PathBuf,
        /// What it seems to be.
        found: String,
    },
    /// Written by a newer program.
    #[error("{}: the map has format {found}, this program reads formats up to {supported}; upgrade resurvey", .path.display())]
    NewerFormat {
        /// The file.
        path: PathBuf,
        /// Its format.
        found: i32,
        /// The newest one known here.
        supported: i32,
    },
    /// Contents that cannot be.
    #[error("{}: the map file is damaged: {detail}; \"resurvey fsck\" lists what is wrong", .path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What was found.
        detail: String,
    },
    /// Another writer had it for longer than the time to wait.
    #[error("{}: another process is writing to the map; try again when it is done", .path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// It cannot be locked here, and somebody else wrote to it while it was read.
    #[error("{}: somebody else wrote to the map while it was read, and this user cannot lock it; try again, or read a copy", .path.display())]
    WrittenMeanwhile {
        /// The file.
        path: PathBuf,
    },
    /// Only reading is allowed.
    #[error("{}: read-only; expected a map that can be written, with its directory and the files -wal and -shm beside it", .path.display())]
    ReadOnly {
        /// The file.
        path: PathBuf,
    },
    /// The file system cannot hold a write-ahead log.
    #[error("{}: the map needs a write-ahead log beside it and {detail}; keep it in a directory that can be written, on a local disk (not a network file system)", .path.display())]
    NoWriteAheadLog {
        /// The file.
        path: PathBuf,
        /// What was found instead.
        detail: String,
    },
    /// No room on the disk; nothing was written.
    #[error("{}: the disk is full; the map is unchanged", .path.display())]
    Full {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused.
    #[error("{}: {detail}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What it said.
        detail: String,
    },
    /// A number above the newest.
    #[error("no version {version}; the newest is {head}")]
    NoSuchVersion {
        /// What was asked for.
        version: VersionId,
        /// The newest.
        head: VersionId,
    },
    /// Forgotten by gc.
    #[error("version {version} was forgotten; the next one that is kept is {next}")]
    Forgotten {
        /// What was asked for.
        version: VersionId,
        /// The first kept version after it.
        next: VersionId,
    },
    /// A time of which only forgotten versions could tell.
    #[error("what the map knew of {time} is forgotten in part, with versions before {next}; ask for a version")]
    ForgottenTime {
        /// What was asked for.
        time: Timestamp,
        /// The first kept version after the forgotten ones.
        next: VersionId,
    },
    /// Not in the map at that version.
    #[error("no feature {fid} at version {version}; \"resurvey log MAP {fid}\" lists the versions that changed it")]
    NoSuchFeature {
        /// What was asked for.
        fid: Fid,
        /// Where.
        version: VersionId,
    },
    /// Not in the map at any version.
    #[error("no feature {fid} at any version that is kept; \"resurvey query MAP\" lists the features of the newest")]
    NeverAFeature {
        /// What was asked for.
        fid: Fid,
    },
    /// A name nobody gave.
    #[error("no tag {name:?} in the map; {}", instead_of_tag(name))]
    NoSuchTag {
        /// What was asked for.
        name: String,
    },
    /// A name that has a version.
    #[error("tag {name:?} names version {version} already; \"resurvey tag MAP {name} --delete\" takes it away")]
    TagTaken {
        /// The name.
        name: String,
        /// What it names.
        version: VersionId,
    },
    /// A name that no tag can have.
    #[error("{name:?} cannot be a tag; expected letters, digits and . _ - /, not a number, not \"head\"")]
    TagName {
        /// What was given.
        name: String,
    },
    /// Before there was a map.
    #[error("no version at {asked}; the first was made at {first}")]
    BeforeFirst {
        /// What was asked for.
        asked: Timestamp,
        /// The time of version 0.
        first: Timestamp,
    },
    /// Not a revision at all.
    #[error(transparent)]
    Revision(#[from] InvalidRevision),
    /// A class table that no map takes.
    #[error("class table: {detail}")]
    ClassTable {
        /// Why.
        detail: String,
    },
    /// Evidence that cannot be written down.
    #[error("observation: {detail}")]
    Observation {
        /// Why.
        detail: String,
    },
    /// Geometry that the map does not have.
    #[error("no geometry {digest}")]
    NoSuchGeometry {
        /// What was asked for.
        digest: Digest,
    },
    /// No such proposal.
    #[error("no proposal {id}; \"resurvey proposals MAP list --all\" lists them")]
    NoSuchProposal {
        /// What was asked for.
        id: u64,
    },
    /// The proposal was decided before.
    #[error("proposal {id} is {status} already; \"resurvey proposals MAP show {id}\" says by whom and why")]
    ProposalDecided {
        /// The proposal.
        id: u64,
        /// `accepted` or `rejected`.
        status: String,
    },
    /// A statement that should not be able to fail did.
    #[error("{}: {detail}; this is a bug in resurvey", .path.display())]
    Internal {
        /// The file.
        path: PathBuf,
        /// What SQLite said.
        detail: String,
    },
}

/// What was meant, perhaps, by a name that nobody gave.
fn instead_of_tag(name: &str) -> String {
    match parse_moment(name) {
        Ok(_) => format!("a date or time is written @{name}"),
        Err(_) => "\"resurvey tag MAP\" lists the tags".to_owned(),
    }
}

/// What goes wrong inside the store, before the path is known.
#[derive(Debug)]
pub(super) enum Fault {
    Sql(rusqlite::Error),
    Damage(String),
    Store(StoreError),
}

impl From<rusqlite::Error> for Fault {
    fn from(error: rusqlite::Error) -> Self {
        Self::Sql(error)
    }
}

impl From<StoreError> for Fault {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl Fault {
    /// The error as the map at `path` reports it.
    pub(super) fn at(self, path: &Path) -> StoreError {
        let path = path.to_owned();
        match self {
            Self::Store(error) => error,
            Self::Damage(detail) => StoreError::Damaged { path, detail },
            Self::Sql(error) => sql_error(&error, path),
        }
    }
}

fn sql_error(error: &rusqlite::Error, path: PathBuf) -> StoreError {
    let detail = error.to_string();
    match error {
        rusqlite::Error::SqliteFailure(failure, _) => match failure.code {
            ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked => StoreError::Busy { path },
            ErrorCode::DatabaseCorrupt => StoreError::Damaged { path, detail },
            ErrorCode::NotADatabase => {
                StoreError::NotAMap { path, found: "another kind of file, or one that lost its header".to_owned() }
            }
            ErrorCode::ReadOnly => StoreError::ReadOnly { path },
            ErrorCode::DiskFull => StoreError::Full { path },
            ErrorCode::CannotOpen => {
                StoreError::NoWriteAheadLog { path, detail: format!("it cannot be made ({detail})") }
            }
            ErrorCode::SystemIoFailure => StoreError::Io { path, detail: refused_by_disk(failure.extended_code) },
            ErrorCode::PermissionDenied | ErrorCode::NoLargeFileSupport => StoreError::Io { path, detail },
            // "no such table", and vtab complaints about missing shadow rows.
            _ if detail.contains("no such") => StoreError::Damaged { path, detail },
            _ => StoreError::Internal { path, detail },
        },
        // Every statement is prepared by a test on a whole map: what it names is missing from this one.
        rusqlite::Error::SqlInputError { .. }
        | rusqlite::Error::FromSqlConversionFailure(..)
        | rusqlite::Error::IntegralValueOutOfRange(..)
        | rusqlite::Error::InvalidColumnType(..)
        | rusqlite::Error::Utf8Error(..)
        | rusqlite::Error::QueryReturnedNoRows => StoreError::Damaged { path, detail },
        _ => StoreError::Internal { path, detail },
    }
}

/// What the disk did not do, and what became of the map: of a version that is written when the disk fails, the log may
/// hold all or not.
fn refused_by_disk(extended_code: i32) -> String {
    let (refused, is_write) = match extended_code {
        ffi::SQLITE_IOERR_READ | ffi::SQLITE_IOERR_SHORT_READ => ("a read", false),
        ffi::SQLITE_IOERR_WRITE => ("a write", true),
        ffi::SQLITE_IOERR_FSYNC | ffi::SQLITE_IOERR_DIR_FSYNC => ("a sync", true),
        ffi::SQLITE_IOERR_TRUNCATE => ("to change the length of a file", true),
        ffi::SQLITE_IOERR_SHMSIZE | ffi::SQLITE_IOERR_SHMOPEN | ffi::SQLITE_IOERR_SHMMAP => {
            ("the shared memory beside the map", true)
        }
        _ => ("an operation", true),
    };
    let then = "; the map is whole, \"resurvey log\" says whether it has the new version";
    format!("disk I/O error {extended_code}: the disk refused {refused}{}", if is_write { then } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_that_fails_is_told_with_what_it_refused_and_where_to_look() {
        // The codes are SQLite's: https://sqlite.org/rescode.html.
        let said = |code| {
            let error = rusqlite::Error::SqliteFailure(ffi::Error::new(code), None);
            Fault::Sql(error).at(Path::new("city.rsv")).to_string()
        };
        assert_eq!(said(266), "city.rsv: disk I/O error 266: the disk refused a read");
        for (code, refused) in [(778, "a write"), (1034, "a sync"), (1546, "to change the length of a file")] {
            let words = format!("city.rsv: disk I/O error {code}: the disk refused {refused}; the map is whole, ");
            assert!(said(code).starts_with(&words) && said(code).contains("resurvey log"), "{}", said(code));
        }
    }
}
