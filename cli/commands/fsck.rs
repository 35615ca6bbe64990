//! `resurvey fsck`.

use crate::args::Fsck;
use crate::console::Console;
use crate::failure::{Failure, MAP};
use resurvey_core::store::{MapFile, Problem};
use serde_json::json;

/// Checks everything that must hold in a map, after mending what can be when asked to; exit code 13 when something does
/// not hold.
pub fn run(options: &Fsck, console: &mut Console<'_>) -> Result<u8, Failure> {
    let stage = console.stage("fsck");
    let (repaired, problems) = if options.repair {
        let map = MapFile::open(&options.map)?;
        (map.repair()?, map.fsck()?)
    } else {
        (Vec::new(), MapFile::open_read_only(&options.map)?.fsck()?)
    };
    console.finish(&stage);
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
