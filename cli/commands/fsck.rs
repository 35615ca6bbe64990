//! `resurvey fsck`.

use crate::args::Fsck;
use crate::console::Console;
use crate::failure::{Failure, MAP};
use resurvey_core::store::{MapFile, Problem, StoreError};
use serde_json::json;

/// Checks everything that must hold in a map, after mending what can be when asked to; exit code 13 when something does
/// not hold.
pub fn run(options: &Fsck, console: &mut Console<'_>) -> Result<u8, Failure> {
    let stage = console.stage("fsck");
    let examined = examine(options);
    console.finish(&stage);
    let (repaired, problems) = examined.map_err(unreadable)?;
    let is_ok = problems.is_empty();
    if console.is_json() {
        let texts = |all: &[Problem]| all.iter().map(ToString::to_string).collect::<Vec<_>>();
        let mut document = json!({ "ok": is_ok, "problems": texts(&problems) });
        if options.repair {
            document["repaired"] = json!(texts(&repaired));
        }
        console.document(&document)?;
    } else {
        for repair in &repaired {
            console.line(format_args!("repaired: {repair}"))?;
        }
        for problem in &problems {
            console.line(problem)?;
        }
        let verdict = if is_ok { "ok".to_owned() } else { format!("{} problems", problems.len()) };
        console.line(format_args!("{}: {verdict}", options.map.display()))?;
    }
    Ok(if is_ok { 0 } else { MAP })
}

/// What was mended, and what is wrong.
fn examine(options: &Fsck) -> Result<(Vec<Problem>, Vec<Problem>), StoreError> {
    if options.repair {
        let map = MapFile::open(&options.map)?;
        return Ok((map.repair()?, map.fsck()?));
    }
    Ok((Vec::new(), MapFile::open_read_only(&options.map)?.fsck()?))
}

/// A file that cannot even be opened: that is what is wrong with it.
fn unreadable(error: StoreError) -> Failure {
    let problem = match &error {
        StoreError::Damaged { path, detail } => format!("{}: the map file is damaged: {detail}", path.display()),
        StoreError::NotAMap { .. } | StoreError::NewerFormat { .. } | StoreError::Io { .. } => error.to_string(),
        _ => return error.into(),
    };
    let next = if matches!(error, StoreError::Damaged { .. }) { "; restore the file from a copy" } else { "" };
    let document = json!({ "ok": false, "problems": [format!("file: {problem}")] });
    Failure::new(MAP, anyhow::anyhow!("{problem}{next}")).with_document(document)
}
