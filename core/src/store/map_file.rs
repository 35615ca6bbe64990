//! Making and opening a map file.

use super::beside::Beside;
use super::commit_error::CommitError;
use super::error::{Fault, StoreError};
use super::migrate::migrate;
use super::on_disk::{
    Stamp, beside, has_right_to_write, has_write_ahead_log, immutable_uri, inspect, is_marked_read_only, may_write,
    unless_cut,
};
use super::rows::{VersionRow, check_classes, head, insert_classes};
use super::seal;
use super::turn::{Turn, Turns};
use crate::version::{Counts, Frame, Operations, VersionId, VersionKind, VersionRecord, version_hash};
use jiff::Timestamp;
use resurvey_schema::ClassTable;
use resurvey_schema::sql::{APPLICATION_ID, MIGRATIONS};
use rusqlite::config::DbConfig;
use rusqlite::{Connection, OpenFlags, Transaction, TransactionBehavior, named_params};
use std::cell::{Cell, OnceCell};
use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Value of `format` in the table `meta`.
pub(super) const FORMAT: &str = "resurvey.map/1";
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
    /// Of a map that was opened as one that nobody writes.
    frozen: Option<Stamp>,
    beside: Cell<Beside>,
    /// Of a map that is open to write and has a write-ahead log.
    turns: OnceCell<Turns>,
    patience: Cell<Duration>,
}

/// How a map is opened that is only read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reading {
    /// As by who writes.
    Writable,
    /// With the locks of SQLite.
    Locked,
    /// As if nobody wrote.
    Frozen,
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
            .and_then(|map| map.transact(|connection| fill(connection, new, now)).map(|()| map))
            .and_then(|map| map.begin_write_ahead_log().map(|()| map));
        if made.is_err() {
            // The file is ours: create_new made it. Nothing of use is in it.
            let _ = fs::remove_file(path);
        }
        made
    }

    /// Opens a map to read and write. One of an older format is migrated with the first change that is written.
    pub fn open(path: &Path) -> Result<Self, StoreError> {
        inspect(path)?;
        if is_marked_read_only(path) {
            return Err(StoreError::ReadOnly { path: path.to_owned() });
        }
        for file in ["-wal", "-shm"].map(|suffix| beside(path, suffix)) {
            if file.exists() && !has_right_to_write(&file) {
                return Err(StoreError::ReadOnly { path: file });
            }
        }
        let map = Self::connect(path, OpenFlags::SQLITE_OPEN_READ_WRITE).map_err(|fault| fault.at(path));
        let map = unless_cut(path, map)?;
        map.beside.set(Beside::for_format(map.check_format()? as usize));
        if map.connection.is_readonly(rusqlite::MAIN_DB).unwrap_or(true) {
            return Err(StoreError::ReadOnly { path: path.to_owned() });
        }
        // What keeps the file from being read is said here.
        map.read(head)?;
        Ok(map)
    }

    /// Opens a map to read; also from a medium or directory that cannot be written. There a read is refused when somebody
    /// else has written meanwhile.
    pub fn open_read_only(path: &Path) -> Result<Self, StoreError> {
        inspect(path)?;
        // Who reads a file with a write-ahead log needs files beside it. Where this user may not write they are left to
        // those who may: files of another user would lock them out.
        let may_write = may_write(path);
        if !may_write && !has_write_ahead_log(path) && !beside(path, "-shm").exists() {
            return Self::open_to_read(path, Reading::Frozen);
        }
        // Only a connection that could write takes those files away again. A log that somebody has left is for a writer to
        // put into the file.
        let reading = if may_write && !has_write_ahead_log(path) { Reading::Writable } else { Reading::Locked };
        match Self::open_to_read(path, reading) {
            Err(StoreError::NoWriteAheadLog { .. } | StoreError::ReadOnly { .. }) if !has_write_ahead_log(path) => {
                Self::open_to_read(path, Reading::Frozen)
            }
            other => other,
        }
    }

    fn open_to_read(path: &Path, reading: Reading) -> Result<Self, StoreError> {
        let stamp = Stamp::of(path);
        let map = match reading {
            Reading::Writable => Self::connect(path, OpenFlags::SQLITE_OPEN_READ_WRITE),
            Reading::Locked => Self::connect(path, OpenFlags::SQLITE_OPEN_READ_ONLY),
            Reading::Frozen => {
                let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
                Self::connect_to(path, immutable_uri(path), flags)
            }
        };
        let mut map = unless_cut(path, map.map_err(|fault| fault.at(path)))?;
        map.writable = false;
        map.frozen = (reading == Reading::Frozen).then_some(stamp);
        map.beside.set(Beside::for_format(map.check_format()? as usize));
        // What keeps the file from being read is said here.
        map.read(|_| Ok(()))?;
        Ok(map)
    }

    /// Waits this long for another writer instead of five seconds.
    pub fn set_busy_timeout(&self, timeout: Duration) -> Result<(), StoreError> {
        self.patience.set(timeout);
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
        let found = self.outside(|connection| {
            if !connection.is_autocommit() {
                return work(connection);
            }
            let frozen = Transaction::new_unchecked(connection, TransactionBehavior::Deferred)?;
            let beside = self.beside.get().refreshed(&frozen)?;
            let found = work(&frozen)?;
            frozen.commit()?;
            self.beside.set(beside);
            Ok(found)
        });
        match &self.frozen {
            // Pages of two versions may have been read, and look like an answer or like damage.
            Some(stamp) if !stamp.is_still(&self.path) => Err(StoreError::WrittenMeanwhile { path: self.path.clone() }),
            _ => found,
        }
    }

    /// Runs `work` in no transaction, and says where it failed.
    pub(super) fn outside<T>(&self, work: impl FnOnce(&Connection) -> Result<T, Fault>) -> Result<T, StoreError> {
        work(&self.connection).map_err(|fault| fault.at(&self.path))
    }

    /// Runs `work`, in which reads and writes are one transaction: all of it or nothing, and nobody else writes meanwhile.
    pub fn together<T, E: From<StoreError>>(&self, work: impl FnOnce(&Self) -> Result<T, E>) -> Result<T, E> {
        self.write(|_| work(self).map_err(WriteFault::Refused))
    }

    /// Runs `work` on the map in the newest format, in one immediate transaction or as a part of the one that is under way:
    /// all of it or nothing. Until something is written the file keeps every byte.
    pub(super) fn write<T, E: From<StoreError>>(
        &self,
        work: impl FnOnce(&Connection) -> Result<T, WriteFault<E>>,
    ) -> Result<T, E> {
        if !self.writable {
            return Err(StoreError::ReadOnly { path: self.path.clone() }.into());
        }
        if !self.connection.is_autocommit() {
            return self.part(work);
        }
        let done = self.transact(|connection| {
            self.bring_up_to_date(connection).map_err(|error| WriteFault::Refused(error.into()))?;
            work(connection)
        })?;
        self.beside.set(Beside::NotNeeded);
        if self.turns.get().is_none() {
            // A copy that another program made may have another journal. What is written is safe in that too, and readers
            // do not wait for the next.
            let _ = self.begin_write_ahead_log();
        }
        Ok(done)
    }

    /// Runs `work` as a part of the transaction that is under way.
    fn part<T, E: From<StoreError>>(&self, work: impl FnOnce(&Connection) -> Result<T, WriteFault<E>>) -> Result<T, E> {
        let run = |sql: &str| self.connection.execute_batch(sql).map_err(|error| Fault::Sql(error).at(&self.path));
        run("SAVEPOINT part")?;
        let done = work(&self.connection);
        run(if done.is_ok() { "RELEASE part" } else { "ROLLBACK TO part; RELEASE part" })?;
        done.map_err(|fault| fault.at(&self.path))
    }

    /// Migrates a map of an older format; refuses one that a newer program has migrated since it was opened.
    fn bring_up_to_date(&self, connection: &Connection) -> Result<(), StoreError> {
        let format = self.check_format()? as usize;
        let migrated = self
            .beside
            .get()
            .ended(connection)
            .and_then(|_| if format < MIGRATIONS.len() { migrate(connection) } else { Ok(()) });
        migrated.map_err(|fault| fault.at(&self.path))
    }

    /// Runs `work` in one immediate transaction, when it is this writer's turn.
    ///
    /// Immediate, because a reading transaction that wants to write later is refused at once when another writer was
    /// faster, whatever the busy timeout.
    fn transact<T, E: From<StoreError>>(
        &self,
        work: impl FnOnce(&Connection) -> Result<T, WriteFault<E>>,
    ) -> Result<T, E> {
        let at = |error: rusqlite::Error| E::from(Fault::Sql(error).at(&self.path));
        let (_turn, transaction) = loop {
            let turn = self.take_turn()?;
            let begin = Transaction::new_unchecked(&self.connection, TransactionBehavior::Immediate);
            let transaction = begin.map_err(at)?;
            // Another writer may have begun a log since.
            if turn.is_some() || !self.has_log()? {
                break (turn, transaction);
            }
        };
        let value = work(&transaction).map_err(|fault| fault.at(&self.path))?;
        transaction.commit().map(|()| value).map_err(at)
    }

    /// Waits until no other writer is under way; a map without a write-ahead log has none.
    pub(super) fn take_turn(&self) -> Result<Option<Turn<'_>>, StoreError> {
        if self.turns.get().is_none() && self.writable && self.read(head).is_ok() && self.has_log()? {
            self.find_turns()?;
        }
        let Some(turns) = self.turns.get() else { return Ok(None) };
        let path = || self.path.clone();
        match turns.take(self.patience.get()) {
            Ok(Some(turn)) => Ok(Some(turn)),
            Ok(None) => Err(StoreError::Busy { path: path() }),
            Err(error) => Err(StoreError::Io { path: path(), detail: format!("its log cannot be locked: {error}") }),
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
        let connection = Connection::open_with_flags(target, flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)
            .map_err(|error| StoreError::Io { path: path.to_owned(), detail: error.to_string() })?;
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
        connection.pragma_update(None, "temp_store", "MEMORY")?;
        let writable = flags.contains(OpenFlags::SQLITE_OPEN_READ_WRITE);
        Ok(Self {
            connection,
            path: path.to_owned(),
            writable,
            frozen: None,
            beside: Cell::new(Beside::NotNeeded),
            turns: OnceCell::new(),
            patience: Cell::new(BUSY_TIMEOUT),
        })
    }

    fn begin_write_ahead_log(&self) -> Result<(), StoreError> {
        let set = |connection: &Connection| -> Result<String, Fault> {
            Ok(connection.pragma_update_and_check(None, "journal_mode", "WAL", |row| row.get(0))?)
        };
        match self.outside(set)?.as_str() {
            "wal" => {
                // The first read opens the log.
                self.read(head)?;
                if cfg!(unix) { self.find_turns() } else { Ok(()) }
            }
            mode => Err(StoreError::NoWriteAheadLog {
                path: self.path.clone(),
                detail: format!("the file system allows only journal mode {mode:?}"),
            }),
        }
    }

    /// Whether the map has a write-ahead log, as its last transaction found it.
    fn has_log(&self) -> Result<bool, StoreError> {
        self.outside(|connection| {
            let mode: String = connection.pragma_query_value(None, "journal_mode", |row| row.get(0))?;
            // A locked file of Windows cannot be read by others.
            Ok(cfg!(unix) && mode == "wal")
        })
    }

    fn find_turns(&self) -> Result<(), StoreError> {
        let turns = Turns::of(&self.path).map_err(|fault| fault.at(&self.path))?;
        // It is set once; the lock is the same in both.
        let _ = self.turns.set(turns);
        Ok(())
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

impl<E: From<StoreError>> WriteFault<E> {
    fn at(self, path: &Path) -> E {
        match self {
            Self::Fault(fault) => fault.at(path).into(),
            Self::Refused(error) => error,
        }
    }
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
    seal::META.seal(connection, &1)?;
    let record = first_version(new, now);
    VersionRow::insert(connection, &record, None)?;
    seal::VERSION.seal(connection, &0)?;
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
        counts: Some(Counts::default()),
        envelope: None,
        idempotency_key: None,
        evidence: None,
        hash: version_hash(None, operations, None),
    }
}
