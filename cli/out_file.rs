//! Files that users name for output: as they were or whole, and never a map.

use crate::console::Console;
use crate::failure::Failure;
use resurvey_schema::sql::APPLICATION_ID;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};

/// Refuses what could not be written later, before work is done for it. Nothing is left behind.
pub fn check_file(path: &Path) -> Result<(), Failure> {
    refuse_map(path)?;
    Staged::new(path, b"").map(drop).map_err(|error| named(path, &error))
}

/// Writes a file over one that is there, unless that is a map.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    write_files(&[(path, bytes)])
}

/// Writes files that belong together: none takes its place before all are on the disk.
pub fn write_files(files: &[(&Path, &[u8])]) -> Result<(), Failure> {
    let mut staged = Vec::new();
    for (path, bytes) in files {
        refuse_map(path)?;
        staged.push((path, Staged::new(path, bytes).map_err(|error| named(path, &error))?));
    }
    for (path, file) in staged {
        file.publish().map_err(|error| named(path, &error))?;
    }
    Ok(())
}

/// Makes the directory that the user named, unless it is there.
pub fn make_directory(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => Failure::input(format!("{}: expected a directory, found a file", path.display())),
        _ => named(path, &error),
    })
}

/// The code of a run whose result is told: a file that could not be written makes an error of 0 alone.
pub fn delivered(code: u8, written: Result<(), Failure>, console: &mut Console<'_>) -> Result<u8, Failure> {
    match written {
        Err(failure) if code == 0 => Err(failure),
        Err(failure) => {
            console.out().flush()?;
            console.message(&format!("resurvey: {failure}"));
            Ok(code)
        }
        Ok(()) => Ok(code),
    }
}

fn named(path: &Path, error: &io::Error) -> Failure {
    Failure::input(format!("{}: {error}", path.display()))
}

/// Nothing writes over a map, of whatever format and however damaged, nor over the log beside it.
fn refuse_map(path: &Path) -> Result<(), Failure> {
    let name = path.as_os_str().to_string_lossy();
    let of_map = ["-wal", "-shm", "-journal"].iter().find_map(|suffix| name.strip_suffix(suffix));
    let what = match of_map {
        _ if is_map(path) => "a map",
        Some(map) if is_map(Path::new(map)) => "a part of a map",
        _ => return Ok(()),
    };
    let text = format!("{}: expected a file to write, found {what}, which nothing writes over", path.display());
    Err(Failure::input(text))
}

/// Whether the header of a file says that it is a map.
fn is_map(path: &Path) -> bool {
    const ID: std::ops::Range<usize> = 68..72;
    let mut header = [0; 72];
    let is_file = fs::metadata(path).is_ok_and(|metadata| metadata.is_file());
    let read = is_file.then(|| File::open(path).and_then(|mut file| file.read_exact(&mut header)));
    matches!(read, Some(Ok(())))
        && header.starts_with(b"SQLite format 3\0")
        && header[ID] == APPLICATION_ID.to_be_bytes()
}

/// A file that is written and not yet in its place.
enum Staged<'b> {
    /// Beside the place, on the same disk.
    Beside(NamedTempFile, PathBuf),
    /// In the place itself: a device, a pipe, or a directory in which no other file can be made.
    InPlace(PathBuf, &'b [u8]),
}

impl<'b> Staged<'b> {
    fn new(path: &Path, bytes: &'b [u8]) -> io::Result<Self> {
        // Standard output by its name is not a file to replace, whatever it leads to.
        if ["/dev", "/proc"].iter().any(|system| path.starts_with(system)) {
            return Ok(Self::InPlace(path.to_owned(), bytes));
        }
        // A link stays one, and what it names is written.
        let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let there = match fs::metadata(&place) {
            Ok(there) if there.is_dir() => return Err(ErrorKind::IsADirectory.into()),
            Ok(there) if !there.is_file() => return Ok(Self::InPlace(place, bytes)),
            Ok(there) => {
                // Who may not write to the file may not replace it either.
                OpenOptions::new().write(true).open(&place)?;
                Some(there)
            }
            Err(_) => None,
        };
        let directory = place.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // What is wrong with the directory is said in the system's words.
        fs::metadata(directory)?;
        match beside(directory, there.as_ref(), bytes) {
            Ok(file) => Ok(Self::Beside(file, place)),
            Err(error) if error.kind() == ErrorKind::PermissionDenied && there.is_some() => {
                Ok(Self::InPlace(place, bytes))
            }
            Err(error) => Err(error),
        }
    }

    fn publish(self) -> io::Result<()> {
        match self {
            Self::Beside(file, place) => file.persist(place).map(drop).map_err(|failed| failed.error),
            Self::InPlace(place, bytes) => fs::write(place, bytes),
        }
    }
}

/// A new file in `directory` with `bytes`, as open to others as the one that it replaces, or as any new one.
fn beside(directory: &Path, replaced: Option<&fs::Metadata>, bytes: &[u8]) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".resurvey-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    // The error would name a file that nobody asked for.
    let mut file = builder.tempfile_in(directory).map_err(|error| io::Error::from(error.kind()))?;
    file.write_all(bytes)?;
    if let Some(replaced) = replaced {
        file.as_file().set_permissions(replaced.permissions())?;
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_belong_together_are_replaced_together_or_not_at_all() {
        let directory = tempfile::tempdir().unwrap();
        let [first, second] = ["first", "second"].map(|name| directory.path().join(name));
        fs::write(&first, "old").unwrap();
        fs::create_dir(&second).unwrap();
        let refused = write_files(&[(&first, b"new"), (&second, b"new")]).unwrap_err();
        assert!(refused.to_string().contains("second: "), "{refused}");
        assert_eq!(fs::read(&first).unwrap(), b"old");
        fs::remove_dir(&second).unwrap();
        write_files(&[(&first, b"new"), (&second, b"new")]).unwrap();
        assert_eq!((fs::read(&first).unwrap(), fs::read(&second).unwrap()), (b"new".to_vec(), b"new".to_vec()));
        // Nothing else is left beside them.
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_modes_stay_and_devices_are_written_to() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let directory = tempfile::tempdir().unwrap();
        let [file, link] = ["file", "link"].map(|name| directory.path().join(name));
        fs::write(&file, "old").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        symlink(&file, &link).unwrap();
        write_file(&link, b"new").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        write_file(Path::new("/dev/null"), b"new").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
        check_file(Path::new("/dev/null")).unwrap();
        assert!(check_file(&directory.path().join("no/such")).is_err());
    }
}
