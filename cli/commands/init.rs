//! `resurvey init`.

use crate::args::Init;
use crate::console::Console;
use crate::failure::{Failure, INPUT, USAGE};
use jiff::Timestamp;
use resurvey_core::crs::Crs;
use resurvey_core::store::{MapFile, NewMap, StoreError};
use resurvey_core::version::Frame;
use resurvey_schema::{Class, ClassTable};
use serde_json::json;
use std::path::Path;

/// Makes an empty map.
pub fn run(options: &Init, console: &mut Console<'_>) -> Result<u8, Failure> {
    let crs: Crs = options.crs.parse()?;
    if crs != Crs::Hk1980 && !cfg!(feature = "proj") {
        let text =
            format!("{crs} needs PROJ; expected EPSG:2326, or a build with: cargo build --release --features proj");
        return Err(Failure::new(USAGE, anyhow::anyhow!(text)));
    }
    let vertical_datum = if crs == Crs::Hk1980 { "hkpd" } else { "ellipsoidal" };
    let classes = options.classes.as_deref().map_or_else(|| Ok(ClassTable::default()), read_classes)?;
    let new = NewMap {
        map_id: uuid::Uuid::now_v7().to_string(),
        frame: Frame { crs: crs.to_string(), vertical_datum: vertical_datum.to_owned() },
        classes,
        author: "resurvey".to_owned(),
        message: "init".to_owned(),
    };
    let map =
        MapFile::create(&options.map, &new, Timestamp::now()).map_err(|error| match (error, &options.classes) {
            (error @ StoreError::ClassTable { .. }, Some(classes)) => Failure::from(error).about(classes),
            // There is no map yet whose disk could fail, only a file that cannot be written.
            (error @ StoreError::Io { .. }, _) => Failure::new(INPUT, error),
            (error, _) => error.into(),
        })?;
    console.did(format_args!("{} was made", options.map.display()));
    if console.is_json() {
        let frame = map.info()?.frame;
        console.document(&json!({
            "map": options.map.display().to_string(), "map_id": new.map_id, "version": 0,
            "crs": frame.crs, "vertical_datum": frame.vertical_datum,
        }))?;
    } else {
        console.line(format_args!("{}: empty map in {crs}, heights {vertical_datum}", options.map.display()))?;
    }
    Ok(0)
}

fn read_classes(path: &Path) -> Result<ClassTable, Failure> {
    let wrong = |error: &dyn std::fmt::Display| Failure::input(format!("{}: {error}", path.display()));
    let text = std::fs::read_to_string(path).map_err(|error| wrong(&error))?;
    let classes: Vec<Class> = serde_json::from_str(&text).map_err(|error| {
        wrong(&format!("expected a JSON array of classes, as \"resurvey init --help\" has one: {error}"))
    })?;
    ClassTable::new(classes).map_err(|error| wrong(&error))
}
