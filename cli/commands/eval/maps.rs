//! The maps of a run: each scene's is built once, in a temporary directory; what changes is a copy.

use crate::commands::import::add_object;
use crate::failure::{Failure, INTERNAL};
use jiff::Timestamp;
use resurvey_core::crs::Crs;
use resurvey_core::mesh::{ImportOptions, import_model};
use resurvey_core::store::{History, MapFile, NewMap};
use resurvey_core::version::{Frame, UpdateTransaction, VersionKind, read_change_set};
use resurvey_schema::{ClassTable, GridPoint};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use tempfile::TempDir;

/// Where temporary maps come from.
pub struct Maps {
    directory: TempDir,
    /// Map file by directory of the scene.
    scenes: BTreeMap<PathBuf, PathBuf>,
    /// Copies so far, each with a name of its own.
    copies: AtomicUsize,
}

#[derive(Deserialize)]
struct MapJson {
    origin: GridPoint,
}

impl Maps {
    /// None yet.
    pub fn new() -> Result<Self, Failure> {
        let directory = tempfile::tempdir()
            .map_err(|error| Failure::new(INTERNAL, anyhow::anyhow!("a temporary directory: {error}")))?;
        Ok(Self { directory, scenes: BTreeMap::new(), copies: AtomicUsize::new(0) })
    }

    /// Builds the map of `scene`, unless it is there.
    pub fn prepare(&mut self, scene: &Path) -> Result<(), Failure> {
        if !self.scenes.contains_key(scene) {
            let path = self.directory.path().join(format!("scene-{}.rsv", self.scenes.len()));
            build(scene, &path)?;
            self.scenes.insert(scene.to_owned(), path);
        }
        Ok(())
    }

    /// A copy of the map of `scene`, which was prepared.
    pub fn of_scene(&self, scene: &Path) -> Result<Copy, Failure> {
        let path = self.scenes.get(scene).ok_or_else(|| {
            Failure::new(INTERNAL, anyhow::anyhow!("{}: expected a map that was prepared", scene.display()))
        })?;
        self.copy(path)
    }

    /// A copy of `map` of its own, which goes when it is dropped.
    pub fn copy(&self, map: &Path) -> Result<Copy, Failure> {
        let number = self.copies.fetch_add(1, Ordering::Relaxed);
        let path = self.directory.path().join(format!("copy-{number}.rsv"));
        std::fs::copy(map, &path).map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
        Ok(Copy { path })
    }
}

/// A map that may be changed.
pub struct Copy {
    path: PathBuf,
}

impl Copy {
    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Copy {
    fn drop(&mut self) {
        for suffix in ["", "-wal", "-shm"] {
            let mut name = self.path.clone().into_os_string();
            name.push(suffix);
            // What is not there need not go; what stays goes with the directory.
            let _ = std::fs::remove_file(name);
        }
    }
}

/// Makes a map at `path` and imports the model in the directory `scene`, whose name it has.
fn build(scene: &Path, path: &Path) -> Result<(), Failure> {
    let about = scene.join("map.json");
    let wrong = |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", about.display()));
    let text = std::fs::read(&about).map_err(|error| wrong(&error))?;
    let MapJson { origin } = serde_json::from_slice(&text).map_err(|error| wrong(&error))?;
    let name = scene.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let candidates = ["3ds", "glb"].map(|suffix| scene.join(format!("{name}.{suffix}")));
    let model = candidates.into_iter().find(|model| model.exists()).ok_or_else(|| {
        Failure::input(format!("{}: expected {name}.3ds or {name}.glb, found neither", scene.display()))
    })?;
    let map = MapFile::create(path, &new_map(), Timestamp::now())?;
    let options = ImportOptions { origin: Some(origin), ..ImportOptions::default() };
    let head = map.head()?;
    let imported = import_model(&model, &options, map.snapshot(head)?.classes())
        .map_err(|error| Failure::from(error).about(&model))?;
    let mut transaction = UpdateTransaction::new(head, VersionKind::Import, "eval", "import");
    for object in &imported.objects {
        add_object(&mut transaction, object).map_err(|failure| failure.about(&model))?;
    }
    map.commit(&transaction, Timestamp::now())?;
    Ok(())
}

fn new_map() -> NewMap {
    NewMap {
        map_id: uuid::Uuid::now_v7().to_string(),
        frame: Frame { crs: Crs::Hk1980.to_string(), vertical_datum: "hkpd".to_owned() },
        classes: ClassTable::default(),
        author: "eval".to_owned(),
        message: "init".to_owned(),
    }
}

/// Commits the change set in `file` to the map at `path`.
pub fn apply(file: &Path, path: &Path) -> Result<(), Failure> {
    let wrong = |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| wrong(&error))?;
    let map = MapFile::open(path)?;
    let head = map.head()?;
    let changes = read_change_set(&text, map.snapshot(head)?.classes()).map_err(|error| wrong(&error))?;
    map.commit(&changes.into_transaction(head), Timestamp::now()).map_err(|error| wrong(&error))?;
    Ok(())
}

/// Whether `file` is a change set.
pub fn check(file: &Path) -> Result<(), Failure> {
    let wrong = |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| wrong(&error))?;
    read_change_set(&text, &ClassTable::default()).map_err(|error| wrong(&error))?;
    Ok(())
}
