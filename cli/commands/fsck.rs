//! `resurvey fsck`.

use crate::args::Fsck;
use crate::console::Console;
use crate::failure::{Failure, MAP};
use resurvey_core::store::MapFile;
use serde_json::json;

/// Checks everything that must hold in a map; exit code 13 when something does not.
pub fn run(options: &Fsck, console: &mut Console<'_>) -> Result<u8, Failure> {
    let stage = console.stage("fsck");
    let problems = MapFile::open_read_only(&options.map)?.fsck()?;
    console.finish(&stage);
    let is_ok = problems.is_empty();
    if console.is_json() {
        let problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
        console.document(&json!({ "ok": is_ok, "problems": problems }))?;
    } else {
        for problem in &problems {
            console.line(problem)?;
        }
        let verdict = if is_ok { "ok".to_owned() } else { format!("{} problems", problems.len()) };
        console.line(format_args!("{}: {verdict}", options.map.display()))?;
    }
    Ok(if is_ok { 0 } else { MAP })
}
