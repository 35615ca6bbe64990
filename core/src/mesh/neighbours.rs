//! Files that a model names: textures and buffers beside it.

use super::ImportError;
use std::path::{Component, Path, PathBuf};

/// Largest file that is read whole.
const MAX_FILE_BYTES: u64 = 1 << 31;

/// The folder of a model file.
#[derive(Clone, Debug)]
pub(super) struct Neighbours {
    folder: PathBuf,
}

impl Neighbours {
    /// The folder that holds `model`.
    pub fn of(model: &Path) -> Self {
        Self { folder: model.parent().map_or_else(PathBuf::new, Path::to_owned) }
    }

    /// The content of the file that the model calls `name`: the relative path as it stands, else its last part in the
    /// model's folder without regard to case, as files written on Windows need. Backslashes separate folders, too.
    pub fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        let name = name.replace('\\', "/");
        let relative = Path::new(&name);
        let stays_below = relative.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
        let exact = self.folder.join(relative);
        let path = if stays_below && exact.is_file() { Some(exact) } else { self.ignoring_case(relative) };
        let path = path.ok_or_else(|| format!("there is no such file in {}", self.shown()))?;
        read_file(&path).map_err(|error| error.to_string())
    }

    fn ignoring_case(&self, relative: &Path) -> Option<PathBuf> {
        let wanted = relative.file_name()?.to_string_lossy().to_lowercase();
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let mut found: Vec<PathBuf> = std::fs::read_dir(folder)
            .ok()?
            .filter_map(Result::ok)
            .filter(|entry| entry.file_name().to_string_lossy().to_lowercase() == wanted)
            .map(|entry| entry.path())
            .filter(|path| path.is_file())
            .collect();
        found.sort();
        found.into_iter().next()
    }

    fn shown(&self) -> String {
        if self.folder.as_os_str().is_empty() {
            "the model's folder".to_owned()
        } else {
            self.folder.display().to_string()
        }
    }
}

/// The content of `path`; refuses what is too large to be a model.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, ImportError> {
    let io = |source| ImportError::Io { path: path.to_owned(), source };
    let bytes = std::fs::metadata(path).map_err(io)?.len();
    if bytes > MAX_FILE_BYTES {
        return Err(ImportError::FileTooLarge { path: path.to_owned(), bytes, limit: MAX_FILE_BYTES });
    }
    std::fs::read(path).map_err(io)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_without_regard_to_case_and_folders_of_another_machine() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("maps")).unwrap();
        std::fs::write(folder.path().join("Wall.png"), b"1").unwrap();
        std::fs::write(folder.path().join("maps/roof.png"), b"2").unwrap();
        let neighbours = Neighbours::of(&folder.path().join("model.3ds"));
        assert_eq!(neighbours.read("WALL.PNG").unwrap(), b"1");
        assert_eq!(neighbours.read("C:\\models\\wall.png").unwrap(), b"1");
        assert_eq!(neighbours.read("maps/roof.png").unwrap(), b"2");
        assert!(neighbours.read("door.png").unwrap_err().contains("no such file"));
        assert!(neighbours.read("..").is_err() && neighbours.read("").is_err());
    }

    #[test]
    fn a_name_that_leaves_the_folder_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("model");
        std::fs::create_dir(&inner).unwrap();
        std::fs::write(folder.path().join("secret.png"), b"1").unwrap();
        let neighbours = Neighbours::of(&inner.join("model.3ds"));
        assert!(neighbours.read("../secret.png").is_err());
        assert!(neighbours.read(folder.path().join("secret.png").to_str().unwrap()).is_err());
    }
}
