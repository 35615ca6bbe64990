//! Making and opening a map file.

use super::commit_error::CommitError;
use super::error::{Fault, StoreError};
use super::index::{build_beside, rebuild};
use super::rows::{VersionRow, check_classes, insert_classes};
use crate::version::{Counts, Frame, Operations, VersionId, VersionKind, VersionRecord, version_hash};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use resurvey_schema::sql::{APPLICATION_ID, MIGRATIONS};
use rusqlite::config::DbConfig;
use rusqlite::{Connection, OpenFlags, Transaction, TransactionBehavior, named_params};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Value of `format` in the table `meta`.
pub(super) const FORMAT: &str = "resurvey.map/1";
/// The first format whose index this program reads.
const INDEX_FORMAT: usize = 3;
/// How long a writer waits for another.
const BUSY_TIMEOUT: Duration = Duration::from_secs(5);
/// Page cache of a connection, KiB.
const CACHE_KIB: i64 = 65_536;

/// An open map. It is one connection: open the file again for another thread.
#[derive(Debug)]
pub struct MapFile {
    pub(super) connection: Connection,
    pub(super) path: PathBuf,
    writable: bool,
}

/// What a new map is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct NewMap {
    /// Names the map among all maps; unique, for example a UUID.
    pub map_id: String,
    /// Horizontal system and vertical datum.
    pub frame: Frame,
    /// Its classes.
    pub classes: ClassTable,
    /// Who makes it.
    pub author: String,
    /// What for.
    pub message: String,
}

/// What a map says about itself.
#[derive(Clone, Debug, PartialEq)]
pub struct MapInfo {
    /// Names the map among all maps.
    pub map_id: String,
    /// Horizontal system and vertical datum.
    pub frame: Frame,
    /// When it was made.
    pub created_at: Timestamp,
    /// Number of the file format.
    pub format: i32,
}

impl MapFile {
    /// Makes a map with version 0, which holds nothing, in a new file.
    pub fn create(path: &Path, new: &NewMap, now: Timestamp) -> Result<Self, StoreError> {
        check_classes(&new.classes)?;
        match OpenOptions::new().write(true).create_new(true).open(path) {
            Ok(_) => {}
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                return Err(StoreError::Exists { path: path.to_owned() });
            }
            Err(error) => return Err(StoreError::Io { path: path.to_owned(), detail: error.to_string() }),
        }
        let made = Self::connect(path, OpenFlags::SQLITE_OPEN_READ_WRITE)
            .map_err(|fault| fault.at(path))
            .and_then(|map| map.write(|connection| fill(connection, new, now)).map(|()| map))
            .and_then(|map| map.use_write_ahead_log().map(|()| map));
        if made.is_err() {
            // The file is ours: create_new made it. Nothing of use is in it.
            let _ = fs::remove_file(path);
        }
        made
    }

    /// Opens a map to read and write.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        inspect(path)?;
        if is_marked_read_only(path) {
            return Err(StoreError::ReadOnly { path: path.to_owned() });
        }
        let map = Self::connect(path, OpenFlags::SQLITE_OPEN_READ_WRITE).map_err(|fault| fault.at(path))?;
        let format = map.check_format()?;
        if map.connection.is_readonly(rusqlite::MAIN_DB).unwrap_or(true) {
            return Err(StoreError::ReadOnly { path: path.to_owned() });
        }
        map.use_write_ahead_log()?;
        if (format as usize) < MIGRATIONS.len() {
            map.write(migrate)?;
        }
        Ok(map)
    }

    /// Opens a map to read; also from a medium or directory that cannot be written.
    pub fn open_read_only(path: &Path) -> Result<Self, StoreError> {
        inspect(path)?;
        let try_open = |immutable: bool| -> Result<Self, StoreError> {
            let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
            let map = if immutable {
                Self::connect_to(path, immutable_uri(path), flags)
            } else {
                Self::connect(path, OpenFlags::SQLITE_OPEN_READ_ONLY)
            };
            let map = map.map_err(|fault| fault.at(path))?;
            if (map.check_format()? as usize) < INDEX_FORMAT {
                map.outside(|connection| Ok(connection.pragma_update(None, "temp_store", "MEMORY")?))?;
                map.read(build_beside)?;
            }
            Ok(map)
        };
        // Reading a file with a write-ahead log needs a shared-memory file beside it, unless nobody can write.
        let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if is_marked_read_only(directory) && !has_write_ahead_log(path) {
            return try_open(true);
        }
        match try_open(false) {
            Err(StoreError::NoWriteAheadLog { .. } | StoreError::ReadOnly { .. }) if !has_write_ahead_log(path) => {
                try_open(true)
            }
            other => other,
        }
    }

    /// Waits this long for another writer instead of five seconds.
    pub fn set_busy_timeout(&self, timeout: Duration) -> Result<(), StoreError> {
        self.connection.busy_timeout(timeout).map_err(|error| Fault::Sql(error).at(&self.path))
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What the map says about itself.
    pub fn info(&self) -> Result<MapInfo, StoreError> {
        const SQL: &str = "SELECT map_id, crs, vertical_datum, created_at FROM meta ORDER BY only_row";
        let format = self.check_format()?;
        self.read(|connection| {
            let info = connection.query_row(SQL, [], |row| {
                let frame = Frame { crs: row.get("crs")?, vertical_datum: row.get("vertical_datum")? };
                Ok((row.get("map_id")?, frame, row.get("created_at")?))
            })?;
            let (map_id, frame, created_at) = info;
            Ok(MapInfo { map_id, frame, created_at: super::rows::timestamp(created_at)?, format })
        })
    }

    /// Runs `work`, which reads one state of the file whatever is committed meanwhile, and says where it failed: in the
    /// transaction that is under way, or in one of its own.
    pub(super) fn read<T>(&self, work: impl FnOnce(&Connection) -> Result<T, Fault>) -> Result<T, StoreError> {
        self.outside(|connection| {
            if !connection.is_autocommit() {
                return work(connection);
            }
            let frozen = Transaction::new_unchecked(connection, TransactionBehavior::Deferred)?;
            let found = work(&frozen)?;
            frozen.commit()?;
            Ok(found)
        })
    }

    /// Runs `work` in no transaction, and says where it failed.
    pub(super) fn outside<T>(&self, work: impl FnOnce(&Connection) -> Result<T, Fault>) -> Result<T, StoreError> {
        work(&self.connection).map_err(|fault| fault.at(&self.path))
    }

    /// Runs `work` in one immediate transaction: all of it or nothing.
    ///
    /// Immediate, because a reading transaction that wants to write later is refused at once when another writer was
    /// faster, whatever the busy timeout.
    pub(super) fn write<T, E: From<StoreError>>(
        &self,
        work: impl FnOnce(&Connection) -> Result<T, WriteFault<E>>,
    ) -> Result<T, E> {
        let at = |fault: Fault| E::from(fault.at(&self.path));
        if !self.writable {
            return Err(StoreError::ReadOnly { path: self.path.clone() }.into());
        }
        let begin = Transaction::new_unchecked(&self.connection, TransactionBehavior::Immediate);
        let transaction = begin.map_err(|error| at(error.into()))?;
        match work(&transaction) {
            Ok(value) => transaction.commit().map(|()| value).map_err(|error| at(error.into())),
            Err(WriteFault::Fault(fault)) => Err(at(fault)),
            Err(WriteFault::Refused(error)) => Err(error),
        }
    }

    fn connect(path: &Path, flags: OpenFlags) -> Result<Self, Fault> {
        // SQLite takes what starts like this for a URI.
        match path.to_str().filter(|text| text.starts_with("file:")) {
            Some(text) => Self::connect_to(path, format!("./{text}"), flags),
            None => Self::connect_to(path, path, flags),
        }
    }

    fn connect_to(path: &Path, target: impl AsRef<Path>, flags: OpenFlags) -> Result<Self, Fault> {
        let connection = Connection::open_with_flags(target, flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)?;
        connection.busy_timeout(BUSY_TIMEOUT)?;
        connection.set_prepared_statement_cache_capacity(64);
        connection.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
        // A transaction is in memory anyway; pages that leave the cache before its end would be written many times.
        let pragmas = [
            ("foreign_keys", 1),
            ("cell_size_check", 1),
            ("trusted_schema", 0),
            ("cache_size", -CACHE_KIB),
            ("cache_spill", 0),
        ];
        for (pragma, value) in pragmas {
            connection.pragma_update(None, pragma, value)?;
        }
        connection.pragma_update(None, "synchronous", "FULL")?;
        let writable = flags.contains(OpenFlags::SQLITE_OPEN_READ_WRITE);
        Ok(Self { connection, path: path.to_owned(), writable })
    }

    fn use_write_ahead_log(&self) -> Result<(), StoreError> {
        let set = |connection: &Connection| -> Result<String, Fault> {
            Ok(connection.pragma_update_and_check(None, "journal_mode", "WAL", |row| row.get(0))?)
        };
        match self.outside(set)?.as_str() {
            "wal" => Ok(()),
            mode => Err(StoreError::NoWriteAheadLog {
                path: self.path.clone(),
                detail: format!("the file system allows only journal mode {mode:?}"),
            }),
        }
    }

    /// The number of the format, when this program can read it.
    fn check_format(&self) -> Result<i32, StoreError> {
        let pragma = |name| self.outside(|connection| Ok(connection.pragma_query_value(None, name, |row| row.get(0))?));
        let path = || self.path.clone();
        let application: i32 = pragma("application_id")?;
        if application != APPLICATION_ID {
            let found = format!("a SQLite database of another program (application id {application})");
            return Err(StoreError::NotAMap { path: path(), found });
        }
        let (found, supported): (i32, i32) = (pragma("user_version")?, MIGRATIONS.len() as i32);
        match found {
            ..=0 => Err(StoreError::Damaged { path: path(), detail: format!("it says that its format is {found}") }),
            _ if found > supported => Err(StoreError::NewerFormat { path: path(), found, supported }),
            _ => Ok(found),
        }
    }
}

/// How work inside a transaction ends badly: the store failed, or it refused with a reason of its own.
pub(super) enum WriteFault<E> {
    Fault(Fault),
    Refused(E),
}

impl<E, F: Into<Fault>> From<F> for WriteFault<E> {
    fn from(fault: F) -> Self {
        Self::Fault(fault.into())
    }
}

impl From<CommitError> for WriteFault<CommitError> {
    fn from(error: CommitError) -> Self {
        Self::Refused(error)
    }
}

/// The number of migrations that the file has had.
pub(super) fn format_of(connection: &Connection) -> Result<usize, Fault> {
    let format: i32 = connection.pragma_query_value(None, "user_version", |row| row.get(0))?;
    Ok(format.max(0) as usize)
}

/// Applies the migrations that the file has not had.
fn migrate(connection: &Connection) -> Result<(), WriteFault<StoreError>> {
    let format = format_of(connection)?;
    for migration in MIGRATIONS.iter().skip(format) {
        connection.execute_batch(migration)?;
    }
    if format < INDEX_FORMAT {
        rebuild(connection, BTreeMap::new())?;
    }
    connection.pragma_update(None, "user_version", MIGRATIONS.len() as i32)?;
    Ok(())
}

fn fill(connection: &Connection, new: &NewMap, now: Timestamp) -> Result<(), WriteFault<StoreError>> {
    const SQL: &str = "INSERT INTO meta (only_row, format, map_id, crs, vertical_datum, created_at)
        VALUES (1, :format, :map_id, :crs, :vertical_datum, :created_at)";
    migrate(connection)?;
    let Frame { crs, vertical_datum } = &new.frame;
    connection.execute(
        SQL,
        named_params! {
            ":format": FORMAT, ":map_id": new.map_id, ":crs": crs, ":vertical_datum": vertical_datum,
            ":created_at": now.as_microsecond(),
        },
    )?;
    let record = first_version(new, now);
    VersionRow::insert(connection, &record)?;
    insert_classes(connection, record.version, &new.classes)?;
    Ok(())
}

/// The record of the empty map.
pub(super) fn first_version(new: &NewMap, now: Timestamp) -> VersionRecord {
    let operations = Operations::start(Some(&new.frame), Some(&new.classes), 0).finish();
    VersionRecord {
        version: VersionId(0),
        kind: VersionKind::Init,
        committed_at: now,
        observed_at: None,
        author: new.author.clone(),
        message: new.message.clone(),
        base: None,
        reverts: None,
        counts: Counts::default(),
        envelope: None,
        idempotency_key: None,
        evidence: None,
        hash: version_hash(None, operations, None),
    }
}

/// Refuses what is plainly not a map before SQLite sees it.
fn inspect(path: &Path) -> Result<(), StoreError> {
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
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEADER_BYTES).read_to_end(&mut start));
    read.map_err(|error| io_error(path, &error))?;
    if !start.starts_with(MAGIC) {
        return Err(not_a_map("another kind of file"));
    }
    // A crash while the log is written back may leave part of a page, which the log then mends.
    let page_bytes = start.get(16..18).map_or(0, |size| u64::from(u16::from_be_bytes([size[0], size[1]])));
    let is_cut = page_bytes > 1 && metadata.len() % page_bytes != 0 && !has_write_ahead_log(path);
    if metadata.len() < HEADER_BYTES || is_cut {
        let detail = format!("it ends after {} bytes", metadata.len());
        return Err(StoreError::Damaged { path: path.to_owned(), detail });
    }
    Ok(())
}

fn io_error(path: &Path, error: &std::io::Error) -> StoreError {
    match error.kind() {
        std::io::ErrorKind::NotFound => StoreError::NotFound { path: path.to_owned() },
        _ => StoreError::Io { path: path.to_owned(), detail: error.to_string() },
    }
}

/// Whether the marks on the file forbid writing, also to a user who could write all the same.
fn is_marked_read_only(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| metadata.permissions().readonly())
}

fn has_write_ahead_log(path: &Path) -> bool {
    let mut log = path.as_os_str().to_owned();
    log.push("-wal");
    fs::metadata(log).is_ok_and(|metadata| metadata.len() > 0)
}

/// A URI that tells SQLite that nobody writes to the file.
fn immutable_uri(path: &Path) -> String {
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
