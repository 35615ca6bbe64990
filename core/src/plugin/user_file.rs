//! Small files of the user that several processes of this program change: lines of text, one writer at a time.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// The lines of the file at `path`; none where there is no file.
pub fn read_lines(path: &Path) -> io::Result<Vec<String>> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(text.lines().map(str::to_owned).collect()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}

/// Reads the lines, lets `edit` change them and writes them back, while every other process that edits waits. Who reads
/// meanwhile sees the old lines or the new ones. The directory is made where it is missing.
pub fn edit_lines<T>(path: &Path, edit: impl FnOnce(&mut Vec<String>) -> T) -> io::Result<T> {
    if let Some(directory) = path.parent() {
        std::fs::create_dir_all(directory)?;
    }
    // A file of its own: the lines themselves get another file with every change.
    let lock = File::create(path.with_extension("lock"))?;
    lock.lock()?;
    let before = read_lines(path)?;
    let mut lines = before.clone();
    let outcome = edit(&mut lines);
    if lines != before {
        write_lines(path, &lines)?;
    }
    Ok(outcome)
}

fn write_lines(path: &Path, lines: &[String]) -> io::Result<()> {
    let beside = path.with_extension("new");
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(&beside)?;
    file.write_all(lines.iter().map(|line| format!("{line}\n")).collect::<String>().as_bytes())?;
    file.sync_all()?;
    std::fs::rename(&beside, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_many_add_at_once_is_all_there() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("data/list");
        std::thread::scope(|scope| {
            for writer in 0..8 {
                let path = &path;
                scope.spawn(move || {
                    for line in 0..20 {
                        edit_lines(path, |lines| lines.push(format!("{writer} {line}"))).unwrap();
                    }
                });
            }
        });
        let mut lines = read_lines(&path).unwrap();
        lines.sort();
        lines.dedup();
        assert_eq!(lines.len(), 160);
    }

    #[test]
    fn a_file_that_cannot_be_read_is_not_an_empty_one() {
        let directory = tempfile::tempdir().unwrap();
        assert_eq!(read_lines(&directory.path().join("none")).unwrap(), Vec::<String>::new());
        let path = directory.path().join("bytes");
        std::fs::write(&path, b"\xff\n").unwrap();
        assert!(read_lines(&path).is_err());
        assert!(edit_lines(&path, Vec::clear).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"\xff\n");
    }
}
