//! What tells that a file is still the one that was read, without reading it again.

use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// File system, file, length, and when its contents or its mode last changed, which nobody can set back.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super) struct Fingerprint(String);

impl Fingerprint {
    /// That of the file at `path`.
    pub(in super::super) fn of(path: &Path) -> io::Result<Self> {
        let file = std::fs::metadata(path)?;
        let (seconds, nanoseconds) = (file.ctime(), file.ctime_nsec());
        Ok(Self(format!("{}-{}-{}-{seconds}.{nanoseconds}", file.dev(), file.ino(), file.size())))
    }

    /// As an argument of a program.
    pub(super) fn as_str(&self) -> &str {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_the_same_length_in_its_place_is_another() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("plugin");
        std::fs::write(&path, "one").unwrap();
        let first = Fingerprint::of(&path).unwrap();
        assert_eq!(Fingerprint::of(&path).unwrap(), first);
        std::fs::write(directory.path().join("other"), "two").unwrap();
        std::fs::rename(directory.path().join("other"), &path).unwrap();
        assert_ne!(Fingerprint::of(&path).unwrap(), first);
    }
}
